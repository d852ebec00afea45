"""Rules about traffic: how to keep separated, and who gives way to whom.

Right of way as in the rules of the air (ICAO Annex 2, 3.2.2): head on, both turn right; of two that
converge, the one that has the other on its right gives way and does not cross ahead of it; who
overtakes passes on the right.
"""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from clearway.avoidance.clear.crossing import crossings_ahead
from clearway.avoidance.clear.hazards import MovingHazards
from clearway.avoidance.rules.rule import Rule, RuleView, Verdict, worst_on_way
from clearway.base.arrays import Floats, Floats3, Int32s
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray, wrap_angle
from clearway.base.state import BoolArray
from clearway.reach.tree import ReachSet

HEAD_ON_RAD = np.radians(20.0)
"""Largest angle between a course and the reverse of the other's for a kind head on."""
OVERTAKING_RAD = np.radians(70.0)
"""An aircraft overtakes while it comes from within this angle of the other's tail."""
CONFLICT_MARGINS = 2.0
"""Straight flight that passes within so many margins of an intruder is in conflict with it."""
SAME_HEADING_RAD = 1e-6


class EncounterKind(StrEnum):
    """How two aircraft in conflict meet, seen from the own one."""

    HEAD_ON = "head on"
    OVERTAKING = "overtaking it"
    FROM_RIGHT = "converging from the right"
    FROM_LEFT = "converging from the left, it gives way"
    OVERTAKEN = "being overtaken, it gives way"


def horizontal_only(within_m: float = np.inf) -> Rule:
    """Keep separated from traffic by turning: no steeper climb or descent while it is near.

    within_m: how near traffic has to be; by default, wherever it is known.
    """

    def verdict(view: RuleView) -> Verdict | None:
        near = _near(view, within_m)
        steepness = np.abs(view.reach_set.states[:, 4])
        forbidden = _worsens(view.reach_set, steepness, abs(view.reach_set.start_pitch_rad))
        return Verdict(near, forbidden) if near else None

    return Rule("horizontal separation", verdict)


def vertical_only(within_m: float = np.inf) -> Rule:
    """Keep separated from traffic by height: no turn away from the way to go while it is near."""

    def verdict(view: RuleView) -> Verdict | None:
        near = _near(view, within_m)
        off = np.abs(wrap_angle(view.reach_set.states[:, 5] - view.bearing_rad))
        forbidden = _worsens(view.reach_set, off, abs(view.bearing_rad))
        return Verdict(near, forbidden) if near else None

    return Rule("vertical separation", verdict)


def right_of_way() -> Rule:
    """Give way as the rules of the air ask; what has to give way itself is avoided all the same."""

    def verdict(view: RuleView) -> Verdict | None:
        forbidden = np.zeros(view.reach_set.nodes, dtype=np.bool_)
        reasons = []
        for index, kind in encounter_kinds(view):
            name = (
                view.dynamic_object_names[index]
                if index < len(view.dynamic_object_names)
                else f"number {index}"
            )
            reasons.append(f"{name} {kind}")
            moving = _one(view.moving, index)
            if kind in (EncounterKind.HEAD_ON, EncounterKind.OVERTAKING):
                aside = find_passing_sides(view.reach_set, moving, _find_left(view))
                forbidden |= aside < -0.1 * view.margin_m
            elif kind is EncounterKind.FROM_RIGHT:
                forbidden |= crossings_ahead(view.reach_set, moving) > 0
        return Verdict("; ".join(reasons), forbidden) if reasons else None

    return Rule("right of way", verdict)


def encounter_kinds(view: RuleView) -> list[tuple[int, EncounterKind]]:
    """Intruders in conflict with straight flight to the waypoint, and how each is met."""
    moving, own = view.moving, view.speed_mps * view.course
    horizon_s = float(view.reach_set.end_time_s.max())
    found = []
    for index, place in enumerate(moving.position_m):
        closing = moving.velocity_mps[index] - own
        speed2 = float(closing @ closing)
        time_s = -float(place @ closing) / speed2 if speed2 > 0.0 else -1.0
        if not 0.0 < time_s <= horizon_s:
            continue
        miss = float(np.linalg.norm(place + time_s * closing))
        reach = moving.radius_m[index] + moving.growth_mps[index] * time_s
        if miss <= reach + CONFLICT_MARGINS * view.margin_m:
            kind = _encounter_kind(view, place, moving.velocity_mps[index])
            if kind is not None:
                found.append((index, kind))
    return found


