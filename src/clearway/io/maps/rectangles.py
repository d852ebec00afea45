"""Polygons as unions of rectangles that cover them: footprints for cuboids.

A polygon is cut along a side of its smallest rectangle, wherever the rectangles of the pieces
become smallest, the wasteful piece first, until little more than the polygon is covered.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

from clearway.base.arrays import Floats2
from clearway.base.compiled import compiled
from clearway.base.errors import MissingExtraError
from clearway.base.frames import FloatArray

EXCESS = 0.15
"""Cutting ends when the rectangles cover this share more than the polygon."""
MOST_RECTANGLES = 24
MOST_CUTS = 8
"""Cuts tried along each side of a piece."""
SNAP_M = 1e-6
LEAST_M = 1e-3
"""A splinter is at least as wide: no width would be no shape."""
FINEST_M = 2.0
"""Pieces narrower than this are not cut again across that side."""


@dataclass(frozen=True, slots=True, eq=False)
class Rectangle:
    """A rectangle in the plane."""

    center_m: FloatArray
    """[2]"""
    size_m: tuple[float, float]
    """Along its own x, then y."""
    yaw_rad: float
    """From the plane's x to its own, left positive."""


@dataclass(frozen=True, slots=True, eq=False)
class Cover:
    """Rectangles that together cover a polygon."""

    rectangles: tuple[Rectangle, ...]
    polygon_m2: float
    covered_m2: float
    """Area of the union of the rectangles."""


def shapely_or_refuse(purpose: str) -> ModuleType:
    """The shapely package; MissingExtraError naming the extra that brings it."""
    try:
        return import_module("shapely")
    except ImportError as cause:
        raise MissingExtraError(purpose, "map") from cause


def cover_polygon(rings_m: Sequence[FloatArray]) -> Cover:
    """Rectangles over a polygon, given by rings [n, 2]: the outer one, then holes.

    A ring that crosses itself counts as the areas that it encloses. No area gives no rectangle.
    """
    shapely = shapely_or_refuse("covering outlines with boxes")
    shape = shapely.Polygon(rings_m[0], rings_m[1:])
    if not shape.is_valid:
        shape = shapely.make_valid(shape)
    pieces = _cut(shapely, _parts(shapely, shape), EXCESS * shape.area)
    rectangles = tuple(_rectangle(shapely, piece) for piece in pieces)
    covered = union_of(shapely, [shapely.Polygon(_smallest(shapely, piece)) for piece in pieces])
    return Cover(rectangles, float(shape.area), float(covered.area))


def union_of(shapely: ModuleType, shapes: Sequence[Any]) -> Any:
    """The union of shapes in metres, snapped to micrometres.

    Without snapping, GEOS 3.14 loses whole pieces where edges of many shapes nearly coincide.
    """
    return shapely.union_all(shapes, grid_size=SNAP_M)


def polygons_in(shapely: ModuleType, shape: Any) -> list[Any]:
    """The polygons of a geometry, however it nests them; points and lines are left to the side."""
    parts = shapely.get_parts(shapely.get_parts(shape))
    return [part for part in parts if part.geom_type == "Polygon"]


def _parts(shapely: ModuleType, shape: Any) -> list[Any]:
    """The pieces of a geometry that have an area."""
    return [part for part in polygons_in(shapely, shape) if _waste(shapely, part)[1] > 0]


def _waste(shapely: ModuleType, piece: Any) -> tuple[float, float]:
    """Area of the smallest rectangle beyond the piece, and of the rectangle."""
    (x0, y0), (x1, y1), (x2, y2), _ = _smallest(shapely, piece).tolist()
    around = math.hypot(x1 - x0, y1 - y0) * math.hypot(x2 - x1, y2 - y1)
    return around - float(piece.area), around


def _cut(shapely: ModuleType, pieces: list[Any], allowed_m2: float) -> list[Any]:
    """Pieces whose rectangles waste little, or cannot be cut to advantage."""
    # The counter decides between pieces that waste the same: geometries have no order.
    heap = [(-_waste(shapely, piece)[0], n, piece) for n, piece in enumerate(pieces)]
    heapq.heapify(heap)
    number = len(heap)
    done: list[Any] = []
    while heap and -sum(entry[0] for entry in heap) > allowed_m2:
        if len(heap) + len(done) >= MOST_RECTANGLES:
            break
        waste, _, piece = heapq.heappop(heap)
        halves = _best_halves(shapely, piece, -waste)
        if halves is None:
            done.append(piece)
            continue
        for half in halves:
            heapq.heappush(heap, (-_waste(shapely, half)[0], number, half))
            number += 1
    return done + [entry[2] for entry in heap]


