"""Speed of the intruder models, one thread: pytest benchmarks/bench_intruders.py.

Times are per call; `per_intruder_us` in the extra information is what the targets are for: line
5 us, spread 100 us, body 300 us, and 32 intruders with line and spread 5 ms in all.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clearway.grid import AvoidanceGrid
from clearway.intruders import (
    Intruder,
    assess_intruders,
    body_cells,
    line_cells,
    radial_vehicle_times,
    spread_cells,
)

GRID = AvoidanceGrid.uniform()
UP = np.array([0.0, 0.0, 1.0])
COUNT = 32


def paper_intruders() -> list[Intruder]:
    """The intruder of 6.3, so many times: it crosses the whole grid."""
    return [Intruder([6, 8, 0], [0, -1, 0], [np.pi / 12, np.pi / 16], radius_m=2.0)] * COUNT


def random_intruders() -> list[Intruder]:
    """Intruders on all kinds of paths through the grid."""
    rng = np.random.default_rng(1)
    found = []
    for _ in range(COUNT):
        through = rng.uniform([1, -3, -2], [9, 3, 2])
        velocity = rng.normal(size=3)
        spread = rng.uniform(0.05, 0.4, 2)
        found.append(Intruder(through - 6.0 * velocity, velocity, spread, radius_m=1.0))
    return found


SETS = {"paper": paper_intruders(), "random": random_intruders()}


def per_intruder(benchmark: Any) -> None:
    benchmark.extra_info["per_intruder_us"] = benchmark.stats["min"] / COUNT * 1e6


@pytest.mark.parametrize("which", SETS)
def bench_line(benchmark: Any, which: str) -> None:
    benchmark(line_cells, GRID, SETS[which])
    per_intruder(benchmark)


@pytest.mark.parametrize("which", SETS)
def bench_spread(benchmark: Any, which: str) -> None:
    benchmark(spread_cells, GRID, SETS[which], UP)
    per_intruder(benchmark)


@pytest.mark.parametrize("which", SETS)
def bench_body(benchmark: Any, which: str) -> None:
    benchmark(body_cells, GRID, SETS[which])
    per_intruder(benchmark)


@pytest.mark.parametrize("which", SETS)
def bench_decision_with_32_intruders(benchmark: Any, which: str) -> None:
    benchmark(assess_intruders, GRID, SETS[which], ("line", "spread"))
    per_intruder(benchmark)


def bench_timed(benchmark: Any) -> None:
    times = radial_vehicle_times(GRID, 1.0)
    benchmark(assess_intruders, GRID, SETS["paper"], ("line", "spread"), True, times)
    per_intruder(benchmark)
