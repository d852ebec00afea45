"""What a sweep that goes on beyond remembered things says against them.

Where beams lie closer together than a thing is thick, none can miss it: few such sweeps clear it.
What single beams hit, or a line of them, may be much thinner than beams lie apart, and then most
sweeps miss it though it is there. Against such a thing a sweep counts only as much as it was likely
to hit it, and only if it looked along other lines than the one before. So wires stay until they
were looked at from near enough, or often enough; what never was there goes in the end.

Rain, dust and the sun return single beams here and there, never twice from the same place. While
sweeps have such returns, one that nothing bears out, neither a line nor a second sweep, is cleared
as if it were as wide as a voxel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Int32s, Ints
from clearway.base.compiled import compiled
from clearway.sensors.beams.raster import BLOCK, BeamRaster, sort_into_bins
from clearway.sensors.memory.remembered import LONE, Boxes, level_at
from clearway.sensors.passing.passed_points import REACH_OF_BEAM, Sensor, goes_on, in_sensor

SAME = 1.05
"""Factor by which beams may lie farther apart than the thing is thick, for all the rounding."""
THINNEST_M = 0.01
"""Thickness of what beams hit one by one, where nothing is declared."""
HITS_MISSED = 3.0
"""Hits that a thing must have been likely to give, and did not, to be forgotten: 95 %."""
RAIN = 1.0
"""Returns a sweep, on average, that nothing bears out: from there on they are rain or the like."""


class DoubtRule(NamedTuple):
    """How much it takes to forget."""

    voxel_m: float
    fine_m: float
    """Out to this distance the pitch of voxels is not coarsened."""
    passes_to_clear: float
    """Sweeps of beams that cannot miss."""
    smallest_m: float
    """Thickness of the thinnest thing sought."""
    rains: bool


class _Room(NamedTuple):
    """For a block of boxes."""

    local_m: Floats
    """[3 * BLOCK] middles in the sensor's frame, one after the other."""
    distance_m: Floats
    """[BLOCK]"""
    bins: Int32s
    """[BLOCK] as `Directions.bin`."""
    which: Ints
    """[BLOCK] of the block's boxes."""


@compiled
def doubts(
    boxes: Boxes,
    again: Ints,
    nearest: Floats2,
    sensor: Sensor,
    before: Sensor,
    raster: BeamRaster,
    rule: DoubtRule,
) -> Floats:
    """[n] doubt of each box after a sweep; from 1 on it is cleared.

    again: [n] `match_boxes_seen`; what the sweep has hit again is not asked for, but for lone
    returns, of which the false ones are counted. nearest: [columns, rows]
    `passing.nearest_returns` of the sweep. before: the sensor at the sweep before.
    """
    doubt = boxes.doubt.copy()
    room = _Room(
        np.empty(3 * BLOCK),
        np.empty(BLOCK),
        np.empty(BLOCK, dtype=np.int32),
        np.empty(BLOCK, dtype=np.int64),
    )
    _add_doubts(boxes, again, nearest, sensor, before, raster, rule, room, doubt)
    return doubt


@compiled
def _add_doubts(
    boxes: Boxes,
    again: Ints,
    nearest: Floats2,
    sensor: Sensor,
    before: Sensor,
    raster: BeamRaster,
    rule: DoubtRule,
    room: _Room,
    doubt: Floats,
) -> None:
    for begin in range(0, len(doubt), BLOCK):
        end = min(begin + BLOCK, len(doubt))
        looked_at = _look_at(boxes, begin, end, sensor, raster, room)
        for m in range(looked_at):
            n, at = begin + room.which[m], room.which[m]
            doubt[n] += _weigh_against(
                boxes, n, again[n] >= 0, room, at, nearest, sensor, before, raster, rule
            )


