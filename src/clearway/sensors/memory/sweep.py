"""What one sweep leaves of what was remembered, and what it adds: in one go, compiled."""

from __future__ import annotations

from typing import NamedTuple

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.sensors.beams.raster import BeamRaster, directions_of, nearest_returns
from clearway.sensors.memory.bounded import Limits, Room, fits, make_room
from clearway.sensors.memory.doubt import DoubtRule, doubts
from clearway.sensors.memory.remembered import (
    LONE,
    Balls,
    Boxes,
    Pitch,
    balls_of,
    merge_boxes,
    with_doubt,
)
from clearway.sensors.memory.swept_boxes import match_numbered_boxes, number_boxes
from clearway.sensors.memory.wires import join_lines
from clearway.sensors.passing.passed_points import Sensor
from clearway.sensors.passing.width import returns_with_size


class Swept(NamedTuple):
    """What a sweep leaves, and what it counted."""

    room: Room
    balls: Balls
    refuted: int
    alone: int
    borne_out: int


@compiled
def sweep_returns(
    points: Floats2,
    hiding: Floats2,
    boxes: Boxes,
    balls: Balls,
    sensor: Sensor,
    before: Sensor,
    raster: BeamRaster,
    rule: DoubtRule,
    limits: Limits,
    ground: float,
) -> tuple[int, Swept]:
    """Returns left out as too small, and what a sweep whose attitude is known leaves.

    hiding: [k, 3] more returns, which only hide what is behind them.
    """
    directions = directions_of(points, raster)
    seen = returns_with_size(points, sensor, limits.reach_m, ground, directions, limits.smallest_m)
    pitch = Pitch(limits.voxel_m, limits.fine_m)
    new, table = number_boxes(
        seen.points_m, seen.radius_m, seen.size_m, sensor.origin, pitch, limits.time_s
    )
    again = match_numbered_boxes(boxes, table, limits.voxel_m)
    nearest = nearest_with(directions.nearest_m, hiding, raster)
    doubt = doubts(boxes, again, nearest, sensor, before, raster, rule)
    return seen.too_small, remember_sweep(boxes, balls, doubt, new, again, sensor.origin, limits)


@compiled
def nearest_with(nearest: Floats2, hiding: Floats2, raster: BeamRaster) -> Floats2:
    """[columns, rows] range of the nearest return per bin, of some more too."""
    if len(hiding) == 0:
        return nearest
    both = nearest_returns(hiding, raster)
    columns, rows = both.shape
    for c in range(columns):
        for r in range(rows):
            both[c, r] = min(both[c, r], nearest[c, r])
    return both


@compiled
def remember_sweep(
    before: Boxes,
    balls: Balls,
    doubt: Floats,
    seen: Boxes,
    again: Ints,
    origin: Floats,
    limits: Limits,
) -> Swept:
    """What a sweep from a place leaves of what was remembered, and what it adds."""
    refuted = _count_refuted(before, doubt) if _count_cleared(doubt) else 0
    _expire(before, doubt, origin, limits.reach_m, limits.oldest_s)
    if len(seen.doubt) + _count_cleared(doubt) == 0 and fits(before, limits):
        # Nothing comes, nothing goes: but for doubt all is as it was.
        return Swept(Room(with_doubt(before, doubt), limits.fine_m, 0, 0), balls, refuted, 0, 0)
    both, kept = merge_boxes(before, doubt, seen, again)
    boxes = join_lines(both, kept, limits.voxel_m, limits.deviation_m, limits.time_s)
    alone, borne_out = _count_bare(boxes, kept, 1), _count_bare(boxes, kept, 2)
    room = make_room(boxes, origin, limits)
    return Swept(room, balls_of(room.boxes, limits.lift_m), refuted, alone, borne_out)


@compiled
def _count_cleared(doubt: Floats) -> int:
    count = 0
    for n in range(len(doubt)):
        count += not doubt[n] < 1.0
    return count


@compiled
def _expire(boxes: Boxes, doubt: Floats, origin: Floats, reach: float, before: float) -> None:
    """Doubt what is out of reach and was last seen before a time."""
    for n in range(len(doubt)):
        if boxes.last_seen_s[n] >= before:
            return
        squared = 0.0
        for axis in range(3):
            below = boxes.low_m[n, axis] - origin[axis]
            above = origin[axis] - boxes.high_m[n, axis]
            squared += max(max(below, above), 0.0) ** 2
        if squared > reach * reach:
            doubt[n] = 1.0


@compiled
def _count_refuted(boxes: Boxes, doubt: Floats) -> int:
    """Boxes that nothing bore out and that are cleared now."""
    count = 0
    for n in range(len(doubt)):
        lone = boxes.sweeps[n] == 1 and boxes.size_m[n] == 0.0 and boxes.kind[n] == LONE
        count += lone and doubt[n] >= 1.0
    return count


@compiled
def _count_bare(boxes: Boxes, first_new: int, sweeps: int) -> int:
    """Boxes of the latest sweep that no line and no width bears out, and so many sweeps saw."""
    count = 0
    for n in range(first_new, len(boxes.doubt)):
        bare = boxes.sweeps[n] == sweeps and boxes.size_m[n] == 0.0
        count += bare and boxes.kind[n] == LONE
    return count
