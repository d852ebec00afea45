"""The other aircraft of a simulated autopilot's world, and what it tells of them."""

from __future__ import annotations

import math

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.mavlink import simulated_telemetry as telemetry
from clearway.mavlink.dialect import Message
from clearway.mavlink.simulated_habits import Habits
from clearway.missions.setup import FlightSetup
from clearway.obstacles.obstacle import Obstacle
from clearway.sim.scripted import Traffic


class SimulatedTraffic:
    """The intruders of a mission: how they fly, and ADSB_VEHICLE of them, late and old as habits
    have it."""

    def __init__(self, setup: FlightSetup, habits: Habits, origin_geodetic: FloatArray) -> None:
        self.nearest_m = math.inf
        """That the vehicle came to the edge of one."""
        self._habits, self._origin = habits, origin_geodetic
        speed, seed = setup.planner.speed_mps, setup.simulation.seed
        self._traffic = Traffic(setup.script, setup.mission, speed, setup.traffic, seed)
        self._names = sorted(intruder.name for intruder in setup.script)
        self._last_told: dict[str, tuple[float, Message]] = {}

    def move(self, place_m: FloatArray, yaw_rad: float, mission_s: float) -> None:
        """On to a time of the mission, past the vehicle at a place [3]."""
        attitude = np.array([0.0, 0.0, yaw_rad])
        self._traffic.step(State(place_m, attitude, time_s=mission_s))
        for name, track in self._traffic.tracks.items():
            apart = float(np.linalg.norm(track[-1][1] - place_m)) - self._traffic.radii_m()[name]
            self.nearest_m = min(self.nearest_m, apart)

    def bodies(self, mission_s: float | None) -> list[Obstacle]:
        """What rays meet of them; nothing before the mission has begun."""
        return [] if mission_s is None else list(self._traffic.bodies(mission_s))

    def report_news(self, mission_s: float | None, time_s: float) -> list[Message]:
        """News, or what was told before, again."""
        if mission_s is None:
            return []
        habits, said = self._habits, list[Message]()
        for report in self._traffic.reports(mission_s):
            told_s, _ = self._last_told.get(report.name, (-math.inf, None))
            silent = time_s >= habits.lost_from_s
            if time_s - told_s < habits.traffic_every_s - 1e-6 or silent:
                continue
            late_s = habits.late_s(report.name, time_s)
            light = report.radius_m > 2.0
            kind = telemetry.LIGHT if light else telemetry.UNMANNED
            then = report.at(report.time_s - late_s)
            news = telemetry.adsb(then, self._names, self._origin, kind)
            self._last_told[report.name] = (time_s, news)
            said.append(news)
        repeats = habits.traffic_every_s > 0.0 or habits.lost_from_s < math.inf
        if repeats and round(time_s * 1000) % 1000 < 1:
            said += [news for told_s, news in self._last_told.values() if told_s < time_s]
        return said
