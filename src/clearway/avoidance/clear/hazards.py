"""What trajectories must keep clear of, in the grid frame: points, map shapes, moving."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.obstacles.obstacle import Shapes, shapes_of
from clearway.obstacles.rounded_box import local_point

BINS_ACROSS = 16
"""Bins along the longest side of the box that holds all points."""


class Cause(IntEnum):
    """What limits a clearance."""

    NOTHING = 0
    POINT = 1
    MAP = 2
    INTRUDER = 3


CAUSES = tuple(Cause)
"""By number: quicker than asking the enumeration."""


class PointHazards(NamedTuple):
    """Balls that stand for returns."""

    position_m: Floats2
    """[m, 3]"""
    radius_m: Floats
    """[m] half the beam spacing there, plus what thinning and noise add."""

    def __repr__(self) -> str:
        return brief(self)


class MovingHazards(NamedTuple):
    """Balls that move in a straight line and grow with time."""

    position_m: Floats2
    """[k, 3] at the start of the trajectories."""
    velocity_mps: Floats2
    """[k, 3]"""
    radius_m: Floats
    """[k] at the start."""
    growth_mps: Floats
    """[k] growth of the radius: spread and uncertainty."""
    manoeuvre_mps2: Floats
    """[k] acceleration that it may show any way, at no more than its speed: it then is somewhere in
    the common part of two balls, a t^2 / 2 about its straight way and v t about its place now."""
    share: Floats
    """[k] how much of that must be kept clear of, from 0 (the straight way alone) to 1."""

    def __repr__(self) -> str:
        return brief(self)


class PointBins(NamedTuple):
    """Points sorted into cubes, so that a movement looks at those near it only."""

    position_m: Floats2
    """[m, 3] bin after bin."""
    radius_m: Floats
    """[m]"""
    source: Ints
    """[m] index of the point before sorting."""
    start: Ints
    """[bins + 1] where a bin's points begin."""
    origin_m: Floats
    """[3] lowest corner."""
    counts: Ints
    """[3] bins along each axis."""
    width_m: float
    largest_m: float
    """Largest radius."""

    def __repr__(self) -> str:
        return brief(self)


def no_points() -> PointHazards:
    return PointHazards(np.zeros((0, 3)), np.zeros(0))


def no_shapes() -> Shapes:
    return shapes_of(())


def nothing_moving() -> MovingHazards:
    none, no_place = np.zeros(0), np.zeros((0, 3))
    return MovingHazards(no_place, no_place, none, none, none, none)


@dataclass(frozen=True, eq=False)
class Hazards:
    """All that a trajectory must keep its margin from, in the grid frame."""

    points: PointHazards = field(default_factory=no_points)
    shapes: Shapes = field(default_factory=no_shapes)
    moving: MovingHazards = field(default_factory=nothing_moving)
    left_out_m: float = np.inf
    """Distance from the vehicle to the nearest thing that is known, but out of reach and not among
    these; inf without any."""

    __repr__ = brief

    @cached_property
    def bins(self) -> PointBins:
        """The points, in cubes."""
        return bin_points(self.points.position_m, self.points.radius_m)

    def keeping_clear_of(self, share: float) -> Hazards:
        """The same with a share of what intruders may do."""
        moving = self.moving._replace(share=np.full(len(self.moving.radius_m), share))
        return replace(self, moving=moving)


@compiled
def grow_into_grid(
    position: Floats2,
    radius: Floats,
    by: float,
    origin: Floats,
    world_from_grid: Floats2,
) -> PointHazards:
    """Balls of the world, [n, 3] and [n], in the grid's frame and larger by a length."""
    place, grown = np.empty((len(radius), 3)), np.empty(len(radius))
    for n in range(len(radius)):
        x, y, z = position[n, 0], position[n, 1], position[n, 2]
        place[n, 0], place[n, 1], place[n, 2] = local_point(x, y, z, origin, world_from_grid)
        grown[n] = radius[n] + by
    return PointHazards(place, grown)


