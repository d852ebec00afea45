"""A simulated autopilot to try `clearway mavlink` on.

`python -m clearway.mavlink.simulated MISSION` flies in a mission's world by the set-points that
come, and tells what an autopilot tells: HEARTBEAT, ATTITUDE, LOCAL_POSITION_NED, GPS_GLOBAL_ORIGIN,
OBSTACLE_DISTANCE cast into the world, and ADSB_VEHICLE of the mission's intruders. The mission's
time begins with the first set-point.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import (
    enu_from_ned,
)
from clearway.base.state import State
from clearway.io.json_values import rounded
from clearway.mavlink import dialect as known
from clearway.mavlink.dialect import Message, dialect
from clearway.mavlink.links import Link, open_link
from clearway.mavlink.outbox import Packer
from clearway.mavlink.setpoints import HOLD, SetPoint
from clearway.mavlink.signing import SignatureCheck, read_key
from clearway.mavlink.simulated_telemetry import adsb, attitude, distances, position, slow
from clearway.mavlink.simulated_vehicle import VehicleTruth
from clearway.mavlink.wire import frames_in
from clearway.missions.mission_file import MissionFile, read_mission_file
from clearway.missions.setup import FlightSetup, prepare
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import CombinedWorld
from clearway.sim.scripted import Traffic

BOOT_S = 10.0
"""Time since boot at which the simulation begins."""
SOMEWHERE = (52.0, 4.3, 10.0)
"""Origin of missions that have none."""
TARGET, TARGET_NAME = 84, "SET_POSITION_TARGET_LOCAL_NED"
HEARD = (known.HEARTBEAT, TARGET, 247, 253)
"""Beside them COLLISION and STATUSTEXT."""
ANSWER_S, SILENT_S = 5.0, 0.05
"""In lock-step, how long a set-point is waited for; and where none has come for a while."""
UNANSWERED = 3
"""So many moments without any set-point are a while."""
MOST_SILENCE_S = 30.0
"""Without any set-point for so long by our clock, it ends."""


class SimulatedAutopilot:
    """The vehicle, its sensors and its side of the link."""

    def __init__(
        self, file: MissionFile, setup: FlightSetup, link: Link, key: bytes | None
    ) -> None:
        self.heard: Counter[str] = Counter()
        self.refused: Counter[str] = Counter()
        self.texts: list[str] = []
        self.time_s = 0.0
        self._setup, self._link = setup, link
        self._packer = Packer(1, 1, key)
        self._check = None if key is None else SignatureCheck(key)
        messages = dialect().mavlink_map
        self._extras = {number: int(messages[number].crc_extra) for number in HEARD}
        self._codec = dialect().MAVLink(None)
        start = setup.mission.start
        self.truth = VehicleTruth(start.position_m, np.zeros(3), float(start.attitude_rad[2]))
        self._origin = np.array(file.mission.origin_geodetic or SOMEWHERE)
        self._began_s: float | None = None
        self.target: SetPoint | None = None
        self.target_ms = -1
        self.unanswered = 0
        speed, seed = setup.planner.speed_mps, setup.simulation.seed
        self._traffic = Traffic(setup.script, setup.mission, speed, setup.traffic, seed)
        self._names = sorted(intruder.name for intruder in setup.script)
        told = file.lidar[0].max_range_m if file.lidar else None
        self._range_m = told or setup.planner.grid.range_m
        self.nearest_obstacle_m = math.inf
        self.nearest_intruder_m = math.inf
        self.path_m = 0.0

    # --- the world ------------------------------------------------------------------------

    @property
    def mission_s(self) -> float | None:
        """Time of the mission; None before it has begun."""
        return None if self._began_s is None else self.time_s - self._began_s

    @property
    def boot_ms(self) -> int:
        return round(1000.0 * (BOOT_S + self.time_s))

    def fly(self, until_s: float, step_s: float = 0.02) -> None:
        """Follow the latest set-point, or stay, up to a time."""
        while self.time_s < until_s - 1e-9:
            step = min(step_s, until_s - self.time_s)
            hover = SetPoint(self.truth.position_m, None, self.truth.yaw_rad)
            before = self.truth.position_m
            cruise = self._setup.planner.speed_mps
            self.truth = self.truth.after(step, self.target or hover, cruise)
            self.time_s += step
            self.path_m += float(np.linalg.norm(self.truth.position_m - before))
            self._measure()

    def _measure(self) -> None:
        """How near it comes to what is there."""
        place = self.truth.position_m
        gap = float(self._setup.world.distance_m(place[None])[0])
        self.nearest_obstacle_m = min(self.nearest_obstacle_m, gap)
        if self.mission_s is None:
            return
        self._traffic.step(State(place, np.array([0.0, 0.0, self.truth.yaw_rad]), self.mission_s))
        for name, track in self._traffic.tracks.items():
            apart = float(np.linalg.norm(track[-1][1] - place)) - self._traffic.radii_m()[name]
            self.nearest_intruder_m = min(self.nearest_intruder_m, apart)

    def tell(self) -> None:
        """Everything that is due; the position last, so that it comes with all else in hand."""
        truth, boot_ms = self.truth, self.boot_ms
        messages = slow(self._origin) if round(self.time_s * 1000) % 1000 < 1 else []
        bodies: list[Obstacle] = []
        if self.mission_s is not None:
            reports = self._traffic.reports(self.mission_s)
            messages += [adsb(report, self._names, self._origin) for report in reports]
            bodies = self._traffic.bodies(self.mission_s)
        world = CombinedWorld([self._setup.world, ObstacleMap(bodies)])
        messages += [
            attitude(truth, boot_ms),
            distances(truth, boot_ms, world, self._range_m),
            position(truth, boot_ms),
        ]
        for message in messages:
            self._link.send(self._packer.pack(message))

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
        if number == 253:
            self.texts.append(str(message.text))
        if number != TARGET:
            return
        if self._began_s is None:
            self._began_s = self.time_s
        velocity = enu_from_ned([message.vx, message.vy, message.vz])
        holds = message.type_mask == HOLD
        place = enu_from_ned([message.x, message.y, message.z])
        yaw = math.pi / 2.0 - message.yaw
        self.target = SetPoint(place, None if holds else velocity, yaw)
        self.target_ms = message.time_boot_ms

    @property
    def has_arrived(self) -> bool:
        """Whether it holds a place and has come to rest there."""
        target = self.target
        if target is None or target.velocity_mps is not None:
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
            "nearest_obstacle_m": rounded(self.nearest_obstacle_m, 3),
            "nearest_intruder_m": rounded(self.nearest_intruder_m, 3),
            "heard": dict(self.heard),
            "refused": dict(self.refused),
            "texts": self.texts,
        }


def run(
    autopilot: SimulatedAutopilot,
    link: Link,
    period_s: float,
    duration_s: float,
    speedup: float | None,
) -> None:
    """Tell, listen, fly, over and over, until it has arrived or time is up."""
    began = answered = time.monotonic()
    while autopilot.time_s < duration_s and not autopilot.has_arrived:
        autopilot.tell()
        if speedup is None:
            _await_answer(autopilot, link)
        else:
            link.wait(began + autopilot.time_s / speedup - time.monotonic())
            time.sleep(max(0.0, began + autopilot.time_s / speedup - time.monotonic()))
        before = autopilot.heard[TARGET_NAME]
        autopilot.listen()
        now = time.monotonic()
        answered = now if autopilot.heard[TARGET_NAME] > before else answered
        if autopilot.target is not None and now - answered > MOST_SILENCE_S:
            break
        autopilot.fly(autopilot.time_s + period_s)


def _await_answer(autopilot: SimulatedAutopilot, link: Link) -> None:
    """Until the set-point of this moment has come, but not for ever."""
    before = autopilot.heard[TARGET_NAME]
    waiting_s = ANSWER_S if autopilot.unanswered < UNANSWERED else SILENT_S
    until = time.monotonic() + waiting_s
    while autopilot.target_ms != autopilot.boot_ms and time.monotonic() < until:
        link.wait(until - time.monotonic())
        autopilot.listen()
    any_came = autopilot.heard[TARGET_NAME] > before
    autopilot.unanswered = 0 if any_came else autopilot.unanswered + 1


def main(arguments: list[str] | None = None) -> int:
    """Entry point; 0 if the vehicle arrived, 1 if not, 2 for bad input."""
    parser = argparse.ArgumentParser(description="A simulated autopilot for `clearway mavlink`.")
    parser.add_argument("mission", help="a mission by name, or a mission file")
    parser.add_argument("--connect", default="udpout:127.0.0.1:14550")
    parser.add_argument("--rate", type=float, default=10.0, help="messages of each kind a second")
    parser.add_argument("--duration", type=float, default=600.0, help="at most; its own seconds")
    parser.add_argument("--speedup", type=float, default=1.0, help="its clock against ours")
    parser.add_argument("--lock-step", action="store_true", help="wait for every set-point")
    parser.add_argument("--signing-key", type=Path)
    options = parser.parse_args(arguments)
    try:
        key = None if options.signing_key is None else read_key(options.signing_key)
        file = read_mission_file(options.mission)
        setup = prepare(file)
        link = open_link(options.connect, Counter())
    except ClearwayError as error:
        print(error, file=sys.stderr)
        return 2
    autopilot = SimulatedAutopilot(file, setup, link, key)
    speedup = None if options.lock_step else options.speedup
    run(autopilot, link, 1.0 / options.rate, options.duration, speedup)
    link.close()
    print(json.dumps(autopilot.summary()))
    return 0 if autopilot.has_arrived else 1


if __name__ == "__main__":
    sys.exit(main())
