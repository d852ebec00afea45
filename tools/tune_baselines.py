"""Tune the potential field and the vector field histogram, fairly: on worlds no comparison flies.

    python -m tools.tune_baselines potential-field --tries 20 --worlds 24
    python -m tools.tune_baselines vfh --tries 8 --worlds 12

A random search over the parameters. The score is the share of safe flights, then reaching the
waypoint, then time. The defaults of the potential field are the best of the first run. Those of
the histogram were set by hand, and are 0.92 safe in the second run's worlds: its flights take
seconds each, so that a search worth the name takes hours.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, fields
from functools import cache
from typing import Any

import numpy as np

from clearway.missions.setup import FlightSetup, prepare
from clearway.missions.world_file import world_mission
from clearway.sim import simulate
from clearway.sim.baselines import BaselinePilot, ManoeuvreRule
from clearway.sim.baselines.potential_field import FieldTuning, potential_field
from clearway.sim.baselines.vfh import HistogramTuning, vector_field_histogram

Tuning = FieldTuning | HistogramTuning
FAMILIES = ("balls-60", "balls-140", "forest")
FIRST_SEED = 10_000
"""Comparisons count from 0."""
SPANS: dict[str, dict[str, tuple[float, float]]] = {
    "potential-field": {
        "influence": (0.6, 2.5),
        "strength": (0.05, 3.0),
        "power": (0.5, 3.0),
        "across": (0.0, 1.0),
        "behind": (0.0, 1.0),
    },
    "vfh": {
        "spare": (0.0, 1.0),
        "horizon": (0.3, 1.0),
        "step": (0.1, 0.35),
        "ahead": (1, 4),
        "tried": (2, 4),
        "nose": (0.1, 1.0),
        "before": (0.0, 0.6),
    },
}
Score = tuple[float, float, float]
"""Share of safe flights, share that reached the waypoint, minus the mean time; larger is better."""


def main() -> None:
    """Search, and print every better tuning as it is found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("planner", choices=sorted(SPANS))
    parser.add_argument("--tries", type=int, default=60)
    parser.add_argument("--worlds", type=int, default=24)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    wanted = parser.parse_args()
    rng = np.random.default_rng(wanted.seed)
    first: Tuning = FieldTuning() if wanted.planner == "potential-field" else HistogramTuning()
    tunings = [first, *(drawn(rng, first, SPANS[wanted.planner]) for _ in range(wanted.tries))]
    best: Score = (-1.0, -1.0, 0.0)
    with ProcessPoolExecutor(wanted.workers) as pool:
        jobs = [(tuning, wanted.worlds) for tuning in tunings]
        for number, score in enumerate(pool.map(score_of, jobs)):
            better = score > best
            best = max(score, best)
            text = f"{number}: safe {score[0]:.3f}, reached {score[1]:.3f}, {-score[2]:.1f} s"
            print(text, file=sys.stderr)
            if better:
                print(f"{text}; {asdict(tunings[number])}", flush=True)


def drawn(rng: np.random.Generator, like: Tuning, spans: dict[str, tuple[float, float]]) -> Tuning:
    """A tuning at random within the spans; whole numbers stay whole."""
    values: dict[str, Any] = {}
    for entry in fields(like):
        low, high = spans[entry.name]
        whole = isinstance(getattr(like, entry.name), int)
        values[entry.name] = (
            int(rng.integers(int(low), int(high) + 1)) if whole else float(rng.uniform(low, high))
        )
    return type(like)(**values)


def score_of(job: tuple[Tuning, int]) -> Score:
    """How a tuning does in a number of worlds."""
    tuning, worlds = job
    safe, reached, times = 0, 0, []
    for number in range(worlds):
        setup = setup_of(number)
        pilot = BaselinePilot(setup.system(), rule_of(tuning, setup))
        run = simulate(pilot, setup.world, lidars=setup.lidars, settings=setup.simulation)
        safe, reached = safe + run.safe, reached + run.reached
        times.append(run.metrics.time_s)
    return safe / worlds, reached / worlds, -float(np.mean(times))


def rule_of(tuning: Tuning, setup: FlightSetup) -> ManoeuvreRule:
    """The rule with this tuning."""
    if isinstance(tuning, FieldTuning):
        return potential_field(setup.craft, tuning)
    return vector_field_histogram(setup.craft, tuning)


@cache
def setup_of(number: int) -> FlightSetup:
    """The families in turn."""
    family = FAMILIES[number % len(FAMILIES)]
    return prepare(world_mission(family, FIRST_SEED + number // len(FAMILIES)))


if __name__ == "__main__":
    main()
