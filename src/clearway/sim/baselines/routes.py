"""The reach set's complete trajectories by cost, as if nothing stood in their way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.avoidance.choose.candidates import Commitment, price_candidates
from clearway.avoidance.clear.hazards import Hazards
from clearway.avoidance.plan.evidence import NOBODY_NEAR, InReach
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.plan.rated import Rated
from clearway.avoidance.plan.situation import Situation, goal_of, margin_m
from clearway.avoidance.rate.fusion import Evidence, assess_cells
from clearway.avoidance.rate.goal import Goal
from clearway.avoidance.rate.reach_rating import rate_reach_set
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.live.mission import Mode
from clearway.sim.baselines.manoeuvre import Manoeuvre


@dataclass(frozen=True, slots=True, eq=False)
class Routes:
    """Complete trajectories, cheapest first, by clearway's own costs."""

    prepared: PreparedReachSet
    goal: Goal
    nodes: IntArray
    """[routes] nodes that end them."""
    cost_m: FloatArray
    """[routes] ascending."""

    def fly_to(self, node: int, reason: str, mode: Mode = Mode.NAVIGATION) -> Manoeuvre:
        """The manoeuvre that flies to a node."""
        return Manoeuvre(self.prepared.reach_set.movements_to(node), reason, mode)


def routes(
    planner: Planner, situation: Situation, prepared: PreparedReachSet | None = None
) -> Routes:
    """Compute costs of the planner's trajectories at this pitch, or of a given reach set."""
    prepared = prepared or planner.prepare_at(situation.state)
    reach_set = prepared.reach_set
    goal = goal_of(situation, stays_level=planner.automaton.stays_level)
    free = assess_cells(Evidence.free(reach_set.grid))
    nothing = InReach(
        situation.frame, margin_m(planner.settings, situation), Hazards(), NOBODY_NEAR
    )
    rated = Rated(prepared, nothing, free, rate_reach_set(reach_set, free.rating))
    candidates = price_candidates(planner, rated, goal, Commitment())
    order = np.argsort(candidates.cost_m, kind="stable")
    return Routes(prepared, goal, candidates.nodes[order], candidates.cost_m[order])
