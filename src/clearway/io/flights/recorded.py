"""A recorded flight of any logger: its way, the readings of its sensors, and its end."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import FloatArray, IntArray
from clearway.base.brief import brief
from clearway.io.poses.pose_track import PoseTrack
from clearway.io.scans.timed_scans import ScanSequence
from clearway.sensors import BeamPattern, Lidar, Mounting

SECTOR_STEP_M = 0.5
"""Between points on the arc of a sector: finer than the margins of vehicles that have sectors."""
MOST_PARTS = 100
"""Of an arc: a sector may report anything, and what is far needs no fine step."""
WALL_M = 6.0
"""Up and down from it that an arc stands: sectors tell no height, so nobody may pass above or
below."""
STRONGEST_MPS = 150.0
"""Wind that is taken for one: none was ever measured beyond."""


class RangeReading(NamedTuple):
    """What a sensor returned at one time."""

    time_s: float
    points_m: FloatArray
    """[n, 3] sensor frame, x ahead, y left, z up; perhaps none."""
    half_width_rad: float = 0.0
    """Of the sector that each return stands for; 0 for beams."""

    def arcs(self, step_m: float = SECTOR_STEP_M) -> tuple[FloatArray, IntArray]:
        """Points [m, 3] on the arcs of all returns, so far apart along them and twice that in
        height, and whose return each is [m], ascending."""
        number = np.arange(len(self.points_m), dtype=np.int64)
        if not self.half_width_rad or not len(self.points_m):
            return self.points_m, number
        ranges = np.linalg.norm(self.points_m[:, :2], axis=1)
        wanted = np.ceil(2.0 * self.half_width_rad * ranges / step_m)
        parts = np.minimum(wanted, MOST_PARTS).astype(int) + 1
        whose = np.repeat(number, parts)
        first = np.repeat(np.cumsum(parts) - parts, parts)
        share = (np.arange(len(whose)) - first) / np.maximum(parts[whose] - 1, 1)
        angle = np.arctan2(self.points_m[:, 1], self.points_m[:, 0])[whose]
        angle += self.half_width_rad * (2.0 * share - 1.0)
        level = ranges[whose, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        high = np.linspace(-WALL_M, WALL_M, 1 + max(1, round(WALL_M / step_m)))
        walls = np.repeat(np.column_stack([level, self.points_m[whose, 2]]), len(high), axis=0)
        walls[:, 2] += np.tile(high, len(whose))
        return walls, np.repeat(whose, len(high))


@dataclass(frozen=True, slots=True, eq=False)
class RecordedSensor:
    """A sensor of a log; reading it begins anew each time."""

    name: str
    readings: Callable[[], Iterator[RangeReading]]
    """In the order of time; damaged ones are left out."""
    mounting: Mounting = field(default_factory=Mounting)
    lidar: Lidar | None = None
    """Its beams, where the log tells them."""
    sequence: ScanSequence | None = None
    """Where its scans are from."""

    __repr__ = brief


class LoggedEnd(NamedTuple):
    """What the log itself states of a crash."""

    time_s: float
    words: str


@dataclass(frozen=True, slots=True, eq=False)
class RecordedFlight:
    """All that `clearway why` reads of a log, world frame."""

    source: str
    kind: str
    track: PoseTrack
    sensors: tuple[RecordedSensor, ...]
    end: LoggedEnd | None = None
    wind: FloatArray = field(default_factory=lambda: np.zeros((0, 4)))
    """[n, 4] time and the wind's velocity as the autopilot estimated it."""
    surface_m: FloatArray | None = None
    """[n] distance to the nearest surface at the track's times, where the log has it."""
    intruders: Mapping[str, FloatArray] = field(default_factory=dict)
    """[n, 4] time and place of each other aircraft."""
    intruder_radius_m: Mapping[str, float] = field(default_factory=dict)
    mission_toml: bytes | None = None
    """The mission that was flown, where the log has it."""
    notes: tuple[str, ...] = ()

    __repr__ = brief


def keep_winds(rows: FloatArray) -> FloatArray:
    """Estimates [n, 4] of the wind without those that are no numbers, or no wind."""
    return np.asarray(rows[(np.abs(rows[:, 1:]) <= STRONGEST_MPS).all(axis=1)])


def make_sector_lidar(name: str, azimuth_rad: FloatArray, farthest_m: float) -> Lidar:
    """A level ring of sectors as beams: one each, since a silent sector shows that much to be free
    and no more."""
    pattern = BeamPattern(
        name,
        azimuth_rad,
        elevation_rad=np.zeros(len(azimuth_rad)),
        max_range_m=farthest_m,
        spacing_rad=2.0 * np.pi / max(len(azimuth_rad), 1),
    )
    return Lidar(name, pattern)


def sector_reading(time_s: float, azimuth_rad: FloatArray, ranges_m: FloatArray) -> RangeReading:
    """A reading of sectors [n]; ranges that are not finite are no returns."""
    told = np.isfinite(ranges_m)
    level = ranges_m[told, None] * np.column_stack(
        [np.cos(azimuth_rad[told]), np.sin(azimuth_rad[told])]
    )
    width = np.pi / max(len(azimuth_rad), 1)
    return RangeReading(time_s, np.column_stack([level, np.zeros(len(level))]), width)
