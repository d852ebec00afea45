"""On which side an intruder is passed: once chosen it is kept, while it keeps the margin.

What comes fast is met within one or two decisions' look ahead. A way that leaves the grid early
ends before the intruder is there, and so seems free; decided anew every second, such ways lead up,
down and up again, until none is left. So each is held against the intruder as if it were flown
straight on, for as long as the longest way lasts, and ways on another side than the one begun come
last. Obstacles that stand still are passed as they come: kept to a side, walls with gaps take half
as long again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from clearway.avoidance.hazards import MovingHazards
from clearway.avoidance.rules.rule import Rule, RuleNote, RuleView, Verdict
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


class Meeting(NamedTuple):
    """How the way to each node meets one intruder, flown straight on from its end; grid frame."""

    name: str
    aside_m: FloatArray
    """[nodes, 3] from the vehicle to the intruder when they are closest."""
    time_s: FloatArray
    """[nodes] when that is."""
    lack_m: FloatArray
    """[nodes] by how much the intruder, as it grows, comes nearer than 0 after the way's end and
    within the time of the longest; on the way itself verification looks."""
    radius_m: float
    growth_mps: float


def passings(
    reach_set: ReachSet, moving: MovingHazards, names: Sequence[str]
) -> tuple[Meeting, ...]:
    """How each of the moving, in the grid frame, is met."""
    horizon_s = float(reach_set.end_time_s.max())
    found = []
    for index, name in enumerate(names):
        radius, growth = float(moving.radius_m[index]), float(moving.growth_mps[index])
        met = _meeting(
            reach_set.parent,
            reach_set.samples_m,
            reach_set.end_time_s,
            moving.position_m[index],
            moving.velocity_mps[index],
            radius,
            growth,
            horizon_s,
        )
        found.append(Meeting(name, *met, radius, growth))
    return tuple(found)


def passing_rules(passings: Sequence[Passing], met: Sequence[Meeting]) -> tuple[Rule, ...]:
    """Pass intruders on the sides begun, and none by a way that only ends before it is met; within
    the side, as begun."""
    sides = {passing.name: passing.aside for passing in passings}

    def off_side(view: RuleView) -> Verdict | None:
        forbidden = _off(view, sides, met, 0.0)
        for one in met:
            forbidden |= one.lack_m > -view.margin_m
        return _verdict(forbidden)

    def unsteady(view: RuleView) -> Verdict | None:
        return _verdict(_off(view, sides, met, STEADY_COS))

    def _verdict(forbidden: BoolArray) -> Verdict | None:
        if not forbidden.any():
            return None
        kept = ", ".join(one.name for one in met if one.name in sides)
        return Verdict(f"{kept} as begun" if kept else "met beyond the way's end", forbidden)

    return (Rule(SIDE, off_side), Rule(STEADILY, unsteady))


def _off(
    view: RuleView, sides: Mapping[str, FloatArray], met: Sequence[Meeting], least_cos: float
) -> BoolArray:
    """[nodes] whether the way to a node passes someone too far from where it was begun."""
    off = np.zeros(view.reach_set.nodes, dtype=np.bool_)
    for one in met:
        if one.name in sides:
            apart = np.sqrt(np.einsum("ni,ni->n", one.aside_m, one.aside_m))
            off |= one.aside_m @ (sides[one.name] @ view.world_from_grid) < least_cos * apart
    return off


def noted(notes: Sequence[RuleNote]) -> tuple[RuleNote, ...]:
    """Notes of a mission's rules, and of these where they decided."""
    return tuple(note for note in notes if note.decided or note.name not in (SIDE, STEADILY))


def passings_after(
    before: Sequence[Passing],
    met: Sequence[Meeting],
    frame: GridFrame,
    node: int,
    margin_m: float,
) -> tuple[Passing, ...]:
    """Who is being passed on the way to a node, and on which side; the sides begun stay.

    An intruder is passed from when it comes near on the way chosen until it is behind.
    """
    sides = {passing.name: passing for passing in before}
    found = []
    for one in met:
        aside, time_s = frame.world_from_grid @ one.aside_m[node], float(one.time_s[node])
        apart = float(np.linalg.norm(aside))
        if time_s <= 0.0 or apart < LEAST_ASIDE_M:
            continue
        begun = sides.get(one.name)
        if begun is not None and float(aside @ begun.aside) >= 0.0:
            found.append(begun)
            continue
        near = one.radius_m + one.growth_mps * time_s
        if begun is not None or apart <= near + CONFLICT_MARGINS * margin_m:
            found.append(Passing(one.name, aside / apart))
    return tuple(found)


@compiled
def _meeting(
    parent: IndexArray,
    samples: FloatArray,
    end_time_s: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
    radius: float,
    growth: float,
    horizon_s: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    nodes, count = samples.shape[0], samples.shape[1]
    # On the way to the node itself, which its sequels begin with, and then with what follows it.
    on_way2, on_way_aside = np.empty(nodes), np.empty((nodes, 3))
    on_way_s = np.empty(nodes)
    aside_m, time_s, lack_m = np.empty((nodes, 3)), np.empty(nodes), np.empty(nodes)
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
            nearest2, nearest_s = on_way2[p], on_way_s[p]
            ax, ay, az = on_way_aside[p, 0], on_way_aside[p, 1], on_way_aside[p, 2]
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
        on_way2[n], on_way_s[n] = nearest2, nearest_s
        on_way_aside[n, 0], on_way_aside[n, 1], on_way_aside[n, 2] = ax, ay, az
        dx, dy, dz = px + began_s * vx - x, py + began_s * vy - y, pz + began_s * vz - z
        after_s = _closest_s(dx, dy, dz, cx, cy, cz, np.inf)
        tx, ty, tz = dx + after_s * cx, dy + after_s * cy, dz + after_s * cz
        if tx * tx + ty * ty + tz * tz < nearest2:
            nearest_s = began_s + after_s
            ax, ay, az = tx, ty, tz
        within_s = min(after_s, max(0.0, horizon_s - began_s))
        tx, ty, tz = dx + within_s * cx, dy + within_s * cy, dz + within_s * cz
        gap = np.sqrt(tx * tx + ty * ty + tz * tz)
        lack_m[n] = radius + growth * (began_s + within_s) - gap
        aside_m[n, 0], aside_m[n, 1], aside_m[n, 2], time_s[n] = ax, ay, az, nearest_s
    return aside_m, time_s, lack_m


@borrowing
def _closest_s(
    dx: float, dy: float, dz: float, cx: float, cy: float, cz: float, longest_s: float
) -> float:
    """When two that move straight on are closest: what lies between them, and how that changes."""
    speed2 = cx * cx + cy * cy + cz * cz
    if speed2 <= 0.0:
        return 0.0
    return min(longest_s, max(0.0, -(dx * cx + dy * cy + dz * cz) / speed2))
