"""What flights come to: random ball worlds, and the static mission with every rating."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import cache
from multiprocessing import get_context

import numpy as np

from benchmarks.decisions import static_mission, with_seed
from benchmarks.table import Benchmark, Row, Target
from clearway.avoidance.rate.fusion import RATINGS
from clearway.cli.progress import progress_bar
from clearway.live import AvoidanceSystem
from clearway.sim import Run, SimulationSettings, simulate
from clearway.sim.worlds import ball_world

PROCESSES = 2
CRASH_M = 0.3
"""Radius of the vehicle's body."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One flight in a few numbers."""

    safe: bool
    """Reached, and never nearer than the margin."""
    nearest_m: float
    emergencies: int
    time_s: float


Flight = Callable[[], Outcome]


def outcome_of(run: Run) -> Outcome:
    nearest = run.metrics.min_obstacle_distance_m
    return Outcome(run.safe, nearest, run.emergencies, run.metrics.time_s)


@dataclass(frozen=True, slots=True)
class BallFlight:
    """A leg through a world of balls, with the sensor and the planner of the static mission."""

    seed: int
    latency_s: float

    def __call__(self) -> Outcome:
        setup = static_mission()
        world, mission, *_ = ball_world(self.seed)
        settings = SimulationSettings(seed=self.seed, scan_latency_s=self.latency_s)
        system = AvoidanceSystem(setup.planner, mission, lidars=setup.lidars)
        return outcome_of(simulate(system, world, lidars=setup.lidars, settings=settings))


@dataclass(frozen=True, slots=True)
class StaticFlight:
    """The static mission with one rating and one seed of noise and drop-outs."""

    rating: str
    seed: int

    def __call__(self) -> Outcome:
        return outcome_of(with_seed(static_mission(self.rating), self.seed).fly())


@cache
def executor() -> ProcessPoolExecutor:
    """Fresh processes: forked ones would inherit the progress bar's thread."""
    return ProcessPoolExecutor(PROCESSES, mp_context=get_context("spawn"))


def flown(name: str, flights: Sequence[Flight]) -> list[Outcome]:
    """All flights, side by side, with a progress bar on standard error."""
    with progress_bar(name, len(flights)) as bar:
        waiting = [executor().submit(flight) for flight in flights]
        for _ in as_completed(waiting):
            bar.advance()
    return [flight.result() for flight in waiting]


def outcomes_row(what: str, outcomes: Sequence[Outcome], least_share: float) -> Row:
    """Shares and extremes of many flights; where all must do, none may meet an emergency."""
    safe = sum(each.safe for each in outcomes)
    nearest = min(each.nearest_m for each in outcomes)
    crashes = sum(each.nearest_m <= CRASH_M for each in outcomes)
    emergencies = sum(each.emergencies > 0 for each in outcomes)
    middle = float(np.median([each.time_s for each in outcomes]))
    enough = safe >= least_share * len(outcomes) and crashes == 0
    target = Target(f">= {100.0 * least_share:g} %, no crash", enough)
    if least_share == 1.0:
        target = Target("all, no emergency", enough and emergencies == 0)
    return Row(
        what,
        f"{safe} of {len(outcomes)}",
        f"nearest {nearest:.2f} m, crashes {crashes}, "
        f"with an emergency {emergencies}, {middle:.1f} s of flight",
        target,
    )


def ball_worlds(latency_s: float) -> Callable[[bool], Row]:
    """Share of random worlds in which the goal is reached with the margin kept."""

    def measure(quick: bool) -> Row:
        number = 20 if quick else 200
        age = f"{latency_s:g}-s-old scans" if latency_s else "fresh scans"
        outcomes = flown(
            f"ball worlds, {age}", [BallFlight(seed, latency_s) for seed in range(number)]
        )
        return outcomes_row(
            f"{number} random worlds of 30-240 balls, {age}: goal reached with margin",
            outcomes,
            0.99,
        )

    return measure


def static_missions(rating: str) -> Callable[[bool], Row]:
    """Every seed must reach all waypoints, with the margin kept."""

    def measure(quick: bool) -> Row:
        number = 4 if quick else 20
        outcomes = flown(
            f"static mission, {rating}", [StaticFlight(rating, seed) for seed in range(number)]
        )
        return outcomes_row(
            f"static mission, rating {rating}, {number} seeds of noise and drop-outs: "
            "all waypoints reached with margin",
            outcomes,
            1.0,
        )

    return measure


BENCHMARKS = (
    *(
        Benchmark(f"static mission, {rating}", static_missions(rating), headline=True)
        for rating in RATINGS
    ),
    Benchmark("ball worlds, fresh", ball_worlds(0.0), headline=True),
    Benchmark("ball worlds, 1 s old", ball_worlds(1.0), headline=True),
)
