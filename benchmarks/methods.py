"""What each reach-set method costs in flight, as `python -m benchmarks.methods`.

The static mission, and random ball worlds with fresh and with 1-s-old scans: share flown with the
margin kept, smallest distance, decisions with an emergency, and the time of a decision.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from benchmarks.flights import Outcome, flown, outcome_of
from clearway.live import AvoidanceSystem
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import FlightSetup, prepare
from clearway.sim import SimulationSettings, simulate
from clearway.sim.worlds import ball_world

METHODS = ("primitives", "cover", "flying", "late", "dispersion", "combined", "harmonic", "chaotic")
WORLDS = range(40)
LATENCIES_S = (0.0, 1.0)


@cache
def setup_with(method: str) -> FlightSetup:
    """The static mission with another reach set."""
    return prepare(read_mission_file("static-obstacles").with_values("reach_set", method=method))


@dataclass(frozen=True, slots=True)
class MethodFlight:
    """A leg through a world of balls with one method."""

    method: str
    seed: int
    latency_s: float

    def __call__(self) -> Outcome:
        setup = setup_with(self.method)
        world, mission, *_ = ball_world(self.seed)
        system = AvoidanceSystem(setup.planner, mission, lidars=setup.lidars)
        settings = SimulationSettings(seed=self.seed, scan_latency_s=self.latency_s)
        return outcome_of(simulate(system, world, lidars=setup.lidars, settings=settings))


def balls(method: str) -> list[str]:
    """Safe flights, smallest distance and emergencies, fresh and old scans side by side."""
    columns: list[list[str]] = [[], [], []]
    for latency in LATENCIES_S:
        flights = [MethodFlight(method, seed, latency) for seed in WORLDS]
        outcomes = flown(f"{method}, {latency:g} s", flights)
        columns[0].append(str(sum(each.safe for each in outcomes)))
        columns[1].append(f"{min(each.nearest_m for each in outcomes):.2f}")
        columns[2].append(str(sum(each.emergencies for each in outcomes)))
    return [" / ".join(column) for column in columns]


def main() -> None:
    """Print the table as markdown."""
    print(
        f"| method | nodes at level | 6.4: time, nearest | decision p50 | safe of {len(WORLDS)} "
        "| nearest (m) | emergencies |\n|---|---|---|---|---|---|---|"
    )
    for method in METHODS:
        setup = setup_with(method)
        run = setup.fly()
        elapsed = np.median([entry.elapsed_s for entry in run.decisions]) * 1e3
        nodes = setup.planner.prepare(0.0).reach_set.nodes
        static = f"{run.metrics.time_s:.1f} s, {run.metrics.min_obstacle_distance_m:.2f} m"
        cells = [method, str(nodes), static, f"{elapsed:.2f} ms", *balls(method)]
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
