"""Lengths and times that suit a vehicle, wherever a mission, a plan or a scene leaves them out.

All of them are those of the paper's vehicle, which flies at 1 m/s and turns by 15 degrees a second,
as multiples of the movements and turning radii of another one. None is less than the paper's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.performance import WING

MOVEMENT_S = 1.0
RANGE_M = 10.0
MARGIN_M = 0.6
REACH_RADIUS_M = 1.5
"""Of the paper's vehicle."""
MOST_LATERAL_MPS2 = WING.turn_mps2
"""Acceleration across in a turn, of a bank of 30 degrees: a fast vehicle takes longer to turn."""
RANGE_MOVEMENTS = 10.0
RANGE_TURNS = 2.6
RANGE_STOPS = 2.0
"""The range in movements, in turning radii, and in stopping distances of what has inertia."""
MOST_MOVEMENTS = 100
"""Movements that may fit in a range: more make trees that nobody needs."""
MARGIN_MOVEMENTS = 0.4
"""The margin of what changes its course at once; a tube that grows with speed has its own."""
REACH_MOVEMENTS = 1.5
REACH_TURNS = 0.39
"""The reach radius in movements and in turning radii; inertia brakes for a waypoint instead."""
VOXEL_OF_MARGIN = 5.0 / 12.0
"""Width of a voxel of free space, as a share of the margin, where the range allows it."""
MEMORY_REACH = 1.5
MEMORY_VOXEL = 0.2
"""How far away returns are remembered, in ranges of the grid; their voxels, in margins."""
PER_M = 1000.0
"""Lengths are whole millimetres."""


@dataclass(frozen=True, slots=True)
class Scale:
    """What suits a vehicle.

    >>> import clearway as cw
    >>> from clearway.vehicle.scale import scale_of
    >>> scale = scale_of(cw.MovementAutomaton.plane(speed_mps=5.0))
    >>> scale.range_m, scale.margin_m, scale.reach_radius_m
    (50.0, 2.0, 7.5)
    """

    range_m: float
    """How far the grid reaches."""
    margin_m: float
    """From the vehicle's centre to any obstacle."""
    reach_radius_m: float
    """Within which a waypoint counts as reached."""
    why: str
    """What of the vehicle, and of its sensors, they follow from."""


def movement_s(speed_mps: float, turn_step_deg: float) -> float:
    """Return the duration of a movement that turns so far without too steep a bank."""
    banked_s = speed_mps * math.radians(turn_step_deg) / MOST_LATERAL_MPS2
    return max(MOVEMENT_S, math.ceil(100.0 * banked_s) / 100.0)


def scale_of(
    automaton: MovementAutomaton, sees_m: float | None = None, apart_m: float = math.inf
) -> Scale:
    """Return range, margin and reach radius for a vehicle.

    Parameters
    ----------
    sees_m
        Range of the sensor that sees farthest; None where it is not stated. No longer range is
        chosen, unless it takes more to turn or to stop.
    apart_m
        The least distance between neighbouring waypoints: no two are reached at once.
    """
    step_m, turn_m, reach_m = automaton.step_m, _turn_m(automaton), suit_reach_m(automaton)
    if automaton.has_inertia:
        stop_m = automaton.stopping_m
        margin_m, range_m = MARGIN_M, RANGE_STOPS * stop_m
        least_m, why = stop_m + margin_m, f"stops within {stop_m:.3g} m"
    else:
        margin_m = max(MARGIN_M, _up(MARGIN_MOVEMENTS * step_m))
        range_m = max(RANGE_MOVEMENTS * step_m, min(RANGE_TURNS * turn_m, MOST_MOVEMENTS * step_m))
        least_m, why = step_m + turn_m + margin_m, f"moves by {step_m:.3g} m"
    if turn_m:
        why += f" and turns within {turn_m:.3g} m"
    if sees_m is not None and sees_m < range_m:
        range_m, why = max(sees_m, least_m + 1.0 / PER_M), f"{why}, sensors that see {sees_m:.3g} m"
    if apart_m < reach_m:
        reach_m = math.floor(apart_m * PER_M) / PER_M  # No more: neighbours have to differ.
        why += f", waypoints {apart_m:.3g} m apart"
    return Scale(
        max(RANGE_M, _up(range_m)),
        margin_m,
        max(REACH_RADIUS_M, reach_m),
        f"{automaton.fastest_mps:g} m/s, {why}",
    )


def suit_reach_m(automaton: MovementAutomaton) -> float:
    """Return the reach radius for a vehicle, wherever its waypoints lie."""
    if automaton.has_inertia:
        return REACH_RADIUS_M
    wide_m = max(REACH_MOVEMENTS * automaton.step_m, REACH_TURNS * _turn_m(automaton))
    return max(REACH_RADIUS_M, _down(wide_m))


def voxel_m(margin_m: float, range_m: float) -> float:
    """Width of the voxels of free space: fine beside the margin, few along the range."""
    return float(np.clip(VOXEL_OF_MARGIN * margin_m, range_m / 60.0, range_m / 40.0))


def _turn_m(automaton: MovementAutomaton) -> float:
    """Room to turn; none where nothing turns, since no range would do."""
    turn_m = automaton.room_to_turn_m
    return turn_m if math.isfinite(turn_m) else 0.0


def _up(length_m: float) -> float:
    return math.ceil(length_m * PER_M - 1e-6) / PER_M


def _down(length_m: float) -> float:
    return math.floor(length_m * PER_M + 1e-6) / PER_M
