"""What is remembered, as boxes around returns: per voxel the smallest box that holds them all.

Boxes unite the same in any order, so neither where a sweep starts nor which of two sweeps came
first makes a difference. A decision takes the ball around a box, grown by half the beam spacing: no
return lies nearer than its ball.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Bools, Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.sensors.passing.passed_points import Sensor

LONE = 0
IN_LINE = 1
BETWEEN = 2
"""Kinds: a return as such; one of several in a line; filled in between two of those."""
MOST_LEVELS = 7
"""Times that the pitch may double; eight levels fit into a key."""
LEVEL_SHIFT = 60
"""Of the level in a key."""


class Boxes(NamedTuple):
    """Columns of what is remembered, the longest unobserved first."""

    low_m: Floats2
    """[n, 3] world frame, lifted by what the memory says."""
    high_m: Floats2
    """[n, 3]"""
    spacing_m: Floats
    """[n] half the beam spacing there when it was last seen."""
    last_seen_s: Floats
    """[n]"""
    size_m: Floats
    """[n] how thick the thing is at least; 0 where beams hit it one by one, or in a line."""
    doubt: Floats
    """[n] what speaks against it since it was last seen; at 1 it is forgotten."""
    sweeps: Ints
    """[n] sweeps that saw it."""
    kind: Ints
    """[n]"""
    level: Ints
    """[n] times that the pitch of its voxel was doubled."""


class Pitch(NamedTuple):
    """Which voxel a return falls into."""

    voxel_m: float
    fine_m: float
    """Out to this distance from the sensor the pitch is that of a voxel; with every doubling of the
    distance it doubles."""


def no_boxes() -> Boxes:
    nothing, none = np.zeros(0), np.zeros(0, dtype=np.int64)
    return Boxes(
        np.zeros((0, 3)), np.zeros((0, 3)), nothing, nothing, nothing, nothing, none, none, none
    )


@compiled
def box_key(x: float, y: float, z: float, level: int, voxel: float) -> int:
    """One integer for the voxel of a point; repeats only after a million voxels an axis."""
    per_voxel = 1.0 / (voxel * (1 << level))
    i = int(np.floor(x * per_voxel)) & 0xFFFFF
    j = int(np.floor(y * per_voxel)) & 0xFFFFF
    k = int(np.floor(z * per_voxel)) & 0xFFFFF
    return (level << LEVEL_SHIFT) | (i << 40) | (j << 20) | k


@compiled
def key_of(boxes: Boxes, n: int, voxel: float) -> int:
    """The voxel of a box, which is that of its middle."""
    return box_key(
        0.5 * (boxes.low_m[n, 0] + boxes.high_m[n, 0]),
        0.5 * (boxes.low_m[n, 1] + boxes.high_m[n, 1]),
        0.5 * (boxes.low_m[n, 2] + boxes.high_m[n, 2]),
        boxes.level[n],
        voxel,
    )


@compiled
def level_at(distance: float, fine: float) -> int:
    """Times that the pitch is doubled at a distance."""
    level = 0
    for _ in range(MOST_LEVELS):  # To the end, without a branch: neighbours differ.
        level += distance > fine
        fine *= 2.0
    return level


@compiled
def empty_boxes(count: int) -> Boxes:
    return Boxes(
        np.empty((count, 3)),
        np.empty((count, 3)),
        np.empty(count),
        np.empty(count),
        np.empty(count),
        np.empty(count),
        np.empty(count, dtype=np.int64),
        np.empty(count, dtype=np.int64),
        np.empty(count, dtype=np.int64),
    )


@compiled
def first_boxes(boxes: Boxes, count: int) -> Boxes:
    """The first so many of them."""
    return Boxes(
        boxes.low_m[:count],
        boxes.high_m[:count],
        boxes.spacing_m[:count],
        boxes.last_seen_s[:count],
        boxes.size_m[:count],
        boxes.doubt[:count],
        boxes.sweeps[:count],
        boxes.kind[:count],
        boxes.level[:count],
    )


@compiled
def with_doubt(boxes: Boxes, doubt: Floats) -> Boxes:
    """The same with another doubt [n]."""
    return Boxes(
        boxes.low_m,
        boxes.high_m,
        boxes.spacing_m,
        boxes.last_seen_s,
        boxes.size_m,
        doubt,
        boxes.sweeps,
        boxes.kind,
        boxes.level,
    )


@compiled
def copy_box(source: Boxes, n: int, target: Boxes, m: int) -> None:
    for axis in range(3):
        target.low_m[m, axis] = source.low_m[n, axis]
        target.high_m[m, axis] = source.high_m[n, axis]
    target.spacing_m[m] = source.spacing_m[n]
    target.last_seen_s[m] = source.last_seen_s[n]
    target.size_m[m] = source.size_m[n]
    target.doubt[m] = source.doubt[n]
    target.sweeps[m] = source.sweeps[n]
    target.kind[m] = source.kind[n]
    target.level[m] = source.level[n]


@compiled
def pick_boxes(boxes: Boxes, keep: Bools) -> Boxes:
    """Those that are marked [n], in their order."""
    which = np.flatnonzero(keep)
    kept = empty_boxes(len(which))
    _copy_boxes(boxes, which, kept, 0)
    return kept


@compiled
def _copy_boxes(source: Boxes, which: Ints, target: Boxes, begin: int) -> None:
    """Copy boxes by their numbers, column by column, to the places from one on."""
    for m in range(len(which)):
        n = which[m]
        for axis in range(3):
            target.low_m[begin + m, axis] = source.low_m[n, axis]
    for m in range(len(which)):
        n = which[m]
        for axis in range(3):
            target.high_m[begin + m, axis] = source.high_m[n, axis]
    for m in range(len(which)):
        n = which[m]
        target.spacing_m[begin + m] = source.spacing_m[n]
        target.last_seen_s[begin + m] = source.last_seen_s[n]
    for m in range(len(which)):
        n = which[m]
        target.size_m[begin + m], target.doubt[begin + m] = source.size_m[n], source.doubt[n]
    for m in range(len(which)):
        n = which[m]
        target.sweeps[begin + m], target.kind[begin + m] = source.sweeps[n], source.kind[n]
        target.level[begin + m] = source.level[n]


@compiled
def unite(target: Boxes, m: int, other: Boxes, n: int) -> None:
    """Let box m hold box n too; what is known of the thing is known of both."""
    for axis in range(3):
        target.low_m[m, axis] = min(target.low_m[m, axis], other.low_m[n, axis])
        target.high_m[m, axis] = max(target.high_m[m, axis], other.high_m[n, axis])
    target.size_m[m] = max(target.size_m[m], other.size_m[n])
    # A return right where a line was filled in belongs to that line.
    target.kind[m] = LONE if target.kind[m] == LONE and other.kind[n] == LONE else IN_LINE


@compiled
def merge_boxes(old: Boxes, doubt: Floats, seen: Boxes, again: Ints) -> tuple[Boxes, int]:
    """Old boxes that doubt leaves, then those seen now, which hold the old ones of their voxels.

    Also how many there are of the former. doubt: [old]; again: [old] `match_boxes_seen`.
    """
    both = empty_boxes(len(doubt) + len(seen.doubt))
    kept, total = _put_together(old, doubt, seen, again, both)
    return first_boxes(both, total), kept


@compiled
def _put_together(
    old: Boxes, doubt: Floats, seen: Boxes, again: Ints, both: Boxes
) -> tuple[int, int]:
    """Fill in `merge_boxes`: how many are kept of the old ones, and how many there are in all."""
    which = np.empty(len(doubt), dtype=np.int64)
    kept = 0
    for n in range(len(doubt)):
        which[kept] = n  # Written always and passed over if it goes: no branch.
        kept += (again[n] < 0) & (doubt[n] < 1.0)
    _copy_boxes(with_doubt(old, doubt), which[:kept], both, 0)
    _copy_boxes(seen, np.arange(len(seen.doubt)), both, kept)
    for n in range(len(again)):
        if again[n] >= 0:
            unite(both, kept + again[n], old, n)
            both.sweeps[kept + again[n]] += old.sweeps[n]
    return kept, kept + len(seen.doubt)


class Balls(NamedTuple):
    """What decisions take."""

    position_m: Floats2
    """[n, 3] world frame."""
    radius_m: Floats
    """[n]"""


@compiled
def balls_of(boxes: Boxes, lift: float) -> Balls:
    """The ball around each box, grown by half the beam spacing; world frame, above which boxes are
    lifted by so much."""
    count = len(boxes.doubt)
    position, radius = np.empty((count, 3)), np.empty(count)
    for n in range(count):
        squared = 0.0
        for axis in range(3):
            low, high = boxes.low_m[n, axis], boxes.high_m[n, axis]
            # A lone return stays where it was, whatever the rounding.
            position[n, axis] = low if low == high else 0.5 * (low + high)
            squared += (high - low) ** 2
        position[n, 2] -= lift
        radius[n] = 0.5 * np.sqrt(squared) + boxes.spacing_m[n]
    return Balls(position, radius)


@compiled
def mark_in_reach(boxes: Boxes, sensor: Sensor, reach: float) -> Bools:
    """[n] whether any of the box may lie within reach of the sensor."""
    near = np.empty(len(boxes.doubt), dtype=np.bool_)
    for n in range(len(near)):
        squared = 0.0
        for axis in range(3):
            below = boxes.low_m[n, axis] - sensor.origin[axis]
            above = sensor.origin[axis] - boxes.high_m[n, axis]
            squared += max(below, above, 0.0) ** 2
        near[n] = squared <= reach * reach
    return near
