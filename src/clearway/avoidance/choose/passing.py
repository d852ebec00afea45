"""On which side an intruder is passed: once chosen it is kept, while it keeps the margin.

What comes fast is met within one or two decisions' look ahead. A way that leaves the grid early
ends before the intruder is there, and so seems free; decided anew every second, such ways lead up,
down and up again, until none is left. So each is checked against the intruder as if it were flown
straight on, for as long as the longest way lasts, and ways on another side than the one begun come
last. Obstacles that stand still are passed as they come: kept to a side, walls with gaps take half
as long again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from clearway.avoidance.clear.closest import find_closest_ways, off_sides
from clearway.avoidance.clear.hazards import MovingHazards
from clearway.avoidance.clear.onward import nearer_onward
from clearway.avoidance.rules.rule import Rule, RuleNote, RuleView, Verdict
from clearway.base.arrays import Bools, Floats, Floats2, Floats3, Int32s
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.grid_frame import GridFrame
from clearway.base.rounding import SURELY
from clearway.base.state import BoolArray
from clearway.reach.tree import ReachSet

SIDE = "side of passing"
STEADILY = "steady passing"
LEAST_ASIDE_M = 1e-6
"""Ways that lead nearer than this to an intruder's place are on no side of it."""
STEADY_COS = 0.5
"""Of the angle by which the direction to an intruder passed may differ from where it was begun."""
CONFLICT_MARGINS = 3.0
"""Who comes within so many margins on the way chosen is being passed."""


@dataclass(frozen=True, slots=True, eq=False)
class Passing:
    """An intruder that is being passed."""

    name: str
    aside: FloatArray
    """[3] unit vector, world frame: from the vehicle to the intruder when they are closest, seen
    when the side was chosen."""


@dataclass(frozen=True, eq=False)
class Meetings:
    """How the ways to all nodes of a reach set meet the moving, each flown straight on from its
    end; grid frame. Worked out as far as it is asked for: most are never passed."""

    reach_set: ReachSet
    moving: MovingHazards
    names: tuple[str, ...]

    __repr__ = brief

    def lack(self, margin_m: float) -> BoolArray:
        """[nodes] whether any of them, as it grows, comes nearer than a margin after the way's end
        and within the time of the longest, at most; on the way itself verification looks."""
        ways, moving = self.reach_set, self.moving
        return nearer_onward(
            ways.parent,
            ways.samples_m,
            ways.end_time_s,
            moving.position_m,
            moving.velocity_mps,
            moving.radius_m,
            moving.growth_mps,
            float(ways.end_time_s.max()),
            float(margin_m),
        )

    def off_sides(
        self, indices: Sequence[int], sides: FloatArray, least_cos: Sequence[float]
    ) -> BoolArray:
        """[len(least_cos), nodes] whether the way to a node passes one of some too far from where
        it was begun: from [n, 3] directions, by each of the cosines."""
        ways, which = self.reach_set, list(indices)
        return off_sides(
            ways.parent,
            ways.samples_m,
            ways.end_time_s,
            self.moving.position_m[which],
            self.moving.velocity_mps[which],
            np.ascontiguousarray(sides, dtype=np.float64),
            np.array(least_cos),
        )

    def on_way(
        self, node: int, margin_m: float, begun: BoolArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray, BoolArray]:
        """Of each on the way to a node: [k, 3] from the vehicle to it when they are closest, [k]
        when that is (s), [k] how far (m), [k] whether that is near, by margins, and [k] whether it
        is being passed: ahead, and near or begun with [k]."""
        ways, moving = self.reach_set, self.moving
        return _on_way(
            ways.parent,
            ways.samples_m,
            ways.end_time_s,
            node,
            moving.position_m,
            moving.velocity_mps,
            moving.radius_m,
            moving.growth_mps,
            CONFLICT_MARGINS * margin_m,
            begun,
        )


