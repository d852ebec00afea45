"""Planners that keep a wide margin from all they know: (6.14) and (6.15).

They hold the trajectories of clearway's own reach set against the same points, map and intruders,
and fly the cheapest that keeps the margin; where none does they turn away. Only the margin tells
them from each other: there are no ratings of cells, no visibility and no stepping down.
"""

from __future__ import annotations

import numpy as np

from clearway.avoidance.clear.verify import clearances
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Situation
from clearway.live.mission import Mode
from clearway.sim.baselines.known import hazards_around
from clearway.sim.baselines.manoeuvre import Craft, Manoeuvre, ManoeuvreRule
from clearway.sim.baselines.routes import routes

NEAR_SHARE = 0.999
"""Of the distance that the vehicle has now, where that is less than the margin."""


def turn_back(craft: Craft) -> ManoeuvreRule:
    """The conservative margin (6.14), read as 4.6 m; turns back where nothing keeps it."""
    return _keep_away(
        craft.planner, 2.0 * craft.conservative_turning_radius_m + 2.0 * craft.body_radius_m
    )


def adaptive(craft: Craft) -> ManoeuvreRule:
    """The adaptive margin (6.15): six vehicle radii."""
    return _keep_away(craft.planner, 6.0 * craft.body_radius_m)


def _keep_away(planner: Planner, margin_m: float) -> ManoeuvreRule:
    def rule(situation: Situation, before: Manoeuvre | None) -> Manoeuvre:
        del before
        ways = routes(planner, situation)
        hazards = hazards_around(planner, situation)
        measured = clearances(ways.prepared.paths, hazards, margin_m)[ways.nodes]
        # Who is too near already may go on, but no nearer.
        start = clearances(ways.prepared.paths, hazards, margin_m)[
            np.flatnonzero(ways.prepared.reach_set.parent < 0), 0
        ].max()
        kept = measured[:, 0] >= min(margin_m, NEAR_SHARE * start) - 1e-9
        if kept.any():
            best = int(np.argmax(kept))
            mode = Mode.AVOIDANCE if best else Mode.NAVIGATION
            reason = f"keeps {margin_m:.2f} m; {best} cheaper ways do not"
            return ways.fly_to(int(ways.nodes[best]), reason, mode)
        coarse = np.round(measured[:, 0] / (0.01 * margin_m))
        best = int(np.lexsort((ways.cost_m, measured[:, 1], -coarse))[0])
        reason = f"nothing keeps {margin_m:.2f} m: turns away, {measured[best, 0]:.2f} m"
        return ways.fly_to(int(ways.nodes[best]), reason, Mode.EMERGENCY)

    return rule
