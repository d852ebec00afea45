"""Times of repeated calls: warm, collected garbage included, median and 99th percentile of what the
clock says, and what of it the processor took."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.table import Row, Target

WARM_UP = 3
LEAST = 5


@dataclass(frozen=True, slots=True)
class Times:
    """Wall times [n] of calls, in seconds."""

    each_s: npt.NDArray[np.float64]
    cpu_s: float | None = None
    """What the processor took for a call, this thread's and that of processes it waited for."""

    @property
    def median_s(self) -> float:
        return float(np.median(self.each_s))

    @property
    def p99_s(self) -> float:
        return float(np.percentile(self.each_s, 99))

    @property
    def spread(self) -> str:
        """99th percentile where there are calls enough for one, else the slowest."""
        if len(self.each_s) >= 100:
            return in_words(self.p99_s)
        return f"{in_words(float(self.each_s.max()))} at most"

    def row(
        self,
        what: str,
        *,
        target_s: float | None = None,
        target_p99_s: float | None = None,
        reference: tuple[Times, str] | None = None,
    ) -> Row:
        """A row of the table; `reference` is another way to the same result, and its name."""
        against = ""
        if reference is not None:
            other, name = reference
            ratio = other.median_s / self.median_s
            against = f"{ratio:.0f}" if ratio >= 10.0 else f"{ratio:.1f}"
            against += f" x as fast as {name}"
        target = None
        if target_s is not None:
            limits = [(self.median_s, target_s, "")]
            if target_p99_s is not None:
                limits.append((self.p99_s, target_p99_s, "p99 "))
            text = ", ".join(f"{which}<= {in_words(limit)}" for _, limit, which in limits)
            target = Target(text, all(found <= limit for found, limit, _ in limits))
        return Row(
            what,
            in_words(self.median_s),
            self.spread,
            target,
            against,
            self.median_s,
            "" if self.cpu_s is None else in_words(self.cpu_s),
        )


def timed(
    function: Callable[[], object], quick: bool, seconds: float = 1.5, warm_up: int = WARM_UP
) -> Times:
    """Call for a while and take the times; the first calls, which load, do not count."""
    for _ in range(warm_up):
        function()
    seconds = 0.2 * seconds if quick else seconds
    each: list[float] = []
    until, before_s = time.perf_counter() + seconds, processor_s()
    while len(each) < LEAST or time.perf_counter() < until:
        began = time.perf_counter()
        function()
        each.append(time.perf_counter() - began)
    return Times(np.array(each), (processor_s() - before_s) / len(each))


def processor_s() -> float:
    """What the processor took for this thread, and for processes that ended."""
    ended = os.times()
    return time.thread_time() + ended.children_user + ended.children_system


def in_words(seconds: float) -> str:
    """A time with the unit that suits it, three digits."""
    for unit, factor in (("s", 1.0), ("ms", 1e3)):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e6:.3g} us"
