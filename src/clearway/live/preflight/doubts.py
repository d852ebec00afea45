"""Before take-off: what a flight asks for and may not get, though nothing refuses it.

What is stated here was found by flying, not proved: it names the numbers, and changes no flight.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.avoidance.plan.held_escape import SEES
from clearway.avoidance.plan.planner import Planner
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.mission import Mission
from clearway.sensors import AnySensor, Lidar
from clearway.vehicle.automaton import MovementAutomaton

LEAST_REACH = 0.5
"""Movements within which waypoints are hit as a rule. They count as reached wherever the vehicle is
within the radius, in the middle of a movement too, so what matters is how close the ways lie that
it can fly."""
LEAST_REACH_TURNING = 0.125
"""Turning radii within which waypoints are hit as a rule."""
WIDEST_MARGIN = 1.2
"""Movements, or quarters of the turning radius where that is longer, beyond which margins may be
lost; see docs/limits.md."""
LEVEL_SHARE = 0.9
"""Height off a goal, in reach radii, beyond which flying level may miss it: little of the radius is
left for how close the ways lie."""
FLY_LEVEL = "vehicle.pitch_limit_deg = 0 flies at one height, and to above or below its goals"
MOST_LOST = 0.9
"""Share of returns beyond which what is left may not show an obstacle in time; docs/faults.md has
the flights."""


def over_reach(mission: Mission, automaton: MovementAutomaton) -> str | None:
    """Why waypoints may never be reached; None where movements lead near enough, and for a vehicle
    with inertia: it comes slowly where it has to."""
    if automaton.has_inertia:
        return None
    radius_m, step_m = automaton.turning_radius_m, automaton.step_m
    least_m, of = LEAST_REACH * step_m, f"half a movement of {step_m:.3g} m"
    if np.isfinite(radius_m) and LEAST_REACH_TURNING * radius_m > least_m:
        least_m = LEAST_REACH_TURNING * radius_m
        of = f"an eighth of the turning radius of {radius_m:.3g} m"
    if mission.reach_radius_m >= least_m:
        return None
    return (
        f"mission.reach_radius_m: {mission.reach_radius_m:.3g} m is less than {of}; waypoints may "
        f"be missed, and circled for ever; {least_m:.3g} m or more would do as a rule"
    )


def over_level(
    mission: Mission, automaton: MovementAutomaton, sensors: Sequence[AnySensor]
) -> str | None:
    """Why goals at other heights may not be reached where sensors show one level plane; None where
    they show more, or the vehicle goes by level distance, or climbs without pitching."""
    if not is_kept_level(automaton, sensors):
        return None
    heights_m = np.append(mission.goals_m[:, 2], mission.start.position_m[2])
    if np.ptp(heights_m) <= mission.reach_radius_m:
        return None
    return (
        f"sensors show one level plane, and goals lie {np.ptp(heights_m):.3g} m higher or lower "
        f"than others: ways up and down count as blocked, so they may never be reached; {FLY_LEVEL}"
    )


def over_own_level(
    goals_m: FloatArray, own_height_m: float, reach_radius_m: float, first: int = 1
) -> str | None:
    """Why a vehicle that one level plane keeps at its height does not reach goals [n, 3], the first
    of which has a number; None where it does."""
    apart_m = goals_m[:, 2] - own_height_m
    beyond = np.flatnonzero(np.abs(apart_m) > LEVEL_SHARE * reach_radius_m)
    if not len(beyond):
        return None
    at = int(beyond[0])
    side = "above" if apart_m[at] > 0.0 else "below"
    return (
        f"goal {first + at} at {goals_m[at, 2]:.1f} m is {abs(apart_m[at]):.1f} m {side} the "
        f"vehicle, and sensors show one level plane: ways up and down count as blocked; {FLY_LEVEL}"
    )


def is_kept_level(automaton: MovementAutomaton, sensors: Sequence[AnySensor]) -> bool:
    """Whether a vehicle that climbs by pitching finds no way up or down by what its sensors show;
    one with inertia climbs on the spot."""
    return not (automaton.stays_level or automaton.has_inertia) and are_level(sensors)


def are_level(sensors: Sequence[AnySensor]) -> bool:
    """Whether there are sensors, and each shows one level plane alone."""
    lidars = [one for one in sensors if isinstance(one, Lidar)]
    level = all(not one.pattern.elevation_rad.any() for one in lidars)
    return bool(lidars) and len(lidars) == len(sensors) and level


def over_span(mission: Mission, planner: Planner) -> str | None:
    """Which goals lie where obstacles are not declared to be columns; None where none does."""
    span_m, body_m = planner.settings.obstacles_span_m, planner.settings.body_radius_m
    if span_m is None:
        return None
    heights_m = mission.goals_m[:, 2]
    outside = (heights_m < span_m[0] + body_m) | (heights_m > span_m[1] - body_m)
    if not outside.any():
        return None
    number = int(np.argmax(outside))
    return (
        f"safety.obstacles_span_m: goal {number + 1} at {heights_m[number]:g} m is not between "
        f"{span_m[0]:g} and {span_m[1]:g} m with the body of {body_m:g} m; a sensor of one level "
        "plane does not show what is free there, so the goal may never be reached"
    )


def over_wide_margin(planner: Planner, flown: str) -> str:
    """What a margin that is wide for the vehicle's turns may lose; empty where nothing is known.

    flown: which escapes. They keep no more than the body's radius from unobserved space.
    """
    automaton, margin_m = planner.automaton, planner.settings.safety_margin_m
    if flown not in SEES or margin_m <= planner.settings.body_radius_m:
        return ""
    if automaton.has_inertia:  # It brakes before what shows late.
        return ""
    quarter_m, step_m = 0.25 * automaton.turning_radius_m, automaton.step_m
    turns = np.isfinite(quarter_m) and quarter_m > step_m
    unit_m, unit = (quarter_m, "a quarter turning radius") if turns else (step_m, "a movement")
    if margin_m <= WIDEST_MARGIN * unit_m:
        return ""
    return (
        f"; a margin of {margin_m:.3g} m, over {WIDEST_MARGIN:g} times {unit} of {unit_m:.3g} m, "
        "may be lost to what shows late"
    )


def over_drop_outs(sensors: Sequence[AnySensor], flown: str) -> str:
    """What returns that are lost may cost who counts as free what came back with nothing; empty
    where there are few.

    flown: which escapes.
    """
    lost = max((one.dropout for one in sensors if isinstance(one, Lidar)), default=0.0)
    if flown not in SEES or lost <= MOST_LOST:
        return ""
    return f"; {100.0 * lost:.3g} % of returns are lost: what whole sweeps miss passes for free"


def over_false_returns(sensors: Sequence[AnySensor]) -> str:
    """What is done about returns that are declared to be false; empty where there are none."""
    share = max((one.false_returns for one in sensors if isinstance(one, Lidar)), default=0.0)
    if share == 0.0:
        return ""
    return (
        f"; {100.0 * share:.3g} % of the beams return falsely: a return that stands alone counts "
        "once a second scan bears it out"
    )


def over_unsure(planner: Planner, start: State) -> str:
    """What own state estimates that are off cost who cannot stop; who can, holds meanwhile.

    It is reported, not tried: what the noise of a flight costs depends on what stands about.
    """
    if planner.automaton.can_stop or not (start.position_std_m or start.attitude_std_rad):
        return ""
    off = [f"{start.position_std_m:.3g} m"] if start.position_std_m else []
    off += [f"{np.degrees(start.attitude_std_rad):.3g} deg"] if start.attitude_std_rad else []
    return f"; state estimates are off by {' and '.join(off)}, so some decisions may find none"
