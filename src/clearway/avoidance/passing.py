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
from functools import cache

import numpy as np

from clearway.avoidance.closest import closest, closest_s, off_sides
from clearway.avoidance.hazards import MovingHazards
from clearway.avoidance.rules.rule import Rule, RuleNote, RuleView, Verdict
from clearway.base.brief import brief
from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.grid_frame import GridFrame
from clearway.base.rounding import SURELY
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

    def lack(self, margin_m: float) -> BoolArray:
        """[nodes] whether any of them, as it grows, comes nearer than a margin after the way's end
        and within the time of the longest, at most; on the way itself verification looks."""
        ways, moving = self.reach_set, self.moving
        return _lack(
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
        return _verdict(off(view)[0] | met.lack(view.margin_m))

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
def _lack(
    parent: IndexArray,
    samples: FloatArray,
    end_time_s: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
    radius: FloatArray,
    growth: FloatArray,
    horizon_s: float,
    margin: float,
) -> BoolArray:
    lack = np.zeros(len(parent), dtype=np.bool_)
    onward = np.empty((len(parent), 7))
    farthest = _note_onward(parent, samples, end_time_s, horizon_s, onward)
    for k in range(len(radius)):
        grown = margin + radius[k] + max(growth[k], 0.0) * horizon_s
        if not _is_far(place[k], velocity[k], SURELY * (farthest + grown), horizon_s):
            _note_lack(onward, place[k], velocity[k], radius[k], growth[k], margin, horizon_s, lack)
    return lack


@borrowing
def _note_onward(
    parent: IndexArray,
    samples: FloatArray,
    end_time_s: FloatArray,
    horizon_s: float,
    onward: FloatArray,
) -> float:
    """Fill in where each way ends and how fast it goes on, along its last chord, and from when;
    how far from the start any of them comes until a time."""
    last = samples.shape[1] - 1
    farthest = 0.0
    for n in range(len(parent)):
        p, ended_s = parent[n], 0.0
        x, y, z = 0.0, 0.0, 0.0
        if p >= 0:
            ended_s = end_time_s[p]
            x, y, z = samples[p, last, 0], samples[p, last, 1], samples[p, last, 2]
        if last > 0:
            x, y, z = samples[n, last - 1, 0], samples[n, last - 1, 1], samples[n, last - 1, 2]
        ex, ey, ez = samples[n, last, 0], samples[n, last, 1], samples[n, last, 2]
        step_s = (end_time_s[n] - ended_s) / (last + 1)
        for _ in range(last + 1):
            ended_s = ended_s + step_s
        ux, uy, uz = (ex - x) / step_s, (ey - y) / step_s, (ez - z) / step_s
        onward[n, 0], onward[n, 1], onward[n, 2] = ex, ey, ez
        onward[n, 3], onward[n, 4], onward[n, 5] = ux, uy, uz
        onward[n, 6] = ended_s
        way = np.sqrt(ex * ex + ey * ey + ez * ez)
        way += np.sqrt(ux * ux + uy * uy + uz * uz) * max(0.0, horizon_s - ended_s)
        farthest = max(farthest, way)
    return farthest


@borrowing
def _is_far(place: FloatArray, velocity: FloatArray, reach: float, horizon_s: float) -> bool:
    """Whether one stays farther from the start than a reach until a time."""
    px, py, pz = place[0], place[1], place[2]
    vx, vy, vz = velocity[0], velocity[1], velocity[2]
    at_s = closest_s(px, py, pz, vx, vy, vz, horizon_s)
    x, y, z = px + at_s * vx, py + at_s * vy, pz + at_s * vz
    return bool(reach >= 0.0 and x * x + y * y + z * z > reach * reach)


@borrowing
def _note_lack(
    onward: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
    radius: float,
    growth: float,
    margin: float,
    horizon_s: float,
    lack: BoolArray,
) -> None:
    """Fill in where one comes nearer than a margin."""
    vx, vy, vz = velocity[0], velocity[1], velocity[2]
    px, py, pz = place[0], place[1], place[2]
    for n in range(len(onward)):
        if lack[n]:
            continue
        ended_s = onward[n, 6]
        cx, cy, cz = vx - onward[n, 3], vy - onward[n, 4], vz - onward[n, 5]
        dx, dy = px + ended_s * vx - onward[n, 0], py + ended_s * vy - onward[n, 1]
        dz = pz + ended_s * vz - onward[n, 2]
        left_s = max(0.0, horizon_s - ended_s)
        within_s = min(closest_s(dx, dy, dz, cx, cy, cz, np.inf), left_s)
        dx, dy, dz = dx + within_s * cx, dy + within_s * cy, dz + within_s * cz
        gap = np.sqrt(dx * dx + dy * dy + dz * dz)
        lack[n] = radius + growth * (ended_s + within_s) - gap > -margin
