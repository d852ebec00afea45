"""Where rays from one origin first meet an obstacle of a box tree.

Most beams of a scan meet nothing, and neighbours meet the same. So rays go in bundles: what a
bundle surely misses is left out, and each ray meets the rest as if nothing had been. The outcome
is that of the whole tree, to the last bit.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.obstacles.bundles import (
    ALLOWANCE,
    Spheres,
    TreePart,
    cone_around,
    look,
    narrow_bundle,
    room_for,
)
from clearway.obstacles.obstacle import Shapes
from clearway.obstacles.rounded_box import ray_rounded_box
from clearway.obstacles.tree import BoxTree

MANY = 200
FEW = 10
"""Rays of a bundle, and of the bundles within it."""


@compiled
def cast_rays(
    origin: Floats, directions: Floats2, max_range: float, shapes: Shapes, tree: BoxTree
) -> Floats:
    """Distance [n] from an origin along unit directions [n, 3] to an obstacle; infinite: none.

    Quickest where neighbours in the list are neighbours in direction.
    """
    ranges = np.full(len(directions), np.inf)
    spheres = Spheres(np.empty((len(tree.skip), 5)), np.empty((len(tree.members), 5)))
    whole, many, few = room_for(tree), room_for(tree), room_for(tree)
    cone = np.empty(5)
    _cast_all(origin, directions, max_range, shapes, tree, spheres, whole, many, few, cone, ranges)
    return ranges


@compiled
def _cast_all(
    origin: Floats,
    directions: Floats2,
    max_range: float,
    shapes: Shapes,
    tree: BoxTree,
    spheres: Spheres,
    whole: TreePart,
    many: TreePart,
    few: TreePart,
    cone: Floats,
    ranges: Floats,
) -> None:
    """Fill in the ranges, bundle by bundle. many, few, cone: room for what is left."""
    in_range = look(origin, max_range, shapes, tree, spheres, whole)
    for begin in range(0, len(directions) if in_range else 0, MANY):
        end = min(begin + MANY, len(directions))
        outer, held = whole, in_range
        if cone_around(directions, begin, end, cone):
            outer, held = many, narrow_bundle(whole, in_range, cone, tree, spheres, many)
        for first in range(begin, end if held else begin, FEW):
            last = min(first + FEW, end)
            inner, count = outer, held
            if cone_around(directions, first, last, cone):
                inner, count = few, narrow_bundle(outer, held, cone, tree, spheres, few)
            if count:
                _meet(
                    origin,
                    directions,
                    first,
                    last,
                    max_range,
                    shapes,
                    tree,
                    spheres.members,
                    inner,
                    count,
                    ranges,
                )


@compiled
def _meet(
    origin: Floats,
    directions: Floats2,
    begin: int,
    end: int,
    max_range: float,
    shapes: Shapes,
    tree: BoxTree,
    around: Floats2,
    part: TreePart,
    nodes: int,
    ranges: Floats,
) -> None:
    """Fill in the ranges of some rays, which meet nothing but what is in the part.

    around: the spheres of its obstacles.
    """
    x, y, z = origin[0], origin[1], origin[2]
    for b in range(begin, end):
        ux, uy, uz = directions[b, 0], directions[b, 1], directions[b, 2]
        best = max_range
        k = 0
        while k < nodes:
            if _box_entry(x, y, z, ux, uy, uz, tree, part.nodes[k]) > best:
                k = part.skip[k]
                continue
            for i in range(part.first[k], part.first[k + 1]):
                m = part.members[i]
                ahead = ux * around[m, 0] + uy * around[m, 1] + uz * around[m, 2]
                if ahead < around[m, 3] - ALLOWANCE:
                    continue
                n = tree.members[m]
                entry = ray_rounded_box(
                    x,
                    y,
                    z,
                    ux,
                    uy,
                    uz,
                    shapes.center_m[n],
                    shapes.rotation[n],
                    shapes.half_m[n],
                    shapes.radius_m[n],
                )
                if entry <= best:
                    best = entry
                    ranges[b] = entry
            k += 1


@compiled
def _box_entry(
    x: float, y: float, z: float, ux: float, uy: float, uz: float, tree: BoxTree, node: int
) -> float:
    """Where a ray enters a node's box; 0 inside, infinite if it misses."""
    enter, leave = 0.0, math.inf
    for axis in range(3):
        at = x if axis == 0 else (y if axis == 1 else z)
        u = ux if axis == 0 else (uy if axis == 1 else uz)
        below = tree.low_m[node, axis] - at
        above = tree.high_m[node, axis] - at
        if u == 0.0:
            if below > 0.0 or above < 0.0:
                return math.inf
            continue
        enter = max(enter, min(below / u, above / u))
        leave = min(leave, max(below / u, above / u))
    return enter if enter <= leave else math.inf
