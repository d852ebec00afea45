"""Situations of any kind: usable ones, and ones with impossible values anywhere."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np

from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.clear.hazards import PointHazards
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.costs import Prices
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.base.errors import ClearwayError
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import Scan, detect
from clearway.sensors.beams.lidar import Lidar
from clearway.traffic import Intruder

NEVER = (np.nan, np.inf, -np.inf, 1e300, -1e300)
"""Values that no field takes."""
EXTREME = (0.0, -0.0, 1e-300, 1e-9, 1e9, 1e5)
VERIFIED = (Basis.RATED, Basis.VERIFIED, Basis.AGAINST_RULES)


class Draws:
    """Values of one situation; knows whether an impossible one was among them."""

    def __init__(self, seed: int, poison: float) -> None:
        self.rng = np.random.default_rng(seed)
        self.poison = poison
        self.impossible = False

    def value(self, usual: float, *, least: float = -np.inf) -> float:
        """Mostly the usual value; else an extreme one, or one that must be refused."""
        draw = self.rng.uniform()
        if draw < self.poison:
            self.impossible = True
            choices = (*NEVER, -1.0, -1e-9) if least >= 0.0 else NEVER
            return float(self.rng.choice(choices))
        if draw < 2.0 * self.poison:
            return float(max(least, self.rng.choice(EXTREME)))
        return usual

    def vector(self, scale: float) -> list[float]:
        return [self.value(float(x)) for x in self.rng.normal(0.0, scale, 3)]

    def balls(self, count: int) -> PointHazards:
        place = self.rng.normal(0.0, 6.0, (count, 3))
        radius = self.rng.uniform(0.02, 0.3, count)
        for array, least in ((place, -np.inf), (radius, 0.0)):
            if count and self.rng.uniform() < self.poison:
                at = self.rng.integers(array.size)
                array.flat[at] = self.value(float(array.flat[at]), least=least)
        return PointHazards(place, radius)


def settings(draws: Draws) -> AvoidanceSettings:
    return AvoidanceSettings(
        unknown=draws.value(0.0, least=0.0) if draws.rng.uniform() < 0.2 else 0.0,
        safety_margin_m=draws.value(0.6, least=1e-300),
        sigmas=draws.value(3.0, least=0.0),
        own_drift_mps=draws.value(0.05, least=0.0),
        point_sigmas=draws.value(2.0, least=0.0),
        prices=Prices(turn=draws.value(0.2, least=0.0), risk=draws.value(0.5, least=0.0)),
    )


def situation(draws: Draws, grid: AvoidanceGrid, lidar: Lidar) -> Situation:
    """Any situation; raises ClearwayError for impossible ones."""
    rng = draws.rng
    state = State(
        draws.vector(20.0),  # type: ignore[arg-type]
        [draws.value(float(a)) for a in rng.uniform(-0.6, 0.6, 3)],  # type: ignore[arg-type]
        time_s=draws.value(5.0),
        position_std_m=draws.value(0.05, least=0.0),
        attitude_std_rad=draws.value(0.0, least=0.0),
    )
    detections: list[Any] = []
    if rng.uniform() < 0.3:
        points = rng.normal(0.0, 5.0, (50, 3))
        points[:3] = rng.choice([np.nan, np.inf, -np.inf, 0.0, 1e300], (3, 3))
        detection = detect(grid, lidar, Scan(points, draws.value(5.0), sensor=lidar.name))
        if rng.uniform() < draws.poison:
            draws.impossible = True
            share = detection.probability.copy()
            share[int(rng.integers(len(share)))] = rng.choice([np.nan, np.inf, -1.0, 2.0])
            detection = replace(detection, probability=share)
        detections.append(detection)
    obstacles = [
        Obstacle.ball(draws.vector(6.0), draws.value(0.5, least=1e-3))
        for _ in range(rng.integers(0, 5))
    ]
    intruders = [
        Intruder(
            draws.vector(10.0),  # type: ignore[arg-type]
            draws.vector(1.0),  # type: ignore[arg-type]
            radius_m=draws.value(0.5, least=0.0),
            time_s=draws.value(5.0),
            position_std_m=draws.value(0.1, least=0.0),
            velocity_std_mps=draws.value(0.1, least=0.0),
        )
        for _ in range(rng.integers(0, 3))
    ]
    return Situation(
        state,
        np.array(draws.vector(20.0)),
        next_m=np.array(draws.vector(20.0)) if rng.uniform() < 0.5 else None,
        reach_radius_m=draws.value(1.5, least=1e-300),
        detections=detections,
        remembered=draws.balls(int(rng.integers(0, 60))) if rng.uniform() < 0.6 else None,
        obstacle_map=ObstacleMap(obstacles),
        intruders=intruders,
        state_age_s=draws.value(0.1, least=0.0),
        range_sigma_m=draws.value(0.02, least=0.0),
    )


def outcome(planner: Planner, lidar: Lidar, seed: int, poison: float) -> str:
    """What comes of one random situation: "refused", or the basis of the decision.

    Raises AssertionError where an impossible value ends in a decision, or a decision in a number
    that is none.
    """
    draws = Draws(seed, poison)
    try:
        chosen = replace(planner, settings=settings(draws))
        decision = decide(chosen, situation(draws, planner.grid, lidar))
    except ClearwayError:
        return "refused"
    assert not draws.impossible, f"seed {seed}: decided on impossible values"
    choice = decision.choice
    assert np.all(np.isfinite(decision.path_m)), f"seed {seed}: path"
    assert np.isfinite(choice.cost_m), f"seed {seed}: cost"
    assert 0.0 < decision.margin_m < np.inf, f"seed {seed}: margin"
    assert not np.isnan(choice.clearance_m), f"seed {seed}: clearance"
    if choice.basis in VERIFIED:
        assert choice.clearance_m >= decision.margin_m - 1e-8, f"seed {seed}: below the margin"
    return str(choice.basis.name)


def outcomes(planner: Planner, lidar: Lidar, seeds: range, poison: float) -> Counter[str]:
    return Counter(outcome(planner, lidar, seed, poison) for seed in seeds)
