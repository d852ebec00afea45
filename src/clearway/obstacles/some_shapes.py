"""Map shapes by coordinate, so that many of them are checked against a place at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.obstacles.obstacle import Shapes
from clearway.obstacles.rounded_box import Turn

AT_ONCE = 128
"""Shapes that are checked against a part at once; once all parts are full, no more are."""


class SomeShapes(NamedTuple):
    """Some of the shapes of a cell by coordinate, and how one part of the cell lies to them."""

    rows: Floats2
    """[16, shapes] centre 3, rotation 9, half lengths 3, radius."""
    local_m: Floats2
    """[3, shapes] where the part is in their axes."""
    beyond_m: Floats
    """[shapes] how far it is beyond their faces, before they are inflated."""
    touched: Ints
    """[shapes] those that may add to it."""


@compiled
def some_shapes() -> SomeShapes:
    """Room for as many as are looked at at once."""
    return SomeShapes(
        np.empty((16, AT_ONCE)),
        np.empty((3, AT_ONCE)),
        np.empty(AT_ONCE),
        np.empty(AT_ONCE, dtype=np.int64),
    )


@compiled
def lay_out_shapes(shapes: Shapes, found: Ints, rows: Floats2) -> None:
    """Fill in some shapes by coordinate."""
    for k in range(len(found)):
        s = found[k]
        for i in range(3):
            rows[i, k], rows[12 + i, k] = shapes.center_m[s, i], shapes.half_m[s, i]
            for j in range(3):
                rows[3 + 3 * i + j, k] = shapes.rotation[s, i, j]
        rows[15, k] = shapes.radius_m[s]


@compiled
def turn_in(rows: Floats2, k: np.uint64) -> Turn:
    """How one of some shapes lies."""
    xx, xy, xz, yx, yy, yz = rows[3], rows[4], rows[5], rows[6], rows[7], rows[8]
    zx, zy, zz = rows[9], rows[10], rows[11]
    return Turn(xx[k], xy[k], xz[k], yx[k], yy[k], yz[k], zx[k], zy[k], zz[k])


@compiled
def distances_off(px: float, py: float, pz: float, rows: Floats2, off: Floats) -> None:
    """Fill in `obstacle.shape_distance` of a place to shapes [n] that are laid out in rows: no
    branch in the loop, so that several go at once."""
    cx, cy, cz, hx, hy, hz = rows[0], rows[1], rows[2], rows[12], rows[13], rows[14]
    xx, xy, xz, yx, yy, yz = rows[3], rows[4], rows[5], rows[6], rows[7], rows[8]
    zx, zy, zz, radius = rows[9], rows[10], rows[11], rows[15]
    for s in range(len(off)):
        x, y, z = px - cx[s], py - cy[s], pz - cz[s]
        qx = abs(xx[s] * x + yx[s] * y + zx[s] * z) - hx[s]
        qy = abs(xy[s] * x + yy[s] * y + zy[s] * z) - hy[s]
        qz = abs(xz[s] * x + yz[s] * y + zz[s] * z) - hz[s]
        ox, oy, oz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
        within = min(max(qx, max(qy, qz)), 0.0)
        off[s] = within + np.sqrt(ox * ox + oy * oy + oz * oz) - radius[s]


@compiled
def touching(px: float, py: float, pz: float, reach: float, many: int, some: SomeShapes) -> int:
    """How many of some shapes may add to a part at a place that reaches so far, and how it lies to
    all of them: no branch asks, and the first loop takes several at once."""
    rows, beyond, touched = some.rows, some.beyond_m, some.touched
    at_x, at_y, at_z = some.local_m[0], some.local_m[1], some.local_m[2]
    cx, cy, cz, hx, hy, hz = rows[0], rows[1], rows[2], rows[12], rows[13], rows[14]
    xx, xy, xz, yx, yy, yz = rows[3], rows[4], rows[5], rows[6], rows[7], rows[8]
    zx, zy, zz, radius = rows[9], rows[10], rows[11], rows[15]
    for k in range(many):
        x, y, z = px - cx[k], py - cy[k], pz - cz[k]
        lx = xx[k] * x + yx[k] * y + zx[k] * z
        ly = xy[k] * x + yy[k] * y + zy[k] * z
        lz = xz[k] * x + yz[k] * y + zz[k] * z
        at_x[k], at_y[k], at_z[k] = lx, ly, lz
        beyond[k] = max(abs(lx) - hx[k], max(abs(ly) - hy[k], abs(lz) - hz[k]))
    count = 0
    for k in range(many):
        touched[count] = k
        count += beyond[k] < radius[k] + reach
    return count
