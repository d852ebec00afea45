"""Distances of a flight into scans: OBSTACLE_DISTANCE, DISTANCE_SENSOR, OBSTACLE_DISTANCE_3D.

Whole circles come as OBSTACLE_DISTANCE; a proximity sensor of the autopilot's comes as one
DISTANCE_SENSOR for each of its sectors; single obstacles come as OBSTACLE_DISTANCE_3D. The first
counts before the second. What none of them tells of is unknown.

ArduPilot tells of no sector while none shows anything. A sensor that died is silent alike, but for
SYS_STATUS, which says whether it is healthy.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from clearway.base.frames import FloatArray, world_from_body
from clearway.base.state import State
from clearway.live.link.hearing import Hearing
from clearway.mavlink.dialect import Message
from clearway.mavlink.distances import (
    BODY_FRD,
    OTHER_FRAME,
    TOUCHING_M,
    Sectors,
    make_sector_scan,
    nothing_known,
)
from clearway.sensors import Lidar, Scan

LEVEL_ORIENTATIONS = 8
"""MAV_SENSOR_ROTATION_NONE, YAW_45 and so on: sectors of 45 degrees, clockwise from ahead."""
SECTOR_DEG = 45.0
FINE_DEG = 5.0
TOGETHER_S = 0.5
"""Sectors told within this time make one scan."""
CIRCLES_S = 1.0
"""After OBSTACLE_DISTANCE, single sectors tell nothing new for so long."""
MOST_OBSTACLES = 1000
PROXIMITY = 0x2000000
"""MAV_SYS_STATUS_SENSOR_PROXIMITY."""

NOT_LEVEL = "distances: a sensor that looks neither level nor ahead"
UNREADABLE = "distances: no number"


@dataclass(frozen=True, slots=True)
class _Sector:
    time_s: float
    distance_m: float
    reach_m: float
    blind_m: float
    width_deg: float
    by_autopilot: bool


@dataclass(slots=True)
class Surroundings:
    """Takes messages, and gives a session scans of `sensor`; None where the mission has none."""

    session: Hearing
    sensor: Lidar | None
    counts: Counter[str]
    _circle_s: float = -math.inf
    _sectors: dict[int, _Sector] = field(default_factory=dict)
    _sectors_s: float = -math.inf  # When one was told, by our clock.
    _news: bool = False
    _last: tuple[float, Sectors] | None = None
    _obstacles: list[tuple[float, FloatArray]] = field(default_factory=list)

    def take_circle(self, message: Message, wall_s: float) -> None:
        """OBSTACLE_DISTANCE; its time since boot, or since 1970, may be nonsense."""
        sectors = Sectors.of(message, self.counts)
        if sectors is not None:
            self._circle_s = wall_s
            self._tell(message.time_usec * 1e-6, sectors, wall_s)

    def take_sector(
        self, message: Message, time_s: float, wall_s: float, *, by_autopilot: bool = True
    ) -> None:
        """DISTANCE_SENSOR: one of eight sectors round the vehicle."""
        if message.orientation >= LEVEL_ORIENTATIONS:
            self.counts[NOT_LEVEL] += 1
            return
        if wall_s - self._circle_s <= CIRCLES_S:
            return
        reach = 0.01 * message.max_distance
        distance = max(0.01 * message.current_distance, TOUCHING_M)
        if not reach > 0.0:
            self.counts[UNREADABLE] += 1
            return
        wide = math.degrees(message.horizontal_fov)
        width = wide if 0.0 < wide < SECTOR_DEG else SECTOR_DEG
        far = distance >= reach
        blind = 0.01 * message.min_distance
        sector = _Sector(time_s, math.inf if far else distance, reach, blind, width, by_autopilot)
        self._sectors[message.orientation] = sector
        self._sectors_s, self._news = wall_s, True

    def take_health(self, message: Message, wall_s: float) -> None:
        """SYS_STATUS: silent sectors of the autopilot's healthy sensor show nothing within reach.

        Those that never told anything may be where it does not look.
        """
        health = message.onboard_control_sensors_present
        health &= message.onboard_control_sensors_enabled & message.onboard_control_sensors_health
        if not health & PROXIMITY or wall_s - max(self._sectors_s, self._circle_s) <= TOGETHER_S:
            return
        free = {
            number: replace(each, distance_m=math.inf)
            for number, each in self._sectors.items()
            if each.by_autopilot
        }
        if free and not self._news:
            self._tell(None, _join(free), wall_s)

    def take_obstacle(self, message: Message, time_s: float) -> None:
        """OBSTACLE_DISTANCE_3D: one obstacle, forward, right, down of the vehicle."""
        place = np.array([message.x, -message.y, -message.z])
        if message.frame != BODY_FRD:
            self.counts[OTHER_FRAME] += 1
        elif not np.all(np.abs(place) <= 1e4):
            self.counts[UNREADABLE] += 1
        elif len(self._obstacles) < MOST_OBSTACLES:
            self._obstacles.append((time_s, place))

    def flush(self, wall_s: float) -> None:
        """Sectors and obstacles that have come one by one, as one scan."""
        if self._news:
            self._news = False
            newest = max(sector.time_s for sector in self._sectors.values())
            oldest = newest - TOGETHER_S
            lately = {n: each for n, each in self._sectors.items() if each.time_s >= oldest}
            self._tell(newest, _join(lately), wall_s)
        if not self._obstacles:
            return
        newest = max(time_s for time_s, _ in self._obstacles)
        places = np.array([place for _, place in self._obstacles])
        self._obstacles.clear()
        lidar, counts = self.sensor, self.counts
        known = nothing_known(1.0 if lidar is None else lidar.pattern.max_range_m)
        if self._last is not None and abs(newest - self._last[0]) <= TOGETHER_S:
            known = self._last[1]

        def scan_at(state: State, heading_rad: float) -> Scan:
            assert lidar is not None
            scan = make_sector_scan(known, lidar, state, heading_rad, counts, self._tilt_rad)
            turned = world_from_body([0.0, 0.0, heading_rad])
            points = places @ turned.T @ state.world_from_body
            return replace(scan, points_m=np.concatenate([scan.points_m, points]))

        self.session.hear_scan(newest, scan_at, wall_s)

    @property
    def _tilt_rad(self) -> float:
        """How far the vehicle was off the level lately."""
        return 0.0 if self.session.motion is None else self.session.motion.tilt_rad

    def _tell(self, told_s: float | None, sectors: Sectors, wall_s: float) -> None:
        lidar, counts = self.sensor, self.counts
        if sectors.blind_m <= self.session.planner.settings.body_radius_m:
            sectors = replace(sectors, blind_m=0.0)  # Where the vehicle is, nothing stands.
        self._last = None if told_s is None else (told_s, sectors)

        def scan_at(state: State, heading_rad: float) -> Scan:
            assert lidar is not None
            return make_sector_scan(sectors, lidar, state, heading_rad, counts, self._tilt_rad)

        self.session.hear_scan(told_s, scan_at, wall_s)


def _join(told: Mapping[int, _Sector]) -> Sectors:
    """Sectors by where they look, as a circle of small ones."""
    count = round(360.0 / FINE_DEG)
    distance = np.full(count, np.nan)
    reach = math.inf
    middles = FINE_DEG * np.arange(count)
    for orientation, sector in told.items():
        off = (middles - SECTOR_DEG * orientation + 180.0) % 360.0 - 180.0
        within = np.abs(off) <= max(0.5 * sector.width_deg, 0.5 * FINE_DEG - 1e-9)
        # On the border of two sectors the nearer one counts.
        distance[within] = np.fmin(distance[within], sector.distance_m)
        reach = min(reach, sector.reach_m)
    blind = max(sector.blind_m for sector in told.values())
    return Sectors(distance, math.radians(FINE_DEG), 0.0, False, reach, blind)
