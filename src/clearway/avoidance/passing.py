"""On which side an intruder is passed: once chosen it is kept, while it keeps the margin.

What comes fast is met within one or two decisions' look ahead. A way that leaves the grid early
ends before the intruder is there, and so seems free; decided anew every second, such ways lead up,
down and up again, until none is left. So each is held against the intruder as if it were flown
straight on, for as long as the longest way lasts, and ways on another side than the one begun come
last. Obstacles that stand still are passed as they come: kept to a side, walls with gaps take half
as long again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from clearway.avoidance.clearance import SURELY
from clearway.avoidance.closest import closest, closest_s, off_sides
from clearway.avoidance.hazards import MovingHazards
from clearway.avoidance.rules.rule import Rule, RuleNote, RuleView, Verdict
from clearway.base.brief import brief
from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.grid_frame import GridFrame
from clearway.base.state import BoolArray, IndexArray
from clearway.reach.tree import ReachSet

SIDE, STEADILY = "side of passing", "steady passing"
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

    @cached_property
    def lack_m(self) -> FloatArray:
        """[nodes] by how much any of them, as it grows, comes nearer than 0 after the way's end and
        within the time of the longest, at most; on the way itself verification looks."""
        ways, moving = self.reach_set, self.moving
        return _most_lack(
            ways.parent,
            ways.samples_m,
            ways.end_time_s,
            moving.position_m,
            moving.velocity_mps,
            moving.radius_m,
            moving.growth_mps,
            float(ways.end_time_s.max()),
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

    def warm_up(self) -> None:
        """Compile and load what only those ask for who are passing someone."""
        self.off_sides(range(len(self.names)), np.zeros((len(self.names), 3)), (0.0, STEADY_COS))

    def at(self, node: int) -> tuple[FloatArray, FloatArray]:
        """[k, 3] from the vehicle to each when they are closest on the way to a node, and [k] when
        that is."""
        ways, path = self.reach_set, np.array(self.reach_set.path(node), dtype=np.int64)
        aside_m, time_s = closest(
            np.arange(-1, len(path) - 1, dtype=ways.parent.dtype),
            ways.samples_m[path],
            ways.end_time_s[path],
            self.moving.position_m,
            self.moving.velocity_mps,
        )
        return aside_m[-1], time_s[-1]


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
        return _verdict(off(view)[0] | (met.lack_m > -view.margin_m))

    def unsteady(view: RuleView) -> Verdict | None:
        return _verdict(off(view)[1])

    def _verdict(forbidden: BoolArray) -> Verdict | None:
        if not forbidden.any():
            return None
        return Verdict(f"{kept} as begun" if kept else "met beyond the way's end", forbidden)

    return (Rule(SIDE, off_side), Rule(STEADILY, unsteady))


def noted(notes: Sequence[RuleNote]) -> tuple[RuleNote, ...]:
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
    asides_m, times_s = met.at(node)
    near_m = met.moving.radius_m + met.moving.growth_mps * times_s + CONFLICT_MARGINS * margin_m
    apart_m = np.sqrt(np.square(asides_m).sum(axis=1))
    far = apart_m > SURELY * near_m
    known = [begun.get(name) for name in met.names]
    passed = (times_s > 0.0) & ~(far & np.array([passing is None for passing in known]))
    sides = asides_m @ frame.world_from_grid.T
    found = []
    for index in np.flatnonzero(passed & (apart_m >= LEAST_ASIDE_M)).tolist():
        passing, side = known[index], sides[index]
        if passing is not None and side.dot(passing.aside) >= 0.0:
            found.append(passing)
        elif passing is not None or apart_m[index] <= near_m[index]:
            found.append(Passing(met.names[index], side / apart_m[index]))
    return tuple(found)


@compiled
def _most_lack(
    parent: IndexArray,
    samples: FloatArray,
    end_time_s: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
    radius: FloatArray,
    growth: FloatArray,
    horizon_s: float,
) -> FloatArray:
    most = np.full(len(parent), -np.inf)
    _note_most_lack(parent, samples, end_time_s, place, velocity, radius, growth, horizon_s, most)
    return most


@borrowing
def _note_most_lack(
    parent: IndexArray,
    samples: FloatArray,
    end_time_s: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
    radius: FloatArray,
    growth: FloatArray,
    horizon_s: float,
    most: FloatArray,
) -> None:
    """Fill in the most that any lacks; flown straight on counts the last chord of a movement."""
    count = samples.shape[1]
    last = count - 1
    for n in range(len(parent)):
        p, ended_s = parent[n], 0.0
        x, y, z = 0.0, 0.0, 0.0
        if p >= 0:
            ended_s = end_time_s[p]
            x, y, z = samples[p, last, 0], samples[p, last, 1], samples[p, last, 2]
        if count > 1:
            x, y, z = samples[n, last - 1, 0], samples[n, last - 1, 1], samples[n, last - 1, 2]
        ex, ey, ez = samples[n, last, 0], samples[n, last, 1], samples[n, last, 2]
        step_s = (end_time_s[n] - ended_s) / count
        for _ in range(count):
            ended_s = ended_s + step_s
        ux, uy, uz = (ex - x) / step_s, (ey - y) / step_s, (ez - z) / step_s
        left_s = max(0.0, horizon_s - ended_s)
        for k in range(len(radius)):
            vx, vy, vz = velocity[k, 0], velocity[k, 1], velocity[k, 2]
            cx, cy, cz = vx - ux, vy - uy, vz - uz
            dx, dy = place[k, 0] + ended_s * vx - ex, place[k, 1] + ended_s * vy - ey
            dz = place[k, 2] + ended_s * vz - ez
            within_s = min(closest_s(dx, dy, dz, cx, cy, cz, np.inf), left_s)
            dx, dy, dz = dx + within_s * cx, dy + within_s * cy, dz + within_s * cz
            gap = np.sqrt(dx * dx + dy * dy + dz * dz)
            lack = radius[k] + growth[k] * (ended_s + within_s) - gap
            if lack > most[n]:
                most[n] = lack
