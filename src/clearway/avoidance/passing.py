"""On which side an intruder is passed: once chosen it is kept, while it keeps the margin.

What comes fast is met within one or two decisions' look ahead. A way that leaves the grid early
ends before the intruder is there, and so seems free; decided anew every second, such ways lead up,
down and up again, until none is left. So each is held against the intruder as if it were flown
straight on, for as long as the longest way lasts, and ways on another side than the one begun come
last. Obstacles that stand still are passed as they come: kept to a side, walls with gaps take half
as long again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from clearway.avoidance.clearance import SURELY
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
        return _off_sides(
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
        aside_m, time_s = _closest(
            np.arange(-1, len(path) - 1, dtype=ways.parent.dtype),
            ways.samples_m[path],
            ways.end_time_s[path],
            self.moving.position_m,
            self.moving.velocity_mps,
        )
        return aside_m[:, -1], time_s[:, -1]


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
    sides = {passing.name: passing for passing in before}
    found = []
    asides_m, times_s = met.at(node)
    near_m = met.moving.radius_m + met.moving.growth_mps * times_s + CONFLICT_MARGINS * margin_m
    far = np.sqrt(np.einsum("ki,ki->k", asides_m, asides_m)) > SURELY * near_m
    passed = (times_s > 0.0) & ~(far & ~np.array([name in sides for name in met.names]))
    for index in np.flatnonzero(passed).tolist():
        aside, name = frame.world_from_grid @ asides_m[index], met.names[index]
        apart = math.sqrt(float(aside @ aside))
        if apart < LEAST_ASIDE_M:
            continue
        begun = sides.get(name)
        if begun is not None and float(aside @ begun.aside) >= 0.0:
            found.append(begun)
        elif begun is not None or apart <= float(near_m[index]):
            found.append(Passing(name, aside / apart))
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
            within_s = min(_closest_s(dx, dy, dz, cx, cy, cz, np.inf), left_s)
            dx, dy, dz = dx + within_s * cx, dy + within_s * cy, dz + within_s * cz
            gap = np.sqrt(dx * dx + dy * dy + dz * dz)
            lack = radius[k] + growth[k] * (ended_s + within_s) - gap
            if lack > most[n]:
                most[n] = lack


@compiled
def _off_sides(
    parent: IndexArray,
    samples: FloatArray,
    end_time_s: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
    sides: FloatArray,
    least_cos: FloatArray,
) -> BoolArray:
    nodes, many = len(parent), len(place)
    off = np.zeros((len(least_cos), nodes), dtype=np.bool_)
    on_way, aside, time_s = np.empty((nodes, 5)), np.empty((nodes, 3)), np.empty(nodes)
    for k in range(many):
        _note_closest(parent, samples, end_time_s, place[k], velocity[k], on_way, aside, time_s)
        _note_off(aside, sides[k], least_cos, off)
    return off


@borrowing
def _note_off(aside: FloatArray, side: FloatArray, least_cos: FloatArray, off: BoolArray) -> None:
    for n in range(len(aside)):
        x, y, z = aside[n, 0], aside[n, 1], aside[n, 2]
        along, apart = x * side[0] + y * side[1] + z * side[2], np.sqrt(x * x + y * y + z * z)
        for c in range(len(least_cos)):
            if along < least_cos[c] * apart:
                off[c, n] = True


@compiled
def _closest(
    parent: IndexArray,
    samples: FloatArray,
    end_time_s: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    nodes, many = len(parent), len(place)
    # On the way to the node itself, which its sequels begin with, and then with what follows it.
    on_way, aside_m = np.empty((nodes, 5)), np.empty((many, nodes, 3))
    time_s = np.empty((many, nodes))
    for k in range(many):
        _note_closest(
            parent, samples, end_time_s, place[k], velocity[k], on_way, aside_m[k], time_s[k]
        )
    return aside_m, time_s


@borrowing
def _note_closest(
    parent: IndexArray,
    samples: FloatArray,
    end_time_s: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
    on_way: FloatArray,
    aside_m: FloatArray,
    time_s: FloatArray,
) -> None:
    """Fill in where and when one is closest. on_way: [nodes, 5] room for what sequels go on from:
    distance squared, time and what lies between."""
    nodes, count = samples.shape[0], samples.shape[1]
    px, py, pz = place[0], place[1], place[2]
    vx, vy, vz = velocity[0], velocity[1], velocity[2]
    for n in range(nodes):
        p, start_s = parent[n], 0.0
        x, y, z = 0.0, 0.0, 0.0
        nearest2, nearest_s = px * px + py * py + pz * pz, 0.0
        ax, ay, az = px, py, pz
        if p >= 0:
            start_s = end_time_s[p]
            x, y, z = samples[p, count - 1, 0], samples[p, count - 1, 1], samples[p, count - 1, 2]
            nearest2, nearest_s = on_way[p, 0], on_way[p, 1]
            ax, ay, az = on_way[p, 2], on_way[p, 3], on_way[p, 4]
        step_s = (end_time_s[n] - start_s) / count
        began_s = start_s
        cx, cy, cz = 0.0, 0.0, 0.0
        for q in range(count):
            cx = vx - (samples[n, q, 0] - x) / step_s
            cy = vy - (samples[n, q, 1] - y) / step_s
            cz = vz - (samples[n, q, 2] - z) / step_s
            dx, dy, dz = px + began_s * vx - x, py + began_s * vy - y, pz + began_s * vz - z
            after_s = _closest_s(dx, dy, dz, cx, cy, cz, step_s)
            dx, dy, dz = dx + after_s * cx, dy + after_s * cy, dz + after_s * cz
            gap2 = dx * dx + dy * dy + dz * dz
            if gap2 < nearest2:
                nearest2, nearest_s = gap2, began_s + after_s
                ax, ay, az = dx, dy, dz
            x, y, z = samples[n, q, 0], samples[n, q, 1], samples[n, q, 2]
            began_s = began_s + step_s
        on_way[n, 0], on_way[n, 1] = nearest2, nearest_s
        on_way[n, 2], on_way[n, 3], on_way[n, 4] = ax, ay, az
        dx, dy, dz = px + began_s * vx - x, py + began_s * vy - y, pz + began_s * vz - z
        after_s = _closest_s(dx, dy, dz, cx, cy, cz, np.inf)
        tx, ty, tz = dx + after_s * cx, dy + after_s * cy, dz + after_s * cz
        if tx * tx + ty * ty + tz * tz < nearest2:
            nearest_s = began_s + after_s
            ax, ay, az = tx, ty, tz
        aside_m[n, 0], aside_m[n, 1], aside_m[n, 2], time_s[n] = ax, ay, az, nearest_s


@borrowing
def _closest_s(
    dx: float, dy: float, dz: float, cx: float, cy: float, cz: float, longest_s: float
) -> float:
    """When two that move straight on are closest: what lies between them, and how that changes."""
    speed2 = cx * cx + cy * cy + cz * cz
    if speed2 <= 0.0:
        return 0.0
    return min(longest_s, max(0.0, -(dx * cx + dy * cy + dz * cz) / speed2))
