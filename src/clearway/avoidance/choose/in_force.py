"""Which rules are in force at a decision: the planner's own, those of passings that have begun, and
those of aircraft kilometres away."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.choose.candidates import Commitment
from clearway.avoidance.choose.passing import Meetings, passing_rules
from clearway.avoidance.long_range.two_horizons import LongRange, long_range
from clearway.avoidance.plan.evidence import InReach
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.avoidance.plan.situation import Situation
from clearway.avoidance.rate.goal import Goal
from clearway.avoidance.rules import RuleView, rule_on
from clearway.avoidance.rules.rule import Ruling


class InForce(NamedTuple):
    """What binds a choice beside the margin."""

    ruling: Ruling | None
    """None where there are no rules."""
    met: Meetings
    """When and where trajectories meet intruders."""
    afar: LongRange | None
    """What the next minute says of every trajectory; None where no volumes are kept."""


def in_force(
    planner: Planner,
    situation: Situation,
    prepared: PreparedReachSet,
    goal: Goal,
    near: InReach,
    before: Commitment,
) -> InForce:
    """The rules of one decision, checked against its trajectories."""
    names = near.intruders.names
    met = Meetings(prepared.reach_set, near.hazards.moving, names)
    afar = _afar(planner, situation, prepared, goal, before)
    rules = planner.rules if afar is None else (*planner.rules, *afar.rules(planner.grid.range_m))
    if names:
        rules = (*rules, *passing_rules(before.passings, met))
    ruling = None
    if rules:
        ruling = rule_on(rules, _view(planner, situation, prepared, goal, near))
    return InForce(ruling, met, afar)


def _afar(
    planner: Planner,
    situation: Situation,
    prepared: PreparedReachSet,
    goal: Goal,
    before: Commitment,
) -> LongRange | None:
    settings = planner.settings
    if settings.volumes is None:
        return None
    return long_range(
        settings.volumes,
        planner.performance,
        situation,
        prepared.reach_set,
        goal,
        before.long_range,
        heights_m=(settings.lowest_m, settings.highest_m),
    )


def _view(
    planner: Planner,
    situation: Situation,
    prepared: PreparedReachSet,
    goal: Goal,
    near: InReach,
) -> RuleView:
    """What the rules of a decision see."""
    start = situation.state.position_m if situation.from_m is None else situation.from_m
    route = [start, situation.target_m]
    if situation.next_m is not None:
        route.append(situation.next_m)
    return RuleView(
        prepared.reach_set,
        situation.state,
        goal,
        np.array(route),
        near.margin_m,
        planner.speed_mps,
        near.hazards.moving,
        near.intruders.names,
    )
