"""Throughput of campaigns: the static mission per core, and what a second core brings."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from itertools import islice

import numpy as np

from benchmarks.table import Benchmark, Row, Target
from clearway.base.errors import ClearwayError
from clearway.studies.campaigns.engines import Engine, make_process_engine
from clearway.studies.campaigns.task import Task, fly_task

REAL_TIME, SCALING = {"strict": 300.0, "off": 1200.0}, 1.9
"""Bars, the first by what is asked of escapes."""
WARM_UP = 6
"""Flights after which all workers are under way."""


def tasks(number: int, escape: str = "strict") -> list[Task]:
    """The static mission, each with noise and drop-outs of its own."""
    return [
        Task(
            campaign="benchmark",
            settings_id="",
            source="",
            folder=".",
            label="static-obstacles",
            family="mission",
            parameters='{"mission": "static-obstacles"}',
            changes=json.dumps({"safety": {"escape": escape}}),
            planner="clearway",
            flown_by="clearway",
            seed=seed,
        )
        for seed in range(number)
    ]


def per_core(escape: str) -> Callable[[bool], Row]:
    """Time of a core by time of flight: other processes do not count."""

    def measure(quick: bool) -> Row:
        number, least = 4 if quick else 20, REAL_TIME[escape]
        rows = [fly_task(task) for task in tasks(number + 1, escape)][1:]
        ratios = [(row.time_s or 0.0) / row.cpu_s for row in rows]
        middle = float(np.median(ratios))
        a_second = number / sum(row.cpu_s for row in rows)
        return Row(
            f"{number} flights of the static mission in a campaign, by one core, escape {escape}",
            f"{middle:.0f} x real time",
            f"{min(ratios):.0f} to {max(ratios):.0f} x; {a_second:.1f} flights a second",
            Target(f">= {least:.0f} x", middle >= least),
            measured=middle,
        )

    return measure


def second_core(quick: bool) -> Row:
    """One worker and two in turn, so that both meet the same neighbours."""
    number, rounds = (16, 1) if quick else (60, 5)
    one, two = make_process_engine(1), make_process_engine(2)
    rates = [(_a_second(one, number), _a_second(two, number)) for _ in range(rounds)]
    ratios = [both / alone for alone, both in rates]
    middle = float(np.median(ratios))
    return Row(
        f"{number} flights of the static mission in a campaign, two workers by one",
        f"{middle:.2f} x as fast",
        f"{min(ratios):.2f} to {max(ratios):.2f}; "
        f"{float(np.median([both for _, both in rates])):.1f} flights a second",
        Target(f">= {SCALING:g} x", middle >= SCALING),
        measured=middle,
    )


def _a_second(engine: Engine, number: int) -> float:
    """Flights a second once all workers are under way."""
    rows = engine(tasks(number + WARM_UP))
    if len(list(islice(rows, WARM_UP))) < WARM_UP:
        raise ClearwayError("the engine gave too few rows")
    started = time.perf_counter()
    return sum(1 for _ in rows) / (time.perf_counter() - started)


BENCHMARKS = (
    Benchmark("campaign, per core", per_core("strict"), headline=True, first_page=True),
    Benchmark("campaign, per core, escape off", per_core("off"), headline=True, first_page=True),
    Benchmark("campaign, two workers", second_core, headline=True),
)