@compiled
def bin_points(position: Floats2, radius: Floats) -> PointBins:
    """Sort points [m, 3] with radii [m] into cubes."""
    count = len(radius)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    largest = _fill_bounds(position, radius, low, high)
    if count == 0:
        low[:], high[:] = 0.0, 0.0
    width = np.max(high - low) / BINS_ACROSS
    if not width > 0.0:
        width = 1.0
    counts = np.empty(3, dtype=np.int64)
    for axis in range(3):
        counts[axis] = int((high[axis] - low[axis]) / width) + 1
    own = np.empty(count, dtype=np.int64)
    start = np.zeros(counts[0] * counts[1] * counts[2] + 1, dtype=np.int64)
    _count_by_bin(position, low, counts, width, own, start)
    filled = start[:-1].copy()
    sorted_position, sorted_radius = np.empty((count, 3)), np.empty(count)
    source = np.empty(count, dtype=np.int64)
    _sort_by_bin(position, radius, own, filled, sorted_position, sorted_radius, source)
    return PointBins(sorted_position, sorted_radius, source, start, low, counts, width, largest)


@compiled
def _fill_bounds(position: Floats2, radius: Floats, low: Floats, high: Floats) -> float:
    """Fill in the lowest and highest corner of all; the largest radius."""
    largest = 0.0
    low_x, low_y, low_z = low[0], low[1], low[2]
    high_x, high_y, high_z = high[0], high[1], high[2]
    for n in range(len(radius)):
        x, y, z = position[n, 0], position[n, 1], position[n, 2]
        low_x, low_y, low_z = min(low_x, x), min(low_y, y), min(low_z, z)
        high_x, high_y, high_z = max(high_x, x), max(high_y, y), max(high_z, z)
        largest = max(largest, radius[n])
    low[0], low[1], low[2] = low_x, low_y, low_z
    high[0], high[1], high[2] = high_x, high_y, high_z
    return largest


@compiled
def _count_by_bin(
    position: Floats2,
    low: Floats,
    counts: Ints,
    width: float,
    own: Ints,
    start: Ints,
) -> None:
    """Fill in the bin of each point, and where each bin begins."""
    low_x, low_y, low_z = low[0], low[1], low[2]
    along_y, along_z = counts[1], counts[2]
    for n in range(len(own)):
        a = int((position[n, 0] - low_x) / width)
        b = int((position[n, 1] - low_y) / width)
        c = int((position[n, 2] - low_z) / width)
        own[n] = (a * along_y + b) * along_z + c
        start[own[n] + 1] += 1
    for b in range(len(start) - 1):
        start[b + 1] += start[b]


@compiled
def _sort_by_bin(
    position: Floats2,
    radius: Floats,
    own: Ints,
    filled: Ints,
    sorted_position: Floats2,
    sorted_radius: Floats,
    source: Ints,
) -> None:
    """Fill in the points bin by bin; filled: [bins] where each begins, written into."""
    for n in range(len(own)):
        at = filled[own[n]]
        filled[own[n]] += 1
        for axis in range(3):
            sorted_position[at, axis] = position[n, axis]
        sorted_radius[at] = radius[n]
        source[at] = n


@compiled
def bin_range(bins: PointBins, axis: int, middle: float, reach: float) -> tuple[int, int]:
    """First bin along an axis within `reach` of a coordinate, and the one after the last."""
    near = (middle - reach - bins.origin_m[axis]) / bins.width_m
    far = (middle + reach - bins.origin_m[axis]) / bins.width_m
    first = int(max(0.0, min(near, float(bins.counts[axis]))))
    last = int(max(-1.0, min(far, float(bins.counts[axis] - 1))))
    return first, last + 1


@compiled
def has_point_within(bins: PointBins, x: float, y: float, z: float, reach: float) -> bool:
    """Whether the ball of any point comes nearer to a place than a reach."""
    if len(bins.radius_m) == 0:
        return False
    around = reach + bins.largest_m
    first_a, last_a = bin_range(bins, 0, x, around)
    first_b, last_b = bin_range(bins, 1, y, around)
    first_c, last_c = bin_range(bins, 2, z, around)
    along_y, along_z = bins.counts[1], bins.counts[2]
    for a in range(first_a, last_a):
        for b in range(first_b, last_b):
            row = (a * along_y + b) * along_z
            for n in range(bins.start[row + first_c], bins.start[row + last_c]):
                dx, dy = bins.position_m[n, 0] - x, bins.position_m[n, 1] - y
                dz, within = bins.position_m[n, 2] - z, reach + bins.radius_m[n]
                if dx * dx + dy * dy + dz * dz < within * within and within > 0.0:
                    return True
    return False