def _encounter_kind(
    view: RuleView, place: FloatArray, velocity: FloatArray
) -> EncounterKind | None:
    """How an intruder is met; none for one that does not move along."""
    ahead, left, up = view.course, _find_left(view), _up(view)
    level = velocity - (velocity @ up) * up
    speed = float(np.linalg.norm(level))
    if speed < 1e-3 * view.speed_mps:
        return None
    along, across = float(level @ ahead) / speed, float(level @ left) / speed
    between = abs(np.arctan2(across, along))
    if between > np.pi - HEAD_ON_RAD and place @ ahead > 0.0:
        return EncounterKind.HEAD_ON
    apart = place - (place @ up) * up
    distance = float(np.linalg.norm(apart)) or 1.0  # Right above or below: neither side.
    from_tail = np.arccos(np.clip(apart @ level / (distance * speed), -1.0, 1.0))
    if from_tail < OVERTAKING_RAD and between < OVERTAKING_RAD:
        return EncounterKind.OVERTAKING
    to_tail = np.arccos(np.clip(-apart @ ahead / distance, -1.0, 1.0))
    if to_tail < OVERTAKING_RAD and between < OVERTAKING_RAD:
        return EncounterKind.OVERTAKEN
    return EncounterKind.FROM_RIGHT if place @ left < 0.0 else EncounterKind.FROM_LEFT


def find_passing_sides(reach_set: ReachSet, moving: MovingHazards, left: FloatArray) -> FloatArray:
    """[nodes] how far to the left one intruder is when the way to each node is closest to it.

    A way that ends before they meet is flown on straight. left: unit vector, grid frame.
    """
    return _find_passing_sides(
        reach_set.parent,
        reach_set.samples_m,
        reach_set.end_time_s,
        moving.position_m[0],
        moving.velocity_mps[0],
        left,
    )


@compiled
def _find_passing_sides(
    parent: Int32s,
    samples: Floats3,
    end_time_s: Floats,
    place: Floats,
    velocity: Floats,
    left: Floats,
) -> Floats:
    nodes, count = samples.shape[0], samples.shape[1]
    nearest2 = np.empty(nodes)
    aside = np.empty(nodes)
    result = np.empty(nodes)
    for n in range(nodes):
        p, start_s, previous = parent[n], 0.0, np.zeros(3)
        nearest2[n], aside[n] = np.sum(place * place), np.sum(place * left)
        if p >= 0:
            start_s, previous = end_time_s[p], samples[p, count - 1]
            nearest2[n], aside[n] = nearest2[p], aside[p]
        step_s = (end_time_s[n] - start_s) / count
        apart = place + start_s * velocity - previous
        for q in range(count + 1):
            # The last round is straight flight beyond the end, for ever.
            last = q == count
            own = (samples[n, min(q, count - 1)] - previous) / step_s
            if last:
                own = samples[n, count - 1] - (samples[n, count - 2] if count > 1 else np.zeros(3))
                own = own / step_s
            change = velocity - own
            speed2 = np.sum(change * change)
            time_s = -np.sum(apart * change) / speed2 if speed2 > 0.0 else 0.0
            time_s = max(0.0, time_s) if last else min(step_s, max(0.0, time_s))
            closest = apart + time_s * change
            gap2 = np.sum(closest * closest)
            if last:
                result[n] = np.sum(closest * left) if gap2 < nearest2[n] else aside[n]
            else:
                if gap2 < nearest2[n]:
                    nearest2[n], aside[n] = gap2, np.sum(closest * left)
                apart = apart + step_s * change
                previous = samples[n, q]
    return result


def _near(view: RuleView, within_m: float) -> str:
    """Which intruders are near, in words; nothing if none is."""
    distance = np.linalg.norm(view.moving.position_m, axis=1)
    near = np.flatnonzero(distance - view.moving.radius_m <= within_m)
    named = [view.dynamic_object_names[i] for i in near if i < len(view.dynamic_object_names)]
    if not len(near):
        return ""
    return f"{len(near)} intruders near" if len(near) > 3 else f"near: {', '.join(named)}"


def _worsens(reach_set: ReachSet, off: FloatArray, start: float) -> BoolArray:
    """[nodes] whether any movement on the way takes `off` [nodes] further from 0."""
    before = np.where(reach_set.parent >= 0, off[reach_set.parent], start)
    worse = (off > before + SAME_HEADING_RAD).astype(np.float64)
    return worst_on_way(reach_set.parent, worse) > 0.0


def _up(view: RuleView) -> FloatArray:
    pitch = view.reach_set.start_pitch_rad
    return np.array([-np.sin(pitch), 0.0, np.cos(pitch)])


def _find_left(view: RuleView) -> FloatArray:
    """[3] level unit vector to the left of the way to fly, grid frame."""
    return np.cross(_up(view), view.course)


def _one(moving: MovingHazards, index: int) -> MovingHazards:
    return MovingHazards(*(part[index : index + 1] for part in moving))
