"""Detected points: remembered, also out of view, and forgotten where beams show nothing is left.

Nothing within reach is forgotten for want of room or for its age. Returns that share a voxel share
a ball that covers them all (`remembered`); where balls get too many, voxels grow with the distance
(`room`). What returns come from is at least as thick as a sweep shows (`width`), returns in a line
are joined to a wire (`wires`), and only beams fine enough for what was seen clear it (`doubt`). A
nearer return hides what lies behind and says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.brief import brief
from clearway.base.compiled import compiled, read_only
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.sensors.beams.lidar import Lidar, Scan
from clearway.sensors.beams.raster import beam_raster, directions_of
from clearway.sensors.memory.bounded import Limits
from clearway.sensors.memory.doubt import RAIN, THINNEST_M, DoubtRule, doubts
from clearway.sensors.memory.remembered import (
    LONE,
    Balls,
    Boxes,
    Pitch,
    balls_of,
    no_boxes,
    pick_boxes,
)
from clearway.sensors.memory.sweep import Swept, nearest_with, remember_sweep, sweep_returns
from clearway.sensors.memory.swept_boxes import boxes_of_returns, match_boxes_seen
from clearway.sensors.memory.uncertain import radii_unsure, turn_by_doubt
from clearway.sensors.passing.passed_points import Sensor, sensor_at
from clearway.sensors.passing.width import returns_with_size

NONE_HIDING = read_only(np.zeros((0, 3)))
CAPACITY = 20_000
"""Balls that are remembered, where nothing else is set."""
AMID = 256.0 / 3.0
"""Voxels: a third of a voxel, or two, above a border, for all pitches."""
LEAVES = 0.85
"""Share of the capacity that coarser balls fill at most, where the pitch follows the beams."""
OFF_LINE = 0.5
"""Of a voxel, by which returns may lie off a wire, beside noise."""
RATE_KEPT = 0.8
"""Of the averages of returns that nothing bears out, from sweep to sweep."""
POURS = 1.0
BORNE_OUT = 0.5
"""Lone returns proven false a sweep, and how many for each of them may be seen again, from where on
a lone return is more likely a drop than a thing: then a second sweep has to see it."""


@dataclass(frozen=True, slots=True, eq=False)
class PointMemory:
    """Remembered hit points: at most one ball per voxel of the world, the longest unobserved
    first."""

    voxel_m: float
    horizon_s: float
    """Points out of reach are forgotten when they were not seen for longer."""
    reach_m: float
    """From the sensor; returns from farther away are not remembered, nothing nearer is forgotten
    but on evidence."""
    capacity: int
    """About how many balls there are at most."""
    passes_to_clear: int
    """Sweeps in a row of beams fine enough that must pass through a point."""
    smallest_m: float
    """Thickness of the smallest thing sought; 0 where it is not declared."""
    boxes: Boxes
    balls: Balls
    widest_m: float = np.inf
    """What `fine_m` is at most: farther off, beams lie too far apart for more balls to tell more.
    """
    fine_m: float = np.inf
    """Distance beyond which the pitch of voxels doubles with every doubling of the distance: less
    than `widest_m` for want of room."""
    alone_a_sweep: float = 0.0
    """New returns that nothing bears out, on average over the latest sweeps."""
    refuted_a_sweep: float = 0.0
    """Of these, those that beams have proven false since; on average."""
    borne_out_a_sweep: float = 0.0
    """And those that a second sweep has seen again; on average."""
    seen_from: Sensor | None = None
    """At the latest sweep."""
    dropped: int = 0
    """Balls beyond reach that the latest sweep left no room for."""
    merged: int = 0
    """Balls that became part of coarser ones with it."""
    too_small: int = 0
    """Returns of it that come from nothing of the smallest size."""
    sifted_from_s: float = np.inf
    """Since when lone returns come only if a second sweep bears them out; inf where they all do."""

    __repr__ = brief

    @classmethod
    def empty(
        cls,
        voxel_m: float,
        horizon_s: float = np.inf,
        *,
        reach_m: float = np.inf,
        capacity: int = CAPACITY,
        passes_to_clear: int = 2,
        smallest_m: float = 0.0,
        widest_m: float = np.inf,
    ) -> PointMemory:
        """Nothing remembered yet; raises ClearwayError naming an impossible setting."""
        settings = {
            "voxel_m": voxel_m,
            "horizon_s": horizon_s,
            "reach_m": reach_m,
            "widest_m": widest_m,
        }
        for name, value in settings.items():
            if not value > 0.0:
                raise ClearwayError(f"point memory: {name} must be above 0, got {value}")
        if not 0.0 <= smallest_m < np.inf:
            raise ClearwayError(f"point memory: smallest_m must be at least 0, got {smallest_m}")
        if capacity < 1 or passes_to_clear < 1:
            raise ClearwayError("point memory: capacity and passes_to_clear must be at least 1")
        boxes = no_boxes()
        return cls(
            float(voxel_m),
            float(horizon_s),
            float(reach_m),
            capacity,
            passes_to_clear,
            float(smallest_m),
            boxes,
            balls_of(boxes, 0.0),
            float(widest_m),
            float(widest_m),
        )

    @property
    def lift_m(self) -> float:
        """How far boxes are lifted above the world frame, where their pitch follows the beams: the
        ground at height 0, which is most of what a low sensor sees, then lies amid voxels of every
        pitch, not on the border of two of them."""
        return AMID * self.voxel_m if self.widest_m < np.inf else 0.0

    @property
    def position_m(self) -> FloatArray:
        """[n, 3] world frame."""
        return self.balls.position_m

    @property
    def radius_m(self) -> FloatArray:
        """[n] of the ball that covers all returns of the voxel, and half the beam spacing."""
        return self.balls.radius_m

    @property
    def last_seen_s(self) -> FloatArray:
        """[n] ascending."""
        return self.boxes.last_seen_s

    def near(self, position_m: FloatArray, radius_m: float) -> tuple[FloatArray, FloatArray]:
        """Positions [k, 3] and radii [k] of told balls within a distance of a position."""
        return _near(*self.told, read_only(position_m), float(radius_m))

    @property
    def pours(self) -> bool:
        """Whether lone returns mostly turn out to be nothing, and are many."""
        refuted = self.refuted_a_sweep
        return refuted >= POURS and self.borne_out_a_sweep <= BORNE_OUT * refuted

    @property
    def told(self) -> Balls:
        """What to keep clear of: all that is remembered; but where it pours, a lone return only
        from a second sweep on that sees it. What was sifted has been seen twice."""
        is_sifted = self.sifted_from_s < np.inf
        if not (is_sifted or self.pours):
            return self.balls
        waits = (self.boxes.sweeps == 1) & (self.boxes.kind == LONE) & (self.boxes.size_m == 0.0)
        if is_sifted:
            waits &= self.boxes.last_seen_s < self.sifted_from_s
        return Balls(self.position_m[~waits], self.radius_m[~waits])

    @property
    def rule(self) -> DoubtRule:
        """How much it takes to forget."""
        return DoubtRule(
            self.voxel_m,
            self.fine_m,
            float(self.passes_to_clear),
            self.smallest_m or THINNEST_M,
            self.alone_a_sweep >= RAIN or self.sifted_from_s < np.inf,
        )


def update_memory(
    memory: PointMemory,
    lidar: Lidar,
    scan: Scan,
    state: State,
    *,
    tolerance_m: float = 0.0,
    angle_rad: float = 0.0,
    ground_m: float = -np.inf,
    hiding_m: FloatArray = NONE_HIDING,
) -> PointMemory:
    """Memory after a scan taken at `state`: forget what it passed through, remember its returns.

    hiding_m: [k, 3] more returns of it, which are not remembered and hide what is behind them.
    tolerance_m: uncertainty of the pose, added to the range by which beams must pass a point.
    angle_rad: how far the attitude may be off: returns stand for all places where they may be, and
    a point is passed only if it is whichever way the attitude is off.
    ground_m: returns at or below this height of the world frame are not remembered, nor are
    blind, too far and own-airframe ones. A voxel hit by this scan is never forgotten.
    """
    noise = tolerance_m + 3.0 * lidar.sigma_m
    if memory.lift_m > 0.0:
        state = replace(state, position_m=state.position_m + np.array([0.0, 0.0, memory.lift_m]))
    sensor = sensor_at(lidar, state, noise)
    raster = beam_raster(lidar.pattern)
    before = memory.seen_from or sensor
    reach, ground = float(memory.reach_m), float(ground_m) + memory.lift_m
    if angle_rad <= 0.0:
        limits = _limits(memory, scan.time_s, noise)
        rule, remembered = memory.rule, (memory.boxes, memory.balls)
        too_small, swept = sweep_returns(
            scan.points_m, hiding_m, *remembered, sensor, before, raster, rule, limits, ground
        )
        return _after(memory, swept, sensor, too_small)
    directions = directions_of(scan.points_m, raster)
    smallest = float(memory.smallest_m)
    seen = returns_with_size(scan.points_m, sensor, reach, ground, directions, smallest)
    radii = read_only(radii_unsure(seen.points_m, seen.radius_m, state, angle_rad))
    pitch, points = Pitch(memory.voxel_m, memory.fine_m), read_only(seen.points_m)
    boxes = boxes_of_returns(points, radii, seen.size_m, sensor.origin, pitch, float(scan.time_s))
    again = match_boxes_seen(memory.boxes, boxes, memory.voxel_m)
    nearest = nearest_with(directions.nearest_m, hiding_m, raster)
    doubt = [
        doubts(
            memory.boxes,
            again,
            nearest,
            sensor_at(lidar, turned, noise),
            before,
            raster,
            memory.rule,
        )
        for turned in turn_by_doubt(state, angle_rad)
    ]
    remembering = replace(memory, seen_from=sensor, too_small=seen.too_small)
    return remember(remembering, boxes, np.min(doubt, axis=0), sensor.origin, scan.time_s, noise)


def remember(
    memory: PointMemory,
    seen: Boxes,
    doubt: FloatArray,
    origin_m: FloatArray,
    time_s: float,
    noise_m: float = 0.0,
) -> PointMemory:
    """Memory after a sweep from a place [3] of the world at a time.

    seen: its returns. doubt: [n] of what is remembered, this sweep included; it is written into.
    noise_m: by which returns may be off.
    """
    limits = _limits(memory, time_s, noise_m)
    again = match_boxes_seen(memory.boxes, seen, memory.voxel_m)
    origin = read_only(origin_m)
    swept = remember_sweep(memory.boxes, memory.balls, doubt, seen, again, origin, limits)
    return _after(memory, swept, memory.seen_from, memory.too_small)


def _limits(memory: PointMemory, time_s: float, noise_m: float) -> Limits:
    return Limits(
        memory.voxel_m,
        memory.lift_m,
        memory.fine_m,
        memory.widest_m,
        memory.reach_m,
        memory.smallest_m,
        memory.capacity,
        1.0 if memory.widest_m == np.inf else LEAVES,
        float(OFF_LINE * memory.voxel_m + noise_m),
        float(time_s),
        float(time_s - memory.horizon_s),
    )


def _after(
    memory: PointMemory, swept: Swept, seen_from: Sensor | None, too_small: int
) -> PointMemory:
    room = swept.room
    return PointMemory(
        voxel_m=memory.voxel_m,
        horizon_s=memory.horizon_s,
        reach_m=memory.reach_m,
        capacity=memory.capacity,
        passes_to_clear=memory.passes_to_clear,
        smallest_m=memory.smallest_m,
        boxes=room.boxes,
        balls=swept.balls,
        widest_m=memory.widest_m,
        fine_m=room.fine_m,
        alone_a_sweep=_average(memory.alone_a_sweep, swept.alone),
        refuted_a_sweep=_average(memory.refuted_a_sweep, swept.refuted),
        borne_out_a_sweep=_average(memory.borne_out_a_sweep, swept.borne_out),
        seen_from=seen_from,
        dropped=room.dropped,
        merged=room.merged,
        too_small=too_small,
        sifted_from_s=memory.sifted_from_s,
    )


def forget_moved(
    memory: PointMemory,
    position_m: FloatArray,
    velocity_mps: FloatArray,
    time_s: float,
    reach_m: float,
    since_s: float,
) -> PointMemory:
    """Memory without the returns of a body in motion: those last seen where it was at that time.

    The body's centre [3] is at `position_m` at `time_s`, its surface within `reach_m` of it; only
    what was last seen at `since_s` or later can be its own.
    """
    before = memory.last_seen_s - time_s
    centers = position_m + before[:, None] * velocity_mps
    apart = np.linalg.norm(memory.position_m - centers, axis=1)
    keep = (apart > reach_m) | (memory.last_seen_s < since_s)
    if keep.all():
        return memory
    boxes = pick_boxes(memory.boxes, keep)
    return replace(memory, boxes=boxes, balls=balls_of(boxes, memory.lift_m))


def _average(before: float, now: int) -> float:
    return RATE_KEPT * before + (1.0 - RATE_KEPT) * now


@compiled
def _near(
    positions: Floats2, radii: Floats, center: Floats, reach: float
) -> tuple[Floats2, Floats]:
    kept, kept_radii = np.empty((len(positions), 3)), np.empty(len(positions))
    count = _keep_near(positions, radii, center, reach, kept, kept_radii)
    return kept[:count], kept_radii[:count]


@compiled
def _keep_near(
    positions: Floats2,
    radii: Floats,
    center: Floats,
    reach: float,
    kept: Floats2,
    kept_radii: Floats,
) -> int:
    """Fill in those within reach of a centre; how many there are."""
    cx, cy, cz = center[0], center[1], center[2]
    m = 0
    for n in range(len(positions)):
        x, y, z = positions[n, 0] - cx, positions[n, 1] - cy, positions[n, 2] - cz
        if x * x + y * y + z * z <= (reach + radii[n]) ** 2:
            kept[m, 0], kept[m, 1], kept[m, 2] = positions[n, 0], positions[n, 1], positions[n, 2]
            kept_radii[m] = radii[n]
            m += 1
    return m
