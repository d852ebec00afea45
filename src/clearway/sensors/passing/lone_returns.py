"""Which returns of a sweep stand alone: hardly a beam beside theirs ends at about their range.

Rain, dust and the sun return single beams from anywhere, and so may a wire. Neighbours cannot tell
these apart, a second sweep can.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Bools, Floats, Floats2, Int32s
from clearway.base.compiled import compiled
from clearway.sensors.beams.raster import Directions

ALIKE_BEAMS = 3.0
"""Beam spacings at its range by which a neighbour of a return may differ in range: a surface that
lies 72 degrees aslant to both beams."""

FEWEST_BESIDE = 2
"""Neighbours that make a cluster: two drops are beside each other too often."""


class InBins(NamedTuple):
    """Returns of a sweep by their bins, as chains."""

    first: Int32s
    """[columns * rows] a return of the bin; -1 for none."""
    following: Int32s
    """[n] the next one of the same bin."""
    range_m: Floats
    """[n]"""


@compiled
def mark_lone(points: Floats2, directions: Directions, spacing: float, noise: float) -> Bools:
    """[n] whether fewer than two other returns lie beside a return [n, 3], at its range.

    spacing: angle between beams. noise: by which the ranges of one surface may differ (m).
    """
    lone = np.zeros(len(points), dtype=np.bool_)
    chains = InBins(
        np.full(directions.nearest_m.size, -1, dtype=np.int32),
        np.empty(len(points), dtype=np.int32),
        np.empty(len(points)),
    )
    _chain(points, directions.bin, chains)
    for n in range(len(points)):
        if directions.bin[n] >= 0:
            within = ALIKE_BEAMS * spacing * chains.range_m[n] + noise
            lone[n] = not _is_in_cluster(n, within, directions, chains)
    return lone


@compiled
def _chain(points: Floats2, bins: Int32s, chains: InBins) -> None:
    """Fill in the chains."""
    for n in range(len(bins)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        chains.range_m[n] = np.sqrt(x * x + y * y + z * z)
        if bins[n] >= 0:
            at = np.uint32(bins[n])
            chains.following[n] = chains.first[at]
            chains.first[at] = n


@compiled
def _is_in_cluster(n: int, within: float, directions: Directions, chains: InBins) -> bool:
    """Whether enough other returns in the bin of one, or beside it, lie at its range."""
    columns, rows = directions.nearest_m.shape
    column, row = divmod(int(directions.bin[n]), rows)
    beside = 0
    for c in range(column - 1, column + 2):
        d = c + columns if c < 0 else (c - columns if c >= columns else c)
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            m = int(chains.first[np.uint32(d * rows + r)])
            while m >= 0:
                beside += m != n and abs(chains.range_m[m] - chains.range_m[n]) <= within
                if beside >= FEWEST_BESIDE:
                    return True
                m = int(chains.following[np.uint32(m)])
    return False


@compiled
def mark_near_any(points: Floats2, apart: Floats, positions: Floats2, radii: Floats) -> Bools:
    """[n] whether places [n, 3] lie within a distance [n] of any of some balls."""
    near = np.zeros(len(points), dtype=np.bool_)
    for n in range(len(points)):
        x, y, z, within = points[n, 0], points[n, 1], points[n, 2], apart[n]
        for m in range(len(radii)):
            dx, dy, dz = positions[m, 0] - x, positions[m, 1] - y, positions[m, 2] - z
            if dx * dx + dy * dy + dz * dz <= (within + radii[m]) ** 2:
                near[n] = True
                break
    return near


class OnBeams(NamedTuple):
    """Returns of one sweep, world frame."""

    position_m: Floats2
    """[n, 3]"""
    toward: Floats2
    """[n, 3] direction from the sensor, of length 1."""
    wide_m: Floats
    """[n] what each adds to how far to the side another return of the same thing may lie; far below
    0 where there is none."""


@compiled
def mark_same(now: OnBeams, then: OnBeams, noise: float) -> tuple[Bools, Bools]:
    """[n] of returns and [k] of earlier ones whether there is one among the others that may be of
    the same small thing.

    noise: by which ranges may differ (m): along the beams. To the side, only beam spacings count,
    which near the sensor are much less.
    """
    again = np.zeros(len(now.wide_m), dtype=np.bool_)
    borne_out = np.zeros(len(then.wide_m), dtype=np.bool_)
    for n in range(len(now.wide_m)):
        u, v, w = now.toward[n, 0], now.toward[n, 1], now.toward[n, 2]
        for m in range(len(then.wide_m)):
            x = now.position_m[n, 0] - then.position_m[m, 0]
            y = now.position_m[n, 1] - then.position_m[m, 1]
            z = now.position_m[n, 2] - then.position_m[m, 2]
            wide = now.wide_m[n] + then.wide_m[m]
            along = x * u + y * v + z * w
            squared = x * x + y * y + z * z
            if abs(along) > noise + wide:
                continue
            turned = u * then.toward[m, 0] + v * then.toward[m, 1] + w * then.toward[m, 2]
            aside = wide + noise * np.sqrt(max(1.0 - turned * turned, 0.0))
            if squared - along * along <= aside * aside:
                again[n], borne_out[m] = True, True
    return again, borne_out