def _best_halves(shapely: ModuleType, piece: Any, waste_m2: float) -> list[Any] | None:
    """The pieces of the best straight cut, or None if every cut would cost.

    A cut that saves nothing may be the first of two that do, as at the corner of a courtyard.
    """
    frame = _rectangle(shapely, piece)
    local = shapely.transform(piece, lambda xy: _turn_left(xy - frame.center_m, -frame.yaw_rad))
    corners = shapely.get_coordinates(local)
    best, best_waste = None, waste_m2 * (1.0 + 1e-9)
    for axis in (0, 1):
        for at in _cuts(corners[:, axis]):
            halves = _halves(shapely, local, corners, axis, at)
            left = sum(_waste(shapely, half)[0] for half in halves)
            if left < best_waste:
                best, best_waste = halves, left
    if best is None:
        return None

    def back(xy: FloatArray) -> FloatArray:
        return _turn_left(xy, frame.yaw_rad) + frame.center_m

    return [shapely.transform(half, back) for half in best]


def _cuts(values: FloatArray) -> FloatArray:
    """Places to cut: the corners of the piece, and its middle."""
    low, high = float(values.min()), float(values.max())
    if high - low < 2.0 * FINEST_M:
        return np.zeros(0)
    inside = np.unique(np.round(np.append(values, 0.5 * (low + high)), 3))
    inside = inside[(inside > low + 0.5 * FINEST_M) & (inside < high - 0.5 * FINEST_M)]
    if len(inside) > MOST_CUTS:
        inside = inside[np.linspace(0, len(inside) - 1, MOST_CUTS).astype(np.int64)]
    return inside


def _halves(
    shapely: ModuleType, piece: Any, corners: FloatArray, axis: int, at: float
) -> list[Any]:
    low, high = corners.min(axis=0) - 1.0, corners.max(axis=0) + 1.0
    low_of_second, high_of_first = low.copy(), high.copy()
    low_of_second[axis] = high_of_first[axis] = at
    boxes = [shapely.box(*low, *high_of_first), shapely.box(*low_of_second, *high)]
    return [
        part
        for half in shapely.intersection(piece, boxes)
        for part in _parts(shapely, half)
        if part.area > 1e-9 * piece.area
    ]


def _smallest(shapely: ModuleType, piece: Any) -> FloatArray:
    """Corners [4, 2] of the smallest rectangle around a piece: along a side of its convex hull.

    `oriented_envelope` of GEOS 3.14 gives a rectangle without area for some pieces that have one.
    """
    return _around(shapely.get_coordinates(shapely.convex_hull(piece)))


@compiled
def _around(hull: Floats2) -> Floats2:
    """Corners [4, 2] of the smallest rectangle along a side of a convex ring [n, 2]."""
    corners, least = np.zeros((4, 2)), np.inf
    for side in range(len(hull) - 1):
        x, y = hull[side + 1, 0] - hull[side, 0], hull[side + 1, 1] - hull[side, 1]
        length = np.hypot(x, y)
        if length == 0.0:
            continue
        x, y = x / length, y / length
        low_u, high_u, low_v, high_v = np.inf, -np.inf, np.inf, -np.inf
        for n in range(len(hull)):
            u, v = hull[n, 0] * x + hull[n, 1] * y, hull[n, 1] * x - hull[n, 0] * y
            low_u, high_u = min(low_u, u), max(high_u, u)
            low_v, high_v = min(low_v, v), max(high_v, v)
        area = (high_u - low_u) * (high_v - low_v)
        if area < least:
            least = area
            for n, u in enumerate((low_u, high_u, high_u, low_u)):
                v = low_v if n < 2 else high_v
                corners[n, 0], corners[n, 1] = u * x - v * y, u * y + v * x
    return corners


def _rectangle(shapely: ModuleType, piece: Any) -> Rectangle:
    """The smallest rectangle around a piece."""
    corners = _smallest(shapely, piece)
    along, across = corners[1] - corners[0], corners[2] - corners[1]
    return Rectangle(
        center_m=0.5 * (corners[0] + corners[2]),
        size_m=(max(float(np.hypot(*along)), LEAST_M), max(float(np.hypot(*across)), LEAST_M)),
        yaw_rad=float(np.arctan2(along[1], along[0])),
    )


def _turn_left(points: FloatArray, angle_rad: float) -> FloatArray:
    """Points [n, 2] turned to the left."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    turned: FloatArray = points @ np.array([[cosine, sine], [-sine, cosine]])
    return turned
