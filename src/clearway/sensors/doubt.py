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

from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.sensors.passing import REACH_OF_BEAM, BeamRaster, Sensor, goes_on, in_sensor
from clearway.sensors.remembered import ALONE, Boxes, level_at

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


@compiled
def doubts(
    boxes: Boxes,
    again: IntArray,
    nearest: FloatArray,
    sensor: Sensor,
    before: Sensor,
    raster: BeamRaster,
    rule: DoubtRule,
) -> FloatArray:
    """[n] doubt of each box after a sweep; from 1 on it is cleared.

    again: [n] `remembered.seen_again`; what the sweep has hit again is not asked for, but for lone
    returns, of which the false ones are counted. nearest: [columns, rows]
    `passing.nearest_returns` of the sweep. before: the sensor at the sweep before.
    """
    doubt = boxes.doubt.copy()
    _add_doubts(boxes, again, nearest, sensor, before, raster, rule, doubt)
    return doubt


@borrowing
def _add_doubts(
    boxes: Boxes,
    again: IntArray,
    nearest: FloatArray,
    sensor: Sensor,
    before: Sensor,
    raster: BeamRaster,
    rule: DoubtRule,
    doubt: FloatArray,
) -> None:
    spacing = 2.0 * sensor.half_spacing
    for n in range(len(doubt)):
        lone = boxes.size_m[n] == 0.0 and boxes.kind[n] == ALONE and boxes.sweeps[n] == 1
        if again[n] >= 0 and not lone:
            continue
        px = 0.5 * (boxes.low_m[n, 0] + boxes.high_m[n, 0])
        py = 0.5 * (boxes.low_m[n, 1] + boxes.high_m[n, 1])
        pz = 0.5 * (boxes.low_m[n, 2] + boxes.high_m[n, 2])
        x, y, z = in_sensor(px, py, pz, sensor)
        distance = np.sqrt(x * x + y * y + z * z)
        apart = spacing * distance
        size = boxes.size_m[n]
        surely = apart <= SAME * max(size, rule.smallest_m)
        if lone and rule.rains:
            surely = surely or REACH_OF_BEAM * apart <= rule.voxel_m
        if not surely and size > 0.0:
            continue
        if not goes_on(
            x, y, z, distance, _beyond(boxes, n, distance, sensor, rule), nearest, sensor, raster
        ):
            continue
        if surely:
            doubt[n] += 1.0 / rule.passes_to_clear
        else:
            turned = _turned(px, py, pz, x, y, z, distance, before)
            likely = rule.smallest_m / apart
            doubt[n] += likely * min(1.0, turned / spacing) / HITS_MISSED


@borrowing
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


@borrowing
def _turned(
    px: float, py: float, pz: float, x: float, y: float, z: float, distance: float, before: Sensor
) -> float:
    """Angle between the directions to a point at this sweep and the one before, sensor frame."""
    u, v, w = in_sensor(px, py, pz, before)
    then = np.sqrt(u * u + v * v + w * w)
    if not (then > 0.0 and distance > 0.0):
        return 0.0
    a, b, c = x / distance - u / then, y / distance - v / then, z / distance - w / then
    return float(np.sqrt(a * a + b * b + c * c))
