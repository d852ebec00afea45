"""Before take-off: goals that lie within the turning circle of a vehicle at the goal before.

What cannot hover flies away from such a goal and comes back to it. Where lines of a survey lie
nearer than two movements, or the reach radius is small, it may circle the goal for ever.
"""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.rounding import SURELY
from clearway.base.state import IntArray
from clearway.live.mission import Mission
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.scale import suit_reach_m

WIDE = 4.0 / 3.0
"""How far a goal within the turning circle has to lie from the one before, in suited reach radii:
two movements."""
MOST_NAMED = 6
"""Goals that a message names."""


def over_turns(mission: Mission, automaton: MovementAutomaton) -> str | None:
    """Return which goals may be circled, and the values that would do.

    None where there is none, and for what can stop: it turns on the spot.
    """
    radius_m = automaton.room_to_turn_m
    if radius_m == 0.0 or not np.isfinite(radius_m):
        return None
    suits_m, reach_m = suit_reach_m(automaton), mission.reach_radius_m
    inside, apart_m = goals_within_turns(mission, radius_m)
    surely_m = suits_m / SURELY
    risky = inside[(apart_m < WIDE * surely_m) | (reach_m < surely_m)]
    if not len(risky):
        return None
    nearest_m = float(apart_m.min())
    if nearest_m >= WIDE * surely_m:
        cure = f"mission.reach_radius_m = {suits_m:.3g} would do"
    else:
        share = min(nearest_m / WIDE, reach_m) / suits_m
        cure = (
            f"{_down(share * automaton.fastest_mps)} m/s would do, or goals {WIDE * suits_m:.3g} m "
            f"apart and mission.reach_radius_m = {suits_m:.3g}"
        )
    return (
        f"{_name_goals(risky)} within the turning circle of {radius_m:.3g} m radius at the goal "
        f"before, and may be circled until time is up; {cure}"
    )


def goals_within_turns(mission: Mission, radius_m: float) -> tuple[IntArray, FloatArray]:
    """Return the numbers, from 0, of goals that a turn at the goal before does not lead to.

    Returns
    -------
    numbers : [n]
    apart_m : [n]
        Level distance of each to the goal before.
    """
    counts_m = max(mission.reach_radius_m, mission.pass_within_m or 0.0)
    places = np.concatenate([mission.start.position_m[None], mission.goals_m])[:, :2]
    legs = np.diff(places, axis=0)
    yaw = float(mission.start.attitude_rad[2])
    courses = np.concatenate([[[np.cos(yaw), np.sin(yaw)]], legs[:-1]])
    long_m, apart_m = np.linalg.norm(courses, axis=1), np.linalg.norm(legs, axis=1)
    ahead = np.einsum("ij,ij->i", courses, legs)
    across = courses[:, 0] * legs[:, 1] - courses[:, 1] * legs[:, 0]
    course_m = np.maximum(long_m, 1e-9)
    to_middle_m = np.hypot(ahead / course_m, np.abs(across) / course_m - radius_m)
    inside = (to_middle_m <= radius_m * (1.0 + 1e-6) - counts_m) & (long_m > 1e-9)
    return np.flatnonzero(inside), apart_m[inside]


def _name_goals(goals: IntArray) -> str:
    """Goals by number, from 1, and how many more there are."""
    numbers = [str(number + 1) for number in goals[:MOST_NAMED].tolist()]
    more = f" and {len(goals) - MOST_NAMED} more" if len(goals) > MOST_NAMED else ""
    if len(goals) == 1:
        return f"goal {numbers[0]} lies"
    return f"goals {', '.join(numbers)}{more} lie"


def _down(speed_mps: float) -> str:
    """Two digits that are no more than there is."""
    unit = 10.0 ** (np.floor(np.log10(speed_mps)) - 1.0)
    return f"{np.floor(speed_mps / unit + 1e-9) * unit:.3g}"
