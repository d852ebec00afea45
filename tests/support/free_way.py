"""Whether a ball can be moved from place to place past everything: a search of the tests' own.

The places of its centre are a grid; neighbours are those that touch at faces, edges or corners. So
a way counts that comes at most half a step nearer than the ball's radius between two places.
"""

from __future__ import annotations

import heapq
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy import ndimage

from solids import Array, Solids

STEP_M = 0.5
BALL_M = 4.5
ASIDE_M = 12.0
"""About start, goal and all that stands, that far ways are looked for."""

WIDEST_M = 150.0


class FreeWay(NamedTuple):
    """What was found."""

    exists: bool
    length_m: float | None
    """Of the shortest way over the grid's places, up to 13 % longer than the shortest of all; None
    if it was not asked for, or there is none."""


class _Places(NamedTuple):
    axes: tuple[Array, Array, Array]
    free: npt.NDArray[np.bool_]


def free_way(
    solids: Solids,
    start_m: npt.ArrayLike,
    goal_m: npt.ArrayLike,
    ball_m: float = BALL_M,
    within_m: float = 1.5,
    *,
    measured: bool = False,
) -> FreeWay:
    """Whether a ball can go from start [3] to within some distance of the goal [3].

    Looked for 12 m about start, goal and what stands, but no higher than 12 m above the two, nor
    lower than as much below them: walls that are taller count as too tall.
    """
    ends = np.array([start_m, goal_m], dtype=float)
    low, high = _box(solids, ends)
    places = _places(solids, low, high, ends[0], ball_m)
    label, _ = ndimage.label(places.free, structure=np.ones((3, 3, 3)))
    begun = set(np.unique(label[_near(places, ends[0], 0.5 * STEP_M)])) - {0}
    ended = set(np.unique(label[_near(places, ends[1], within_m)])) - {0}
    exists = not begun.isdisjoint(ended)
    return FreeWay(exists, _length(places, ends, within_m) if exists and measured else None)


def _box(solids: Solids, ends: Array) -> tuple[Array, Array]:
    """Least and greatest corner of what is searched; what is as wide as a ground does not count."""
    least, greatest = solids.boxes_m()
    counts = (greatest - least)[:, :2].max(axis=1, initial=0.0) < WIDEST_M
    low, high = ends.min(axis=0), ends.max(axis=0)
    low[:2] = np.minimum(low[:2], least[counts, :2].min(axis=0, initial=np.inf))
    high[:2] = np.maximum(high[:2], greatest[counts, :2].max(axis=0, initial=-np.inf))
    return low - ASIDE_M, high + ASIDE_M


def _places(solids: Solids, low: Array, high: Array, through: Array, ball_m: float) -> _Places:
    """A grid through a point, and where on it the ball touches nothing."""
    axes = [
        at + STEP_M * np.arange(np.ceil((a - at) / STEP_M), np.floor((b - at) / STEP_M) + 1)
        for a, b, at in zip(low, high, through, strict=True)
    ]
    free = np.ones(tuple(len(axis) for axis in axes), dtype=bool)
    least, greatest = solids.boxes_m()
    for index in range(len(solids.radii_m)):
        spans = [
            slice(*np.searchsorted(axis, [a - ball_m, b + ball_m]))
            for axis, a, b in zip(axes, least[index], greatest[index], strict=True)
        ]
        parts = np.meshgrid(
            *(axis[span] for axis, span in zip(axes, spans, strict=True)), indexing="ij"
        )
        points = np.stack([part.ravel() for part in parts], axis=1)
        if len(points):
            clear = solids.one_m(index, points) >= ball_m
            free[tuple(spans)] &= clear.reshape(parts[0].shape)
    return _Places((axes[0], axes[1], axes[2]), free)


def _near(places: _Places, point: Array, within_m: float) -> tuple[npt.NDArray[np.intp], ...]:
    """Indices of places within a distance of a point."""
    x, y, z = places.axes
    away = (
        (x[:, None, None] - point[0]) ** 2
        + (y[None, :, None] - point[1]) ** 2
        + (z[None, None, :] - point[2]) ** 2
    )
    return np.nonzero(away <= within_m**2)


def _length(places: _Places, ends: Array, within_m: float) -> float | None:
    """Length of the shortest way over neighbouring places."""
    begin = np.array(
        [int(np.argmin(np.abs(axis - at))) for axis, at in zip(places.axes, ends[0], strict=True)]
    )
    goal = np.array(
        [(at - axis[0]) / STEP_M for axis, at in zip(places.axes, ends[1], strict=True)]
    )
    steps = _search(places.free, begin, goal, within_m / STEP_M)
    return float(steps) * STEP_M if np.isfinite(steps) else None


@njit(cache=True)
def _search(free, begin, goal, within):  # type: ignore[no-untyped-def]
    """Steps from a place [3] to within some steps of another [3]: A*; inf if there is no way."""
    ny, nz = free.shape[1], free.shape[2]
    best = np.full(free.size, np.inf, dtype=np.float32)
    closed = np.zeros(free.size, dtype=np.bool_)
    first = (begin[0] * ny + begin[1]) * nz + begin[2]
    best[first] = 0.0
    heap = [(0.0, first)]
    while len(heap):
        _, here = heapq.heappop(heap)
        if closed[here]:
            continue
        closed[here] = True
        x, y, z = here // (ny * nz), here // nz % ny, here % nz
        if (x - goal[0]) ** 2 + (y - goal[1]) ** 2 + (z - goal[2]) ** 2 <= within**2:
            return best[here]
        for a in range(max(x - 1, 0), min(x + 2, free.shape[0])):
            for b in range(max(y - 1, 0), min(y + 2, ny)):
                for c in range(max(z - 1, 0), min(z + 2, nz)):
                    there = (a * ny + b) * nz + c
                    if closed[there] or not free[a, b, c]:
                        continue
                    new = best[here] + np.sqrt((a - x) ** 2 + (b - y) ** 2 + (c - z) ** 2)
                    if new < best[there]:
                        best[there] = new
                        left = np.sqrt((a - goal[0]) ** 2 + (b - goal[1]) ** 2 + (c - goal[2]) ** 2)
                        heapq.heappush(heap, (new + max(left - within, 0.0), there))
    return np.inf
