"""A bounded memory that forgets nothing within reach: what is too much becomes coarser far off."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats
from clearway.base.compiled import compiled
from clearway.sensors.memory.remembered import (
    Boxes,
    box_key,
    copy_box,
    empty_boxes,
    level_at,
    pick_boxes,
    unite,
)
from clearway.sensors.voxels import slot_of, table_bits

FINER = 0.84
"""Factor by which the distance of fine pitch shrinks until there is room."""
LEAST_FINE = 1e-3
"""Share of the reach below which it does not shrink."""


class Limits(NamedTuple):
    """What a memory goes by at a sweep."""

    voxel_m: float
    lift_m: float
    """Of boxes above the world frame."""
    fine_m: float
    widest_m: float
    """What `fine_m` is at most."""
    reach_m: float
    smallest_m: float
    capacity: int
    leaves: float
    """Share of it that is filled at most after boxes were made coarser: the less, the rarer."""
    deviation_m: float
    """By which a return may lie off a line."""
    time_s: float
    oldest_s: float
    """What was last seen before is forgotten where it is out of reach."""


class Room(NamedTuple):
    """What is kept."""

    boxes: Boxes
    fine_m: float
    """Distance of fine pitch that took."""
    dropped: int
    """Boxes beyond reach that are forgotten."""
    merged: int
    """Boxes within reach that are now part of coarser ones."""


@compiled
def fits(boxes: Boxes, limits: Limits) -> bool:
    """Whether there is room for all of them, and always was."""
    return len(boxes.doubt) <= limits.capacity and limits.fine_m == limits.widest_m


@compiled
def make_room(boxes: Boxes, center: Floats, limits: Limits) -> Room:
    """At most about `capacity` boxes: first the farthest beyond reach go, then the pitch grows.

    With every doubling of the distance from the centre beyond `fine_m` the pitch doubles; that is
    tried first and widened again where there is room to spare.
    """
    count, reach, capacity = len(boxes.doubt), limits.reach_m, limits.capacity
    voxel, fine_m = limits.voxel_m, limits.fine_m
    if fits(boxes, limits):
        return Room(boxes, fine_m, 0, 0)
    away = np.empty(count)
    beyond = 0
    for n in range(count):
        squared = 0.0
        for axis in range(3):
            below = boxes.low_m[n, axis] - center[axis]
            above = center[axis] - boxes.high_m[n, axis]
            squared += max(max(below, above), 0.0) ** 2
        away[n] = np.sqrt(squared)
        beyond += away[n] > reach
    # What is within reach is not kept coarse for the sake of what is beyond.
    dropped = beyond if fine_m < limits.widest_m else min(beyond, count - capacity)
    if dropped > 0:
        limit = np.partition(away, count - dropped)[count - dropped]
        keep = away < max(limit, np.nextafter(reach, np.inf))
        boxes, away = pick_boxes(boxes, keep), away[keep]
        dropped = count - len(away)
    if len(away) <= capacity:
        spare = 2 * len(away) <= capacity
        wider = min(_wider(fine_m, reach), limits.widest_m)
        return Room(boxes, wider if spare else fine_m, dropped, 0)
    fine, leaves = min(fine_m, reach), limits.leaves * capacity
    while fine > LEAST_FINE * reach and _coarse_count(boxes, away, fine, voxel) > leaves:
        fine *= FINER
    coarse = _coarsen(boxes, away, fine, voxel)
    return Room(coarse, fine, dropped, len(away) - len(coarse.doubt))


@compiled
def _wider(fine: float, reach: float) -> float:
    return np.inf if fine >= reach else fine / FINER


@compiled
def _coarse_key(boxes: Boxes, n: int, away: float, fine: float, voxel: float) -> int:
    return box_key(
        0.5 * (boxes.low_m[n, 0] + boxes.high_m[n, 0]),
        0.5 * (boxes.low_m[n, 1] + boxes.high_m[n, 1]),
        0.5 * (boxes.low_m[n, 2] + boxes.high_m[n, 2]),
        max(boxes.level[n], level_at(away, fine)),
        voxel,
    )


@compiled
def _coarse_count(boxes: Boxes, away: Floats, fine: float, voxel: float) -> int:
    """How many boxes a distance of fine pitch would leave."""
    bits = table_bits(len(away))
    keys = np.full(1 << bits, -1, dtype=np.int64)
    count = 0
    for n in range(len(away)):
        key = _coarse_key(boxes, n, away[n], fine, voxel)
        slot = slot_of(key, keys, 64 - bits)
        if keys[slot] == -1:
            keys[slot] = key
            count += 1
    return count


@compiled
def _coarsen(boxes: Boxes, away: Floats, fine: float, voxel: float) -> Boxes:
    """One box per voxel of the pitch that suits its distance, the longest unobserved first."""
    bits = table_bits(len(away))
    shift = 64 - bits
    keys = np.full(1 << bits, -1, dtype=np.int64)
    numbers = np.empty(1 << bits, dtype=np.int64)
    coarse = empty_boxes(len(away))
    count = 0
    # The latest first, so that a box takes its place by when any of it was seen last.
    for n in range(len(away) - 1, -1, -1):
        key = _coarse_key(boxes, n, away[n], fine, voxel)
        slot = slot_of(key, keys, shift)
        if keys[slot] == -1:
            keys[slot], numbers[slot] = key, count
            copy_box(boxes, n, coarse, count)
            coarse.level[count] = max(boxes.level[n], level_at(away[n], fine))
            count += 1
            continue
        m = numbers[slot]
        unite(coarse, m, boxes, n)
        coarse.spacing_m[m] = max(coarse.spacing_m[m], boxes.spacing_m[n])
        coarse.doubt[m] = min(coarse.doubt[m], boxes.doubt[n])
        coarse.sweeps[m] = max(coarse.sweeps[m], boxes.sweeps[n])
    ordered = empty_boxes(count)
    for n in range(count):
        copy_box(coarse, count - 1 - n, ordered, n)
    return ordered
