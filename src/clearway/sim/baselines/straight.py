"""Straight flight: the cheapest way to the waypoint, whatever stands in it."""

from __future__ import annotations

from clearway.avoidance.plan.situation import Situation
from clearway.sim.baselines.manoeuvre import Craft, Manoeuvre, ManoeuvreRule
from clearway.sim.baselines.routes import routes


def straight(craft: Craft) -> ManoeuvreRule:
    """The cheapest way by clearway's own costs, whatever stands in it."""

    def rule(situation: Situation, before: Manoeuvre | None) -> Manoeuvre:
        del before
        ways = routes(craft.planner, situation)
        return ways.fly_to(int(ways.nodes[0]), f"cheapest way, {ways.cost_m[0]:.1f} m; blind")

    return rule
