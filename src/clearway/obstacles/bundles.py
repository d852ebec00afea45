"""What of a box tree a bundle of rays from one origin may meet.

A bundle's cone is checked against the spheres around nodes and obstacles. What it surely misses is
left out; all else stays, in the order of the tree.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.obstacles.obstacle import Shapes
from clearway.obstacles.tree import BoxTree, box_lower_bound

ALLOWANCE = 1e-9
"""Of cosines, for rounding: what is left out must be missed beyond doubt."""
SPHERE_ALLOWANCE = 1e-12
"""Likewise of a sphere's squared radius, as a share of the squared distance to its centre."""
RANGE_ALLOWANCE = 0.01
"""Likewise of the range; wider, since entries are found to a share of an obstacle's own size."""


class Spheres(NamedTuple):
    """Spheres as seen from the origin: unit vector to the centre, cosine and sine of the angle
    between that and the rim."""

    nodes: Floats2
    """[nodes, 5] around boxes."""
    members: Floats2
    """[n, 5] around obstacles, in the order of `BoxTree.members`."""


class TreePart(NamedTuple):
    """What is left of a tree; there is room for all of it."""

    nodes: Ints
    """[nodes] ascending."""
    skip: Ints
    """[nodes] index, among these, of what follows when a subtree is left out."""
    first: Ints
    """[nodes + 1] where the obstacles of each begin in `members`."""
    members: Ints
    """[n] indices in `BoxTree.members`."""


@compiled
def room_for(tree: BoxTree) -> TreePart:
    """Room for any part of a tree."""
    nodes = len(tree.skip)
    return TreePart(
        np.empty(nodes, dtype=np.int64),
        np.empty(nodes, dtype=np.int64),
        np.empty(nodes + 1, dtype=np.int64),
        np.empty(len(tree.members), dtype=np.int64),
    )


@compiled
def look(
    origin: Floats,
    max_range: float,
    shapes: Shapes,
    tree: BoxTree,
    spheres: Spheres,
    whole: TreePart,
) -> int:
    """Fill in what lies within range, and its spheres; the number of nodes."""
    x, y, z = origin[0], origin[1], origin[2]
    low, high = tree.low_m, tree.high_m
    farthest = max_range * (1.0 + RANGE_ALLOWANCE)
    count, held = 0, 0
    node = 0
    while node < len(tree.skip):
        if box_lower_bound(x, y, z, tree, node) > farthest:
            node = tree.skip[node]
            continue
        hx = 0.5 * (high[node, 0] - low[node, 0])
        hy = 0.5 * (high[node, 1] - low[node, 1])
        hz = 0.5 * (high[node, 2] - low[node, 2])
        _see(
            low[node, 0] + hx - x,
            low[node, 1] + hy - y,
            low[node, 2] + hz - z,
            math.sqrt(hx * hx + hy * hy + hz * hz),
            spheres.nodes,
            node,
        )
        whole.nodes[count], whole.first[count] = node, held
        for m in range(tree.first[node], tree.first[node + 1]):
            n = tree.members[m]
            center = shapes.center_m[n]
            dx, dy, dz = center[0] - x, center[1] - y, center[2] - z
            _see(dx, dy, dz, shapes.bound_m[n], spheres.members, m)
            whole.members[held] = m
            held += 1
        count += 1
        node += 1
    return _join(whole, count, held, tree)


@compiled
def _see(dx: float, dy: float, dz: float, radius: float, spheres: Floats2, at: int) -> None:
    """Note a sphere by the offset of its centre; one around the origin lies in all directions."""
    squared = dx * dx + dy * dy + dz * dz
    wide = radius * radius * (1.0 + ALLOWANCE) + SPHERE_ALLOWANCE * squared
    if squared > wide:
        distance, share = math.sqrt(squared), wide / squared
        spheres[at, 0], spheres[at, 1], spheres[at, 2] = dx / distance, dy / distance, dz / distance
        spheres[at, 3], spheres[at, 4] = math.sqrt(1.0 - share), math.sqrt(share)
    else:
        spheres[at, 0], spheres[at, 1], spheres[at, 2] = 0.0, 0.0, 0.0
        spheres[at, 3], spheres[at, 4] = -1.0, 0.0


@compiled
def _join(part: TreePart, count: int, held: int, tree: BoxTree) -> int:
    """Fill in where to go on; the number of nodes, 0 if no obstacle is left in them."""
    part.first[count] = held
    for k in range(count - 1, -1, -1):
        end = tree.skip[part.nodes[k]]
        after = k + 1
        while after < count and part.nodes[after] < end:
            after = part.skip[after]
        part.skip[k] = after
    return count if held else 0


@compiled
def cone_around(directions: Floats2, begin: int, end: int, cone: Floats) -> bool:
    """Fill in axis, cosine and sine of a cone around some rays; False if they spread too far."""
    last = end - 1
    ax = directions[begin, 0] + directions[last, 0]
    ay = directions[begin, 1] + directions[last, 1]
    az = directions[begin, 2] + directions[last, 2]
    length = math.sqrt(ax * ax + ay * ay + az * az)
    if not length > ALLOWANCE:
        return False
    ax, ay, az = ax / length, ay / length, az / length
    least = 1.0
    for b in range(begin, end):
        least = min(least, ax * directions[b, 0] + ay * directions[b, 1] + az * directions[b, 2])
    cosine = least - ALLOWANCE
    if not cosine > 0.0:
        return False
    cone[0], cone[1], cone[2] = ax, ay, az
    cone[3], cone[4] = cosine, math.sqrt(1.0 - cosine * cosine)
    return True


@compiled
def narrow_bundle(
    part: TreePart, nodes: int, cone: Floats, tree: BoxTree, spheres: Spheres, left: TreePart
) -> int:
    """Fill in what a cone may meet of a part; the number of nodes, 0 for nothing."""
    count, held = 0, 0
    k = 0
    while k < nodes:
        node = part.nodes[k]
        if _misses(cone, spheres.nodes, node):
            k = part.skip[k]
            continue
        left.nodes[count], left.first[count] = node, held
        for i in range(part.first[k], part.first[k + 1]):
            m = part.members[i]
            if not _misses(cone, spheres.members, m):
                left.members[held] = m
                held += 1
        # Of leaves, those that have something left.
        if held > left.first[count] or tree.skip[node] > node + 1:
            count += 1
        k += 1
    return _join(left, count, held, tree)


@compiled
def _misses(cone: Floats, spheres: Floats2, at: int) -> bool:
    """Whether a cone and a sphere have no direction in common, beyond doubt.

    Then their axes are farther apart than both half angles together. Each of these is acute, so
    cosines tell. Never true of what is not a number.
    """
    apart = cone[0] * spheres[at, 0] + cone[1] * spheres[at, 1] + cone[2] * spheres[at, 2]
    return bool(apart < cone[3] * spheres[at, 3] - cone[4] * spheres[at, 4] - ALLOWANCE)
