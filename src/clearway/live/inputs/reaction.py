"""What a vehicle has to know how far ahead: the distance to react, and to which thing."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.base.state import State

SMALLEST_M = 0.3
"""Thickness of the smallest object for what can stop, where none is declared: a branch, a post."""


def turning_distance_m(planner: Planner) -> float:
    """How far ahead something must be seen to be passed with the margin.

    One movement until the next decision, then a turn away: on a circle of the turning radius that
    begins at a distance d, the nearest to a point straight ahead is sqrt(d^2 + R^2) - R. Without
    a radius, of what can stop, that is d.
    """
    automaton, margin = planner.automaton, planner.settings.safety_margin_m
    radius = automaton.room_to_turn_m
    if not np.isfinite(radius):
        return planner.grid.range_m
    needed = automaton.step_m + float(np.sqrt(margin * (margin + 2.0 * radius)))
    return min(needed, planner.grid.range_m)


def smallest_object_m(planner: Planner) -> float:
    """Thickness of the smallest object that may not hide between beams; 0 where that is not asked:
    what cannot stop has to see too far."""
    declared_m = planner.settings.smallest_object_m
    if declared_m is None:
        return SMALLEST_M if planner.automaton.has_inertia else 0.0
    return declared_m


def bound_flown_m(planner: Planner, since: State | None, now: State) -> float:
    """How far the vehicle may fly between two scans as far apart as the latest; before a second one
    a movement."""
    if since is None:
        return planner.automaton.step_m
    return planner.speed_mps * (now.time_s - since.time_s)


def reaction_m(planner: Planner) -> float:
    """How far off something must be known at the latest: to turn away, or to brake to rest."""
    return planner.escape_reach_m if planner.automaton.has_inertia else turning_distance_m(planner)
