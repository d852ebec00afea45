"""Several planners on the same missions with the same seeds, and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from clearway.missions.setup import FlightSetup
from clearway.sim import Run
from clearway.sim.baselines import PLANNERS
from clearway.sim.pilot import Steering

SetupOf = Callable[[int], FlightSetup]
"""The flight of a seed, ready for any planner."""


@dataclass(frozen=True, eq=False)
class ComparedFlight:
    """One planner's flight."""

    planner: str
    run: Run[Steering]
    hidden: str = ""
    """What of it the planner cannot know, in words; empty for nothing."""


@dataclass(frozen=True, slots=True)
class PlannerStanding:
    """What one planner did, over all its flights."""

    planner: str
    hidden: str
    """What of some flight it cannot know, in words: what it keeps off then says nothing of it."""
    flights: int
    reached: int
    """Flights that came to the last waypoint."""
    safe: int
    """Flights that reached it without violation."""
    crashed: int
    time_s: float
    """On average over the flights that reached the last waypoint; NaN if none did."""
    path_length_m: float
    """The same."""
    min_distance_m: float
    """Smallest distance to any surface, of obstacles or of intruders, over all flights."""
    margin_violations: int
    emergencies: int
    decision_ms_p50: float
    decision_ms_p99: float


def fly_all(
    setup_of: SetupOf, planners: Sequence[str], seeds: Sequence[int], folder: Path | None = None
) -> Iterator[ComparedFlight]:
    """Every planner with every seed, all planners of a seed before the next seed.

    folder: where modules of users' own planners are looked for before the current one.
    """
    for seed in seeds:
        setup = setup_of(seed)
        for planner in planners:
            hidden = PLANNERS.find(planner, folder).describe_hidden(setup.dangers)
            yield ComparedFlight(planner, setup.fly_with(planner, folder=folder), hidden)


def sum_up_planner(flights: Sequence[ComparedFlight]) -> PlannerStanding:
    """Sums and averages of one planner's flights, at least one."""
    runs = [flight.run for flight in flights]
    arrived = [run for run in runs if run.reached]
    elapsed = [entry.elapsed_s for run in runs for entry in run.decisions]
    decisions_ms = 1e3 * np.array(elapsed) if elapsed else np.full(1, np.nan)
    return PlannerStanding(
        flights[0].planner,
        hidden=next((flight.hidden for flight in flights if flight.hidden), ""),
        flights=len(runs),
        reached=len(arrived),
        safe=sum(run.safe for run in runs),
        crashed=sum(run.crashed_s is not None for run in runs),
        time_s=_mean([run.metrics.time_s for run in arrived]),
        path_length_m=_mean([run.metrics.path_length_m for run in arrived]),
        min_distance_m=min(float(run.nearest_surface_m.min()) for run in runs),
        margin_violations=sum(run.metrics.margin_violations for run in runs),
        emergencies=sum(run.emergencies for run in runs),
        decision_ms_p50=float(np.percentile(decisions_ms, 50)),
        decision_ms_p99=float(np.percentile(decisions_ms, 99)),
    )


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else float("nan")
