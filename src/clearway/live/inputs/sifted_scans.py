"""Scans of LiDARs as memory takes them: without lone returns that wait for another scan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from clearway.avoidance.plan.held_escape import Escape
from clearway.avoidance.plan.planner import Planner
from clearway.base.state import State
from clearway.live.inputs.reaction import bound_flown_m, reaction_m
from clearway.sensors import LidarSensor, PointMemory, RangeSensor, Scan
from clearway.sensors.memory.remembered import Balls
from clearway.sensors.memory.sifting import NO_BALLS, NO_RETURNS, RainSieve, Sifted, sift
from clearway.sensors.observed.free_space import FreeSpace
from clearway.sensors.observed.seen_space import mark_unlooked

HELD_BACK = "scan: lone returns that wait for a second scan: rain or dust?"


class ScanBefore(NamedTuple):
    """The scan before, as it is known by now."""

    scan: Scan
    state: State


class SiftedScans:
    """A sieve for each LiDAR; settings are the planner's."""

    def __init__(self, planner: Planner, sensors: Mapping[str, RangeSensor]) -> None:
        self._planner = planner
        self.sieves = {
            name: RainSieve(sensor.lidar.false_returns > 0.0)
            for name, sensor in sensors.items()
            if isinstance(sensor, LidarSensor)
        }
        self._seen_from: dict[str, State] = {}

    def take(
        self,
        sensor: RangeSensor,
        scan: Scan,
        state: State,
        memory: PointMemory,
        free_space: FreeSpace | None,
        ground_m: float,
    ) -> tuple[Sifted, PointMemory, ScanBefore | None]:
        """Return what of a scan counts now, the memory that takes it, and the scan before where
        that is known better by now.

        memory, free_space: of before the scan. ground_m: height of ground that is no obstacle.
        """
        if not isinstance(sensor, LidarSensor):
            return Sifted(scan, NO_RETURNS), memory, None
        name, planner = sensor.name, self._planner
        before = self._seen_from.get(name)
        self._seen_from[name] = state
        sieve, counts = sift(
            self.sieves[name],
            sensor.lidar,
            scan,
            state,
            memory.told,
            reaction_m(planner) + bound_flown_m(planner, before, state),
            tolerance_m=planner.settings.sigmas * state.position_std_m,
            reach_m=memory.reach_m,
            ground_m=ground_m,
        )
        self.sieves[name] = sieve = self._where_unlooked(sieve, free_space)
        if sieve.since_s != memory.sifted_from_s:
            memory = replace(memory, sifted_from_s=sieve.since_s)
        if counts.before is None or before is None:
            return counts, memory, None
        return counts, memory, ScanBefore(counts.before, before)

    def count_held(self, name: str) -> int:
        """How many returns of the latest scan of a sensor wait."""
        return self.sieves[name].held if name in self.sieves else 0

    def _where_unlooked(self, sieve: RainSieve, free_space: FreeSpace | None) -> RainSieve:
        """A sieve whose returns all wait, but for those where the vehicle may fly though no scan
        showed the place to be free."""
        balls, escape = sieve.at_once, self._planner.settings.escape
        if free_space is None or not len(balls.radius_m):
            return sieve
        if escape == Escape.STRICT:  # Nothing is flown where no scan has shown it to be free.
            return replace(sieve, at_once=NO_BALLS)
        counts = mark_unlooked(free_space.seen, *balls, escape == Escape.MAPPED)
        return replace(sieve, at_once=Balls(*(np.asarray(each)[counts] for each in balls)))
