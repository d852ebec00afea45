"""Bounding boxes of many obstacles as a tree, for queries that touch few of them.

Nodes lie in depth-first order, so a walk goes on to the next node, or jumps over a subtree whose
box it may leave out; no stack is needed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.base.state import IntArray
from clearway.obstacles.obstacle import Shapes, shape_distance
from clearway.obstacles.rounded_box import distance_beyond

LEAF_SIZE = 4


class BoxTree(NamedTuple):
    """Axis-parallel boxes around groups of obstacles, as compiled loops take them."""

    low_m: Floats2
    """[nodes, 3] lower corner, frame of the obstacles."""
    high_m: Floats2
    """[nodes, 3] upper corner."""
    skip: Ints
    """[nodes] the node that follows when this one's subtree is left out."""
    first: Ints
    """[nodes] where a leaf's obstacles begin in `members`; the next node's entry ends them."""
    members: Ints
    """[n] obstacle indices, leaf by leaf."""


def build_box_tree(shapes: Shapes) -> BoxTree:
    """A tree that halves the obstacles at the median of their longest spread."""
    reach = np.einsum("nij,nj->ni", np.abs(shapes.rotation), shapes.half_m)
    reach += shapes.radius_m[:, None]
    low, high = shapes.center_m - reach, shapes.center_m + reach
    skip: list[int] = []
    first: list[int] = []
    groups: list[IntArray] = []
    members: list[int] = []

    def add(group: IntArray) -> None:
        node = len(groups)
        groups.append(group)
        skip.append(0)
        first.append(len(members))
        if len(group) <= LEAF_SIZE:
            members.extend(group.tolist())
        else:
            centers = shapes.center_m[group]
            axis = int(np.argmax(np.ptp(centers, axis=0)))
            ordered = group[np.argsort(centers[:, axis], kind="stable")]
            add(ordered[: len(group) // 2])
            add(ordered[len(group) // 2 :])
        skip[node] = len(groups)

    if len(shapes.radius_m):
        add(np.arange(len(shapes.radius_m), dtype=np.int64))
    return BoxTree(
        np.array([low[group].min(axis=0) for group in groups]).reshape(-1, 3),
        np.array([high[group].max(axis=0) for group in groups]).reshape(-1, 3),
        np.array(skip, dtype=np.int64),
        np.array([*first, len(members)], dtype=np.int64),
        np.array(members, dtype=np.int64),
    )


@compiled
def box_lower_bound(x: float, y: float, z: float, tree: BoxTree, node: int) -> float:
    """No obstacle of the node is nearer to the point than this, signed like their distances."""
    low, high = tree.low_m, tree.high_m
    qx = max(low[node, 0] - x, x - high[node, 0])
    qy = max(low[node, 1] - y, y - high[node, 1])
    qz = max(low[node, 2] - z, z - high[node, 2])
    return distance_beyond(qx, qy, qz)


@compiled
def obstacles_within(
    x: float, y: float, z: float, limit: float, shapes: Shapes, tree: BoxTree
) -> Ints:
    """Ascending indices of the obstacles whose surface is at most `limit` from a point."""
    found = np.empty(len(tree.members), dtype=np.int64)
    count = 0
    node = 0
    while node < len(tree.skip):
        if box_lower_bound(x, y, z, tree, node) > limit:
            node = tree.skip[node]
            continue
        # Inner nodes share their first member with the leaf that follows: an empty range.
        for m in range(tree.first[node], tree.first[node + 1]):
            n = tree.members[m]
            distance = shape_distance(x, y, z, shapes, n)
            if distance <= limit:
                found[count] = n
                count += 1
        node += 1
    return np.sort(found[:count])


@compiled
def nearest_obstacles(
    points: Floats2, within: float, shapes: Shapes, tree: BoxTree
) -> tuple[Floats, Ints]:
    """Signed distance [n] of points [n, 3] to the nearest obstacle, and its index; inf and -1 where
    none is nearer than `within`."""
    distances = np.full(len(points), within)
    nearest = np.full(len(points), -1, dtype=np.int64)
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        node = 0
        while node < len(tree.skip):
            if box_lower_bound(x, y, z, tree, node) >= distances[p]:
                node = tree.skip[node]
                continue
            for m in range(tree.first[node], tree.first[node + 1]):
                n = tree.members[m]
                distance = shape_distance(x, y, z, shapes, n)
                if distance < distances[p]:
                    distances[p] = distance
                    nearest[p] = n
            node += 1
        if nearest[p] < 0:
            distances[p] = np.inf
    return distances, nearest