@compiled
def _look_at(
    boxes: Boxes, begin: int, end: int, sensor: Sensor, raster: BeamRaster, room: _Room
) -> int:
    """Note which boxes of a block, from its first on, lie where the sweep has beams on either side;
    how many. Most lie elsewhere, and a loop without branches tells that of several at a time."""
    o, r, local = sensor.origin, sensor.rotation, room.local_m
    low = boxes.low_m.reshape(boxes.low_m.size)[3 * begin : 3 * end]
    high = boxes.high_m.reshape(boxes.high_m.size)[3 * begin : 3 * end]
    r00, r01, r02, ox = r[0, 0], r[0, 1], r[0, 2], o[0]
    r10, r11, r12, oy = r[1, 0], r[1, 1], r[1, 2], o[1]
    r20, r21, r22, oz = r[2, 0], r[2, 1], r[2, 2], o[2]
    for n in range(end - begin):
        a = 0.5 * (low[3 * n] + high[3 * n]) - ox
        b = 0.5 * (low[3 * n + 1] + high[3 * n + 1]) - oy
        c = 0.5 * (low[3 * n + 2] + high[3 * n + 2]) - oz
        local[3 * n] = r00 * a + r10 * b + r20 * c
        local[3 * n + 1] = r01 * a + r11 * b + r21 * c
        local[3 * n + 2] = r02 * a + r12 * b + r22 * c
    bins, which, flanked = room.bins, room.which, raster.flanked.reshape(raster.flanked.size)
    sort_into_bins(
        local[: 3 * (end - begin)],
        raster.low.shape[0],
        raster.low.shape[1],
        raster.per_column,
        raster.per_row,
        raster.bottom,
        room.distance_m[: end - begin],
        bins[: end - begin],
    )
    found = 0
    for n in range(end - begin):
        which[found] = n
        found += bins[n] >= 0 and flanked[np.uint32(max(bins[n], 0))]
    return found


@compiled
def _weigh_against(
    boxes: Boxes,
    n: int,
    hit: bool,
    room: _Room,
    at: int,
    nearest: Floats2,
    sensor: Sensor,
    before: Sensor,
    raster: BeamRaster,
    rule: DoubtRule,
) -> float:
    """What a sweep says against one box, which it may have hit again; at: where it is in the room
    of its block."""
    lone = boxes.size_m[n] == 0.0 and boxes.kind[n] == LONE and boxes.sweeps[n] == 1
    if hit and not lone:
        return 0.0
    distance, size = room.distance_m[at], boxes.size_m[n]
    spacing = 2.0 * sensor.half_spacing
    apart = spacing * distance
    surely = apart <= SAME * max(size, rule.smallest_m)
    if lone and rule.rains:
        surely = surely or REACH_OF_BEAM * apart <= rule.voxel_m
    if not surely and size > 0.0:
        return 0.0
    x, y, z = room.local_m[3 * at], room.local_m[3 * at + 1], room.local_m[3 * at + 2]
    beyond = _beyond(boxes, n, distance, sensor, rule)
    if not goes_on(x, y, z, distance, beyond, nearest, sensor, raster):
        return 0.0
    if surely:
        return 1.0 / rule.passes_to_clear
    px = 0.5 * (boxes.low_m[n, 0] + boxes.high_m[n, 0])
    py = 0.5 * (boxes.low_m[n, 1] + boxes.high_m[n, 1])
    pz = 0.5 * (boxes.low_m[n, 2] + boxes.high_m[n, 2])
    turned = _measure_turn(px, py, pz, x, y, z, distance, before)
    likely = rule.smallest_m / apart
    return float(likely * min(1.0, turned / spacing) / HITS_MISSED)


@compiled
def _beyond(boxes: Boxes, n: int, distance: float, sensor: Sensor, rule: DoubtRule) -> float:
    """How far beams around a box must go."""
    dx = boxes.high_m[n, 0] - boxes.low_m[n, 0]
    dy = boxes.high_m[n, 1] - boxes.low_m[n, 1]
    dz = boxes.high_m[n, 2] - boxes.low_m[n, 2]
    around = 0.5 * np.sqrt(dx * dx + dy * dy + dz * dz)
    if boxes.level[n] > level_at(distance, rule.fine_m):
        # What beams hit inside a box of coarse pitch is remembered by finer ones.
        return float(max(0.0, distance - around - sensor.tolerance))
    return float(distance + max(around, 0.5 * rule.voxel_m) + sensor.tolerance)


@compiled
def _measure_turn(
    px: float, py: float, pz: float, x: float, y: float, z: float, distance: float, before: Sensor
) -> float:
    """Angle between the directions to a point at this sweep and the one before, sensor frame."""
    u, v, w = in_sensor(px, py, pz, before)
    then = np.sqrt(u * u + v * v + w * w)
    if not (then > 0.0 and distance > 0.0):
        return 0.0
    a, b, c = x / distance - u / then, y / distance - v / then, z / distance - w / then
    return float(np.sqrt(a * a + b * b + c * c))
