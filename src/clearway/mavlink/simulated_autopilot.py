"""A simulated autopilot: flies in a mission's world by the set-points that come, and tells what an
autopilot tells.

HEARTBEAT, ATTITUDE, LOCAL_POSITION_NED, GPS_GLOBAL_ORIGIN, OBSTACLE_DISTANCE cast into the world,
and ADSB_VEHICLE of the mission's intruders. The mission's time begins with the first set-point.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from dataclasses import replace
from typing import Any

import numpy as np

from clearway.base.frames import geodetic_from_enu
from clearway.io.json_values import round_number
from clearway.live.link.set_point import SetPoint
from clearway.mavlink import dialect as known
from clearway.mavlink import simulated_telemetry as telemetry
from clearway.mavlink.dialect import Message, dialect
from clearway.mavlink.links import FrameLink
from clearway.mavlink.outbox import Packer
from clearway.mavlink.signing import SignatureCheck
from clearway.mavlink.simulated_habits import Habits, default_habits
from clearway.mavlink.simulated_targets import Target, VelocityTarget, name_controller, target_of
from clearway.mavlink.simulated_traffic import SimulatedTraffic
from clearway.mavlink.simulated_vehicle import VehicleLimits, VehicleTruth, ground_of
from clearway.mavlink.wire import frames_in
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import CombinedWorld

BOOT_S = 10.0
"""Time since boot at which the simulation begins."""
SOMEWHERE = (52.0, 4.3, 10.0)
"""Origin of missions that have none."""
TARGET = 84
STATUSTEXT = 253
SET_MESSAGE_INTERVAL = 511
ACCEPTED = 0
DENIED = 2
HEARD = (known.HEARTBEAT, TARGET, 247, STATUSTEXT, known.COMMAND_LONG, 20)
"""Beside them COLLISION and PARAM_REQUEST_READ."""


class SimulatedAutopilot:
    """The vehicle, its sensors and its side of the link."""

    def __init__(
        self,
        file: MissionFile,
        setup: FlightSetup,
        link: FrameLink,
        key: bytes | None,
        habits: Habits | None = None,
    ) -> None:
        self.heard: Counter[str] = Counter()
        self.refused: Counter[str] = Counter()
        self.texts: list[str] = []
        self.time_s = 0.0
        self.habits = habits = habits or default_habits(setup.planner.automaton)
        self._limits = VehicleLimits(
            setup.planner.speed_mps,
            habits.acceleration_mps2,
            habits.climb_acceleration_mps2,
            habits.tilt_s,
            habits.jerk_mps3,
            habits.trims_for_s,
        )
        self._setup, self._link = setup, link
        self._packer = Packer(1, 1, key)
        self._check = None if key is None else SignatureCheck(key)
        messages = dialect().mavlink_map
        self._extras = {number: int(messages[number].crc_extra) for number in HEARD}
        self._codec = dialect().MAVLink(None)
        start = setup.mission.start
        self._origin = np.array(file.mission.origin_geodetic or SOMEWHERE)
        self.ground_m = ground_of(setup)
        place = start.position_m.copy()
        if self.habits.takes_off_s or self.habits.stays_on_ground:
            place[2] = self.ground_m
        self.truth = VehicleTruth(place, np.zeros(3), float(start.attitude_rad[2]))
        self._climb_mps = (start.position_m[2] - self.ground_m) / max(self.habits.takes_off_s, 1e-9)
        self._took_off = not (self.habits.takes_off_s or self.habits.stays_on_ground)
        self._take_off_ended = False
        self._began_s: float | None = None
        self.target: Target | None = None
        self._flown: Target | None = None
        self._coming: deque[tuple[float, Target]] = deque()
        self.target_ms = -1
        self._target_s = -math.inf
        self.unanswered = 0
        self._traffic = SimulatedTraffic(setup, self.habits, self._origin)
        told = file.lidar[0].max_range_m if file.lidar else None
        self._range_m = told or setup.planner.grid.range_m
        self._asked: set[int] = set()
        self.shown: set[int] = set()
        """Sectors that have shown anything."""
        self.nearest_obstacle_m = math.inf
        self.lowest_m = math.inf
        self.fastest_mps = 0.0
        self.path_m = 0.0

    # --- the world ------------------------------------------------------------------------

    @property
    def mission_s(self) -> float | None:
        """Time of the mission; None before it has begun."""
        return None if self._began_s is None else self.time_s - self._began_s

    @property
    def boot_ms(self) -> int:
        """By its clock, which may have stood still for a while."""
        at_s, for_s = self.habits.stall_s
        stood_s = min(max(0.0, self.time_s - at_s), for_s)
        return round(1000.0 * (BOOT_S + self.time_s - stood_s))

    @property
    def nearest_intruder_m(self) -> float:
        """That it came to the edge of one."""
        return self._traffic.nearest_m

    @property
    def stalls(self) -> bool:
        at_s, for_s = self.habits.stall_s
        return at_s <= self.time_s < at_s + for_s

    @property
    def follows(self) -> bool:
        """Whether its mode follows set-points."""
        first, last = self.habits.pauses_s
        return self.time_s >= self.habits.follows_from_s and not first <= self.time_s < last

    def fly(self, until_s: float, step_s: float = 0.02) -> None:
        """Follow the latest set-point, or stay, up to a time."""
        while self.time_s < until_s - 1e-9:
            step = min(step_s, until_s - self.time_s)
            before = self.truth.position_m
            if not self.stalls:
                self._move(step)
            self.time_s += step
            self.path_m += float(np.linalg.norm(self.truth.position_m - before))
            self.fastest_mps = max(self.fastest_mps, float(np.linalg.norm(self.truth.velocity_mps)))
            if self._took_off:
                self.lowest_m = min(self.lowest_m, float(self.truth.position_m[2]))
            self._measure()

    def _move(self, step: float) -> None:
        if not self._took_off:
            self._take_off(step)
            return
        hover = SetPoint(self.truth.position_m, None, self.truth.yaw_rad)
        while self._coming and self._coming[0][0] <= self.time_s + 1e-9:
            self._begin(self._coming.popleft()[1])
        target = self._flown
        late = target is not None and target.velocity_mps is not None
        if late and self.time_s - self._target_s > self.habits.timeout_s:
            target = None
        away = np.array(self.habits.led_away_mps)
        if not self.follows:
            target = VelocityTarget(away, 0.0) if away.any() else None
        told_for_s = self.time_s - self._target_s - self.habits.dead_s
        self.truth = self.truth.after(step, target or hover, self._limits, told_for_s)

    def _begin(self, target: Target) -> None:
        """Fly by a set-point from now on; by another kind, as a controller that begins."""
        before, self._flown = self._flown, target
        if (
            self.habits.trims_for_s
            and before is not None
            and name_controller(before) != name_controller(target)
        ):
            self.truth = self.truth.trim_anew()

    def _take_off(self, step: float) -> None:
        """Straight up, unless a set-point has ended it."""
        if self.habits.stays_on_ground or self._take_off_ended:
            return
        place = self.truth.position_m + np.array([0.0, 0.0, step * self._climb_mps])
        self.truth = VehicleTruth(place, np.zeros(3), self.truth.yaw_rad)
        self._took_off = self.time_s + step >= self.habits.takes_off_s

    def _measure(self) -> None:
        """How near it comes to what is there."""
        place = self.truth.position_m
        gap = float(self._setup.world.distance_m(place[None])[0])
        self.nearest_obstacle_m = min(self.nearest_obstacle_m, gap)
        if self.mission_s is not None:
            self._traffic.move(place, self.truth.yaw_rad, self.mission_s)

    # --- out ------------------------------------------------------------------------------

    def tell(self) -> None:
        """Everything that is due; the position last, so that it comes with all else known."""
        if self.stalls:
            return
        for message in self._due():
            number = message.get_msgId()
            if not self.habits.asks_first or number in self._asked or number == known.HEARTBEAT:
                self._link.send(self._packer.pack(message))

    def _due(self) -> list[Message]:
        truth, boot_ms = self.truth, self.boot_ms
        local = np.array([0.0, 0.0, self.habits.height_off_m])
        messages: list[Message] = []
        if round(self.time_s * 1000) % 1000 < 1:
            flying = telemetry.IN_AIR if self._took_off else telemetry.TAKING_OFF
            state = telemetry.ON_GROUND if self.habits.stays_on_ground else flying
            origin = geodetic_from_enu(local, self._origin)
            messages += [
                telemetry.pulse(armed=not self.habits.stays_on_ground, follows=self.follows),
                telemetry.report_landing(state),
                telemetry.local_origin(origin),
                telemetry.home(self._origin, self.ground_m),
                telemetry.health(proximity=self.time_s < self.habits.sensor_dies_s),
            ]
        messages += self._traffic.report_news(self.mission_s, self.time_s)
        if self.target is not None and not self.habits.deaf:
            messages.append(telemetry.target(self.target, boot_ms))
        tilt = math.radians(self.habits.tilt_deg)
        messages.append(telemetry.attitude(truth, boot_ms, tilt))
        if self.time_s < self.habits.sensor_dies_s:
            bodies = ObstacleMap(self._traffic.bodies(self.mission_s))
            world = CombinedWorld([self._setup.world, bodies])
            far = telemetry.measure_sectors(truth, world, self._range_m, tilt)
            if self.habits.sectors:
                messages += telemetry.eighths(far, boot_ms, self._range_m, self.shown)
            else:
                messages.append(telemetry.circle(far, boot_ms, self._range_m))
        there = replace(truth, position_m=truth.position_m - local)
        return [*messages, telemetry.report_position(there, boot_ms)]

    # --- in -------------------------------------------------------------------------------

    def listen(self) -> None:
        """Take what has come: the newest set-point counts."""
        for data, peer in self._link.receive():
            frames, _ = frames_in(data, self._extras, self.refused, stream=self._link.stream)
            for frame in frames:
                flaw = None if self._check is None else self._check.flaw(frame)
                if flaw is not None:
                    self.refused[flaw] += 1
                    continue
                self._link.answer_to(peer)
                self._take(self._codec.decode(bytearray(frame.data)), frame.message)

    def _take(self, message: Message, number: int) -> None:
        self.heard[message.get_type()] += 1
        if number == STATUSTEXT:
            self.texts.append(str(message.text))
        elif number == known.COMMAND_LONG and message.command == SET_MESSAGE_INTERVAL:
            self._take_question(int(message.param1))
        elif number == TARGET and not self.habits.deaf:
            self._take_target(message)

    def _take_question(self, wanted: int) -> None:
        """For a message, to come from now on."""
        refused = wanted in self.habits.refuses
        if not refused:
            self._asked.add(wanted)
        result = DENIED if refused else ACCEPTED
        told = telemetry.answer(SET_MESSAGE_INTERVAL, result, 1, known.OBSTACLE_AVOIDANCE)
        self._link.send(self._packer.pack(told))

    def _take_target(self, message: Message) -> None:
        if not self._took_off:
            self._take_off_ended = True
            return
        if not self.follows:
            return
        if self._began_s is None:
            self._began_s = self.time_s
        told = target_of(message, self.truth.yaw_rad, self.habits.height_off_m)
        if told is not None:
            self.target = told
            self._coming.append((self.time_s + self.habits.dead_s, told))
            self.target_ms, self._target_s = message.time_boot_ms, self.time_s

    @property
    def has_arrived(self) -> bool:
        """Whether it holds a place and has come to rest there."""
        target = self.target
        if target is None or target.velocity_mps is not None or not self.follows:
            return False
        still = float(np.linalg.norm(self.truth.velocity_mps))
        return still < 0.1 * self._setup.planner.speed_mps

    def summary(self) -> dict[str, Any]:
        """How the flight went in truth."""
        goal = self._setup.mission.goals_m[-1]
        return {
            "time_s": round(self.mission_s or 0.0, 3),
            "path_m": round(self.path_m, 3),
            "arrived": self.has_arrived,
            "from_goal_m": round(float(np.linalg.norm(self.truth.position_m - goal)), 3),
            "nearest_obstacle_m": round_number(self.nearest_obstacle_m, 3),
            "nearest_intruder_m": round_number(self.nearest_intruder_m, 3),
            "lowest_m": round_number(self.lowest_m, 3),
            "fastest_mps": round(self.fastest_mps, 3),
            "heard": dict(self.heard),
            "refused": dict(self.refused),
            "texts": self.texts,
        }
