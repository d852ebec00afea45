"""What can be flown from an own state estimate, and what of the map comes within its reach.

All of it follows from planner, own state estimate, wind, floor and map: a decision that is past
works it out again instead of keeping it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.avoidance.clear.verify import sloping
from clearway.avoidance.escape.terms import limit_carried_m
from clearway.avoidance.plan.evidence import InReach, gather_in_reach
from clearway.avoidance.plan.floor import above_floor
from clearway.avoidance.plan.held_escape import Escape
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.prepared import PreparedReachSet, reach_of
from clearway.avoidance.plan.situation import Situation, margin_slope
from clearway.base.brief import brief
from clearway.obstacles.obstacle import Shapes


@dataclass(frozen=True, slots=True, eq=False)
class FromHere:
    """Where a decision was taken, and by whom; each question is worked out when asked."""

    planner: Planner
    situation: Situation
    """Without readings."""

    __repr__ = brief

    def prepare_reach_set(self) -> PreparedReachSet:
        """What could be flown."""
        return prepare_here(self.planner, self.situation)

    def shapes(self) -> Shapes:
        """Of the map, in the grid frame."""
        return near_from(self.planner, self.situation, self.prepare_reach_set()).hazards.shapes


def prepare_here(planner: Planner, situation: Situation) -> PreparedReachSet:
    """What can be flown, and how it is to be verified: in this wind, above this floor."""
    settings = planner.settings
    prepared = planner.prepare_at(situation.state)
    has_inertia = planner.automaton.has_inertia
    if planner.escapes is not None and settings.escape != Escape.KNOWN and not has_inertia:
        # It finds room where it is needed, and in all that can be flown.
        prepared = prepared.without_loiter
    if any(situation.wind_mps.tolist()):
        wind_in_grid = situation.frame.world_from_grid.T @ situation.wind_mps
        unsure_mps = settings.sigmas * situation.wind_sigma_mps
        prepared = prepared.in_wind(wind_in_grid, unsure_mps)
    prepared = with_slope(prepared, margin_slope(settings, situation))
    if situation.floor_m > -np.inf:
        above = above_floor(prepared, situation.frame, situation.floor_m)
        prepared = replace(prepared, flyable=prepared.flyable & above)
    return prepared


def with_slope(prepared: PreparedReachSet, slope: float) -> PreparedReachSet:
    """The reach set to be verified with a margin that grows with the distance from the vehicle."""
    if slope <= 0.0:
        return prepared
    paths = sloping(prepared.paths, slope)
    return replace(prepared, paths=paths, reach_m=reach_of(paths, prepared.reach_set.grid.range_m))


def near_from(planner: Planner, situation: Situation, prepared: PreparedReachSet) -> InReach:
    """What is around, as far as trajectories and escapes lead."""
    escapes_to_m = planner.escape_reach_m + limit_carried_m(planner, situation)
    reach_m = max(prepared.reach_m, escapes_to_m)
    return gather_in_reach(planner, situation, reach_m, planner.horizon_s)
