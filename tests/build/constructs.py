"""Loops with every construct of the subset that is translated (docs/core.md)."""

from __future__ import annotations

import heapq
import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Bools, Floats, Floats2, Ints, StridedFloats
from clearway.base.compiled import compiled

SCALE, SHIFT = 2.5, 3
WEIGHTS = np.array([0.25, 0.5, 0.25])
STEPS = (1, 2, 4)


class Pair(NamedTuple):
    values: Floats
    count: int


@compiled
def arithmetic(x: float, y: float) -> tuple[float, float, float, float, float, float]:
    return (x + SCALE * y, x / y, x // y, x % y, -(x**2), abs(x) - y * y)


@compiled
def functions(x: float, y: float) -> tuple[float, float, float, float, bool, int]:
    length = math.sqrt(x * x + y * y)
    angle = math.atan2(y, x) + math.cos(x) * math.sin(y)
    signed = math.copysign(np.floor(x) + np.ceil(y), y)
    return length, angle, signed, max(x, y, 0.0) - min(x, y), bool(np.isnan(x)), int(x)


@compiled
def comparisons(x: float, y: float) -> tuple[bool, bool, bool, float]:
    between = -1.0 < x <= 1.0
    either = x > y or (y > 0.0 and not between)
    return between, either, (x > 0.0) & (y > 0.0), x if either else y


@compiled
def whole_numbers(a: int, b: int) -> tuple[int, int, int, int, float, int]:
    quotient, rest = divmod(a, b)
    packed = ((a & 255) << SHIFT) | 1
    return quotient, rest, packed ^ 7, ~a >> 1, a / b, int(a in (1, 2, b))


@compiled
def branches(a: int, b: int) -> tuple[int, float]:
    if a > 0:
        sign, size = 1, float(a)
    elif a < 0:
        sign, size = -1, -float(a)
    else:
        return 0, 0.0
    for step in STEPS:
        if step > b:
            break
        size += step
    return sign, size


@compiled
def counting(a: int, b: int) -> tuple[int, int, int]:
    total, last, left = 0, 0, abs(a)
    for k in range(abs(b), 0, -3):
        if k % 2 == 0:
            continue
        total += k
        last = k
    while left > 10:
        left //= 2
    queue = [(abs(a), 0), (abs(b), 1)]
    heapq.heappush(queue, (5, 2))
    _, first = heapq.heappop(queue)
    return total, last + left, first


@compiled
def in_place(values: Floats) -> None:
    for k in range(len(values)):
        if values[k] < 0.0:
            values[k] = -values[k]
    values[0] += 1.0
    values += SCALE
    values[-1] *= 0.5


@compiled
def slices(values: Floats) -> tuple[Floats, Floats, float]:
    half = len(values) // 2
    first, rest = values[:half].copy(), values[half:].copy()
    first[:] = 1.0
    return first, rest, values[-1]


@compiled
def reductions(values: Floats) -> tuple[float, float, float, int, bool]:
    whole = np.floor(values)  # NumPy adds pairs of pairs, the core one by one.
    return (
        np.sum(whole * 2.0),
        values.max() - values.min(),
        np.mean(whole),
        np.count_nonzero(values > 0.0),
        bool(np.any(values < 0.0)),
    )


@compiled
def made(values: Floats) -> tuple[Floats, Ints, Floats]:
    count = len(values)
    smooth = np.zeros(count)
    for k, value in enumerate(values):
        smooth[k] = WEIGHTS[k % 3] * value
    order = np.argsort(values, kind="mergesort")
    corner = np.array([values[0], 0.0, float(count)])
    return np.sort(smooth), order + np.arange(count), np.full(2, corner[2])


@compiled
def records(values: Floats) -> Pair:
    pair = Pair(values + 1.0, len(values))
    return Pair(_doubled(pair), count=pair.count + pair[1])


@compiled
def _doubled(pair: Pair) -> Floats:
    return 2.0 * pair.values


@compiled
def masks(values: Floats) -> tuple[Floats, Bools, Floats]:
    keep = values > 0.0
    where = np.flatnonzero(keep)
    return values[keep], ~keep, values[where]


@compiled
def table(values: Floats2) -> tuple[Floats2, Floats, int]:
    rows, columns = values.shape
    result = np.empty((rows, columns))
    for i in range(rows):
        for j in range(columns):
            result[i, j] = values[i, j] * (i + 1)
    result[0] = 0.0
    return result, np.sum(values, axis=1), values.size


@compiled
def columns(values: Floats2) -> tuple[float, Floats]:
    first = values[:, 0]
    return _total(first), values[-1].copy()


@compiled
def _total(values: StridedFloats) -> float:
    total = 0.0
    for value in values:
        total += value
    return total


@compiled
def handed_on(values: Floats) -> tuple[Floats, Floats]:
    return values, values[2:]


@compiled
def picked_at(values: Floats, index: int) -> float:
    return values[index]


@compiled
def generic(values: Floats) -> tuple[Floats, Ints]:
    numbers = np.arange(len(values))
    first, second = _longer(values), _longer(numbers)
    return first + 1.0, second


@compiled
def _longer(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Of any type: such a loop is called by loops alone."""
    longer = np.zeros(2 * len(values), dtype=values.dtype)
    longer[: len(values)] = values
    return longer


@compiled
def of_size(count: int) -> int:
    return len(np.empty(count))
