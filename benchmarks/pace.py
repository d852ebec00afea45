"""How fast the machine itself is beside what is measured: a loop of Python that is always the same.

Hosts are shared, and whoever else runs on one slows it down by half, from one second to the next.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.table import Row

ADDITIONS = 600_000
LOOKS = 5
"""Loops at a time; the slowest of them counts."""
CALM = 1.2
"""Times of the quickest loop seen up to which nobody else is taken to slow the machine down."""
PATIENCE_S = 20.0
"""How long it is waited for that, before each time that something is measured again."""


def loop_s() -> float:
    """How long the loop takes now."""
    began, total = time.perf_counter(), 0
    for number in range(ADDITIONS):
        total += number
    return time.perf_counter() - began


class Pace:
    """What the loop took up to now."""

    def __init__(self) -> None:
        self._seen_s: list[float] = []
        self._beside_s: list[float] = []
        self.look()

    def look(self) -> float:
        """How many times as long as the quickest loop of all the slowest of a few takes now."""
        looks = [loop_s() for _ in range(LOOKS)]
        self._seen_s += looks
        return max(looks) / min(self._seen_s)

    def calmest(self, measure: Callable[[], Row], times: int) -> Row:
        """Measure until the loop is as quick before and after it as when nobody else is there, so
        many times at most: the row beside which it was the quickest, whatever that row says."""
        found: tuple[float, Row] | None = None
        for _ in range(times):
            before = self._calm() if times > 1 else self.look()
            row = measure()
            slower = max(before, self.look())
            if found is None or slower < found[0]:
                found = slower, row
            if found[0] <= CALM:
                break
        assert found is not None
        self._beside_s.append(found[0])
        return replace(found[1], pace=found[0])

    def _calm(self) -> float:
        """Wait until nobody else is there, or for long enough."""
        until = time.monotonic() + PATIENCE_S
        while (slower := self.look()) > CALM and time.monotonic() < until:
            time.sleep(0.5)
        return slower

    def __str__(self) -> str:
        told = (
            f"{ADDITIONS:,} additions in Python took {1e3 * min(self._seen_s):.0f} ms at the "
            "quickest"
        )
        if not self._beside_s:
            return told
        beside = np.array(self._beside_s)
        return (
            f"{told}, {np.median(beside):.2f} times that beside these rows ({beside.min():.2f} to "
            f"{beside.max():.2f})"
        )