def passing_rules(passings: Sequence[Passing], met: Meetings) -> tuple[Rule, ...]:
    """Pass intruders on the sides begun, and none by a way that only ends before it is met; within
    the side, as begun."""
    sides = {passing.name: passing.aside for passing in passings}
    kept = ", ".join(name for name in met.names if name in sides)

    passed = [index for index, name in enumerate(met.names) if name in sides]

    @cache
    def off(view: RuleView) -> BoolArray:
        """[2, nodes] whether the way to a node passes someone on another side than begun, and
        whether too far from where it was begun."""
        if not passed:
            return np.zeros((2, view.reach_set.nodes), dtype=np.bool_)
        begun = np.array([sides[met.names[index]] for index in passed])
        return met.off_sides(passed, begun @ view.world_from_grid, (0.0, STEADY_COS))

    def off_side(view: RuleView) -> Verdict | None:
        return _verdict(off(view)[0] | met.lack(view.margin_m))

    def unsteady(view: RuleView) -> Verdict | None:
        return _verdict(off(view)[1])

    def _verdict(forbidden: BoolArray) -> Verdict | None:
        if not forbidden.any():
            return None
        return Verdict(f"{kept} as begun" if kept else "met beyond the way's end", forbidden)

    return (Rule(SIDE, off_side), Rule(STEADILY, unsteady))


def note_passing(notes: Sequence[RuleNote]) -> tuple[RuleNote, ...]:
    """Notes of a mission's rules, and of these where they decided."""
    return tuple(note for note in notes if note.decided or note.name not in (SIDE, STEADILY))


def passings_after(
    before: Sequence[Passing], met: Meetings, frame: GridFrame, node: int, margin_m: float
) -> tuple[Passing, ...]:
    """Who is being passed on the way to a node, and on which side; the sides begun stay.

    An intruder is passed from when it comes near on the way chosen until it is behind.
    """
    if not met.names:
        return ()
    begun = {passing.name: passing for passing in before}
    known = [begun.get(name) for name in met.names]
    begun_with = np.array([passing is not None for passing in known])
    asides_m, _, apart_m, near, passed = met.on_way(node, margin_m, begun_with)
    which = np.flatnonzero(passed).tolist()
    if not which:
        return ()
    sides = asides_m @ frame.world_from_grid.T
    found = []
    for index in which:
        passing, side = known[index], sides[index]
        if passing is not None and side.dot(passing.aside) >= 0.0:
            found.append(passing)
        elif passing is not None or near[index]:
            found.append(Passing(met.names[index], side / apart_m[index]))
    return tuple(found)


@compiled
def _on_way(
    parent: Int32s,
    samples: Floats3,
    end_time_s: Floats,
    node: int,
    place: Floats2,
    velocity: Floats2,
    radius: Floats,
    growth: Floats,
    margin: float,
    begun: Bools,
) -> tuple[Floats2, Floats, Floats, Bools, Bools]:
    length, n = 0, node
    while n >= 0:
        length, n = length + 1, parent[n]
    before = np.arange(-1, length - 1).astype(parent.dtype)
    legs, ends_s = np.empty((length, samples.shape[1], 3)), np.empty(length)
    n = node
    for leg in range(length - 1, -1, -1):
        legs[leg], ends_s[leg], n = samples[n], end_time_s[n], parent[n]
    asides, when_s = find_closest_ways(before, legs, ends_s, place, velocity)
    aside, closest_s = asides[-1].copy(), when_s[-1].copy()
    apart = np.empty(len(place))
    is_near, passed = np.empty(len(place), np.bool_), np.empty(len(place), np.bool_)
    for k in range(len(place)):
        x, y, z = aside[k, 0], aside[k, 1], aside[k, 2]
        apart[k] = np.sqrt(x * x + y * y + z * z)
        near = radius[k] + growth[k] * closest_s[k] + margin
        is_near[k] = apart[k] <= near
        ahead = closest_s[k] > 0.0 and apart[k] >= LEAST_ASIDE_M
        passed[k] = ahead and (begun[k] or not apart[k] > SURELY * near)
    return aside, closest_s, apart, is_near, passed
