"""Who is overtaken does not circle into the way of what overtakes it, for want of a way out."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.decide import decide
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.base.state import State
from clearway.traffic import Intruder
from worlds_for_tests import AUTOMATON, LIBRARY

MARGIN_M, STEPS = 3.0, 20
PLANNERS = {
    escape: Planner.of(LIBRARY, AvoidanceSettings(safety_margin_m=MARGIN_M, escape=escape))
    for escape in ("known", "off")
}


def coming(seed: int) -> Intruder:
    """Faster than the vehicle, on a collision course."""
    rng = np.random.default_rng([seed, 851])
    bearing, meets_s = rng.uniform(-np.pi, np.pi), rng.uniform(2.0, 8.0)
    velocity = -rng.uniform(1.3, 3.0) * np.array([np.cos(bearing), np.sin(bearing), 0.0])
    meets_m = np.array([meets_s, 0.0, 0.0]) + rng.normal(0.0, 0.5, 3)
    return Intruder(meets_m - meets_s * velocity, velocity, radius_m=0.3)


def nearest_m(names: tuple[str, ...], intruder: Intruder) -> float:
    """Along movements from the start, at equal times, by this test's own geometry."""
    state, begins_s, least = np.zeros(6), 0.0, np.inf
    for name in names:
        movement = AUTOMATON[name]
        for share in np.arange(1, STEPS + 1) / STEPS:
            elapsed_s = float(share) * movement.duration_s
            at = AUTOMATON.predict(state, movement, elapsed_s)[:3]
            there = intruder.position_m + (begins_s + elapsed_s) * intruder.velocity_mps
            least = min(least, float(np.linalg.norm(at - there)))
        state, begins_s = AUTOMATON.predict(state, movement), begins_s + movement.duration_s
    return least - intruder.radius_m


def flown(decision: Decision) -> tuple[str, ...]:
    """What would be flown if nobody decided any more."""
    if decision.choice.basis is not Basis.WAY_OUT:
        return decision.movements
    assert decision.way_out is not None
    return (decision.movements[0], *decision.way_out.movements)


def test_a_way_out_that_is_caught_up_with_is_no_better_than_leaving() -> None:
    nothing_keeps = 0
    for seed in range(60):
        intruder = coming(seed)
        here, goal = State(np.zeros(3)), np.array([30.0, 0.0, 0.0])
        situation = Situation(here, goal, intruders=[intruder])
        taken = {escape: decide(planner, situation) for escape, planner in PLANNERS.items()}
        if taken["off"].choice.basis is not Basis.EMERGENCY:
            continue
        nothing_keeps += 1
        least = {escape: nearest_m(flown(one), intruder) for escape, one in taken.items()}
        assert least["known"] >= min(least["off"], MARGIN_M) - 0.05, f"seed {seed}: {least}"
    assert nothing_keeps > 10
