"""What was seen to be free, as compiled loops ask: one door, whatever has seen it.

A ball is free if it lies in what is declared free, if all voxels that it meets are known to be free
from end to end, or if one range view shows all of it. Views are asked last, and only where a voxel
notes that a beam went by: thousands of places are looked up at a decision, most without success.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Bools, Floats, Floats2, UInt64s3
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.sensors.observed.free_voxels import (
    HALF_DIAGONAL,
    NO_BOX,
    NO_VOXELS,
    WORD,
    are_voxels_free,
    is_declared,
    is_marked,
    is_voxel_marked,
)
from clearway.sensors.observed.range_views import NO_VIEWS, NONE, RangeViews, first_showing


class SeenSpace(NamedTuple):
    """What was seen to be free."""

    free: UInt64s3
    """[columns, columns, rows / WORD] a bit each, 1 where all beams about the middle of a voxel
    went on: an index of what views may show, no answer. A voxel of the world lies at its number
    modulo columns and rows, which are powers of two."""
    window: Floats
    """[15] number of the lowest voxel of the window along each axis, voxels per metre, middle and
    radius of a ball of the world that the mission declares free, lowest and highest corner of the
    box in which a map is declared complete, and the radius of balls from which on the index is
    asked before views: narrower ones may be free where a voxel's middle is not."""
    views: RangeViews
    whole: UInt64s3
    """[columns, columns, rows / WORD] as `free`, 1 where all of a voxel is known to be free: by
    sensors of one's own, and above and below a level plane; [1, 1, 1] where nothing is."""

    def __repr__(self) -> str:
        return brief(self)

    @property
    def voxel_m(self) -> float:
        return 1.0 / float(self.window[3])

    @property
    def start(self) -> tuple[FloatArray, float]:
        """Middle [3] and radius of the ball that counts as declared free."""
        return self.window[4:7], float(self.window[7])

    @property
    def complete_m(self) -> FloatArray:
        """[2, 3] corners of the box in which a map is declared complete; without one, infinite
        ones the wrong way round."""
        return self.window[8:14].reshape(2, 3)

    @property
    def low(self) -> IntArray:
        """[3] number of the lowest voxel along each axis."""
        return self.window[:3].astype(np.int64)


NOTHING_SEEN = SeenSpace(
    np.zeros((1, 1, 1), dtype=np.uint64),
    np.concatenate([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0], NO_BOX.ravel(), [0.0]]),
    NO_VIEWS,
    NO_VOXELS,
)
"""Where no range sensor looks."""


@compiled
def is_free(seen: SeenSpace, x: float, y: float, z: float, radius: float) -> bool:
    """Whether a ball in the world was seen to be free."""
    if is_declared(seen.window, x, y, z, radius):
        return True
    if len(seen.whole) > 1 and are_voxels_free(seen.whole, seen.window, x, y, z, radius):
        return True
    if len(seen.views.asked) == 0:
        return False
    if radius >= seen.window[14] and not is_place_free(seen, x, y, z):
        return False
    return first_showing(seen.views, seen.window, x, y, z, radius) != NONE


@compiled
def is_place_free(seen: SeenSpace, x: float, y: float, z: float) -> bool:
    """Whether a ball about a place may be free, by the index: quick to tell that none is."""
    free, window = seen.free, seen.window
    per_m, columns, rows = window[3], free.shape[0], WORD * free.shape[2]
    a = int(np.floor(x * per_m))
    b = int(np.floor(y * per_m))
    c = int(np.floor(z * per_m))
    if (
        window[0] <= a < window[0] + columns
        and window[1] <= b < window[1] + columns
        and window[2] <= c < window[2] + rows
        and is_marked(free, a, b, c)
    ):
        return True
    return is_declared(window, x, y, z, 0.0)


@compiled
def is_voxel_free(seen: SeenSpace, a: int, b: int, c: int) -> bool:
    """Whether all of a voxel was seen to be free."""
    if len(seen.whole) > 1 and is_voxel_marked(seen.whole, seen.window, a, b, c):
        return True
    width = 1.0 / seen.window[3]
    x, y, z = (a + 0.5) * width, (b + 0.5) * width, (c + 0.5) * width
    return is_free(seen, x, y, z, HALF_DIAGONAL * width)


@compiled
def mark_unlooked(seen: SeenSpace, places: Floats2, radii: Floats, must_see: bool) -> Bools:
    """[n] whether balls of the world, [n, 3] and [n], count as free though no view shows them: by
    declaration, or as all does where nothing must be seen."""
    unlooked = np.zeros(len(radii), dtype=np.bool_)
    for n in range(len(radii)):
        x, y, z = places[n, 0], places[n, 1], places[n, 2]
        if must_see and not is_declared(seen.window, x, y, z, 0.0):
            continue
        unlooked[n] = first_showing(seen.views, seen.window, x, y, z, radii[n]) == NONE
    return unlooked
