"""Whether a wish may pass: its leg keeps the margin, and leaves an escape behind it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.avoidance.clear.hazards import Cause
from clearway.avoidance.clear.verify import KEPT, path_clearance, sloping
from clearway.avoidance.escape.finder import WaysOut
from clearway.avoidance.plan.evidence import gather_in_reach
from clearway.avoidance.plan.held_escape import WayOut
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import CALM, Situation, margin_slope
from clearway.base.frames import FloatArray
from clearway.live.guard.held import Held
from clearway.live.guard.leg import PART_SAMPLES, Leg, LegPart
from clearway.reach.escapes.library import EscapeLibrary

FLOOR_M = 1e-6
"""By rounding."""
WHAT = {Cause.POINT: "a return", Cause.MAP: "the map", Cause.INTRUDER: "an intruder"}


@dataclass(frozen=True, slots=True, eq=False)
class Checked:
    """What was found out about a wish."""

    flaw: str
    """Why it may not pass; empty if it may."""
    margin_m: float
    """That is asked now."""
    way_out: WayOut | None = None
    """From the end of the leg on."""
    aloof: bool = False
    """Whether that keeps the whole margin from unobserved space as well."""


def in_calm(situation: Situation) -> Situation:
    """Without wind: commands are velocities over ground, and the vehicle corrects for it."""
    return replace(situation, wind_mps=CALM, wind_sigma_mps=0.0)


def check_leg(
    planner: Planner,
    escapes: EscapeLibrary,
    situation: Situation,
    leg: Leg,
    *,
    aloof: bool = True,
) -> Checked:
    """Hold a leg against all that is known.

    aloof: an escape that keeps the margin from unobserved space is looked for first.
    """
    slope = margin_slope(planner.settings, situation)
    paths = sloping(leg.paths(situation.frame), slope)
    reach_m = leg.length_m + planner.escape_reach_m
    near = gather_in_reach(planner, situation, reach_m, planner.horizon_s)
    margin = near.margin_m
    found = path_clearance(paths, len(leg.parts) - 1, near.hazards)
    if not found.distance_m >= KEPT * margin:
        what = WHAT[found.cause]
        return Checked(
            f"comes within {found.distance_m:.2f} m of {what}, {margin:.2f} m asked", margin
        )
    lowest = min(situation.floor_m, float(leg.start.position_m[2]))
    if leg.lowest_m < lowest - FLOOR_M:
        return Checked(f"leads below the floor of {situation.floor_m:.1f} m", margin)
    ways = WaysOut(planner, escapes, situation, near)
    for corners, sagitta_m in _ways(leg):
        if not ways.was_seen(corners, sagitta_m):
            return Checked("leads through unobserved space", margin)
    way, aloof = ways.after_flight(leg.end, leg.end_s, aloof=aloof)
    if way is None:
        return Checked("leaves no escape", margin)
    if not way.room_m >= KEPT * margin:
        return Checked("leaves no escape past an intruder", margin)
    return Checked("", margin, way, aloof)


def is_endangered(held: Held, planner: Planner, around: Situation, now_s: float) -> bool:
    """Whether anything is nearer than the margin to what is flown next of what is held."""
    until_s = max(held.renew_s, now_s + planner.automaton.movements[0].duration_s)
    times = now_s + (until_s - now_s) * np.arange(1, PART_SAMPLES + 1) / PART_SAMPLES
    states = [held.at(float(time_s)) for time_s in times]
    part = LegPart(
        until_s - now_s,
        np.array([state.position_m for state, _ in states]),
        np.array([velocity for _, velocity in states]),
        np.array([state.attitude_rad for state, _ in states]),
        0.0,
    )
    leg = Leg(around.state, states[0][1], (part,))
    paths = sloping(leg.paths(around.frame), margin_slope(planner.settings, around))
    near = gather_in_reach(planner, around, leg.length_m, planner.horizon_s)
    return path_clearance(paths, 0, near.hazards).distance_m < KEPT * near.margin_m


def _ways(leg: Leg) -> list[tuple[FloatArray, float]]:
    """The parts of a leg as corners of the world, and how far the way may lie off them."""
    ways, begins = [], leg.start.position_m
    for part in leg.parts:
        ways.append((np.concatenate([begins[None], part.places_m]), part.sagitta_m))
        begins = part.places_m[-1]
    return ways
