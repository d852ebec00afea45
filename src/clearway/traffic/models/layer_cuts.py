"""Where half-lines cross the borders between layers: spheres around the origin.

Lengths run from the point closest to the origin.
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.traffic.models.borders import CUT_LAYER, LAYER_CUT, RANGE, Borders, TraversalPieces
from clearway.traffic.models.half_lines import NEAR2, HalfLines


@compiled
def cut_by_spheres(lines: HalfLines, many: int, borders: Borders) -> None:
    """Fill in half the chords of the first so many in each sphere."""
    for i in range(borders.layers):
        _cut_by_sphere(
            lines.told, borders.table[RANGE, i], borders.tolerance_m, many, lines.spheres[i]
        )


@compiled
def _cut_by_sphere(told: Floats2, radius: float, tolerance: float, many: int, cuts: Floats) -> None:
    for n in range(many):
        depth2 = radius * radius - told[NEAR2, n]
        cuts[n] = np.sqrt(depth2) if depth2 > 2.0 * radius * tolerance else np.inf


@compiled
def layer_cuts(
    spheres: Floats2, n: int, start: float, end: float, borders: Borders, out: TraversalPieces
) -> int:
    """List the cuts of one line in order: inwards to the innermost sphere that is truly entered,
    then outwards."""
    last = borders.layers
    times, places = out.times, out.places
    # No branch asks which are crossed on the way: what is not to be listed is written over.
    at, first = np.uint64(1), last - 1
    i = last - 1
    while i >= 0 and spheres[np.uint64(i), n] < np.inf:
        cut = -spheres[np.uint64(i), n]
        first = i - 1 if cut <= start else first
        times[LAYER_CUT, at], places[CUT_LAYER, at] = cut, i - 1
        at += np.uint64((cut > start) & (cut < end))
        i -= 1
    for j in range(i + 1, last):
        cut = spheres[np.uint64(j), n]
        first = j if cut <= start else first
        times[LAYER_CUT, at], places[CUT_LAYER, at] = cut, j
        at += np.uint64((cut > start) & (cut < end))
    times[LAYER_CUT, 0], places[CUT_LAYER, 0] = start, first
    return int(np.int64(at))
