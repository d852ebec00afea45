"""Who has no way to the goal stays where it is safe, tries again for a while, and stays longer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.avoidance.choose.candidates import Commitment
from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.live import AvoidanceSystem
from clearway.live.mission import Progress
from clearway.live.recovery.dead_end import GIVEN_UP, STAYS, TRIES, _note_whether_closed
from clearway.live.routing.seen_planner import SeenRoute
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim import SimulationSettings, simulate
from worlds_for_tests import LIBRARY, LIDAR, mission

TURN_S, TURN_M = 24.0, 12.0
STEP_S = 0.25 * TURN_S
HERE = np.zeros((1, 3))


def route(in_vain_turns: float, *, reaches: bool = True) -> SeenRoute:
    return SeenRoute(HERE, reaches, HERE, 50.0, in_vain_turns * TURN_M)


def closed_for(found: SeenRoute, turns: float) -> list[tuple[bool, float]]:
    """Whether it is closed and for how many turns in a row, one after the other."""
    progress, spans = Progress(closed_s=0.0), list[list[float]]()
    for n in range(int(turns * TURN_S / STEP_S)):
        progress = _note_whether_closed(progress, found, n * STEP_S, TURN_S, TURN_M)
        if not spans or bool(spans[-1][0]) is not progress.closed:
            spans.append([progress.closed, 0.0])
        spans[-1][1] += STEP_S / TURN_S
    return [(bool(closed), length) for closed, length in spans]


def test_tries_stay_as_long_while_staying_doubles() -> None:
    spans = closed_for(route(GIVEN_UP + 1.0), 60.0)
    stays = [length for closed, length in spans if closed][:3]
    tries = [length for closed, length in spans if not closed][:2]
    assert stays == pytest.approx([STAYS, 2.0 * STAYS, 4.0 * STAYS], abs=0.5)
    assert tries == pytest.approx([TRIES, TRIES], abs=0.5)


def test_where_nothing_leads_on_at_all_nothing_is_tried() -> None:
    assert closed_for(route(0.0, reaches=False), 60.0) == [(True, 60.0)]


def test_a_way_that_was_never_tried_is_taken_at_once() -> None:
    held = Progress(closed=True, closed_s=0.0, tried=2)
    assert not _note_whether_closed(held, route(0.0), STEP_S, TURN_S, TURN_M).closed
    assert _note_whether_closed(held, route(1.0), STEP_S, TURN_S, TURN_M) == held
    fresh = replace(held, closed=False, tried=0)
    assert not _note_whether_closed(fresh, route(GIVEN_UP - 0.1), STEP_S, TURN_S, TURN_M).closed


def test_the_way_out_in_hand_is_flown_on_and_on_while_it_keeps_the_margin() -> None:
    planner = Planner.of(LIBRARY, AvoidanceSettings(safety_margin_m=0.6))
    system = AvoidanceSystem(planner, mission((45.0, 4.0, 0.0)), lidars=(LIDAR,))
    run = simulate(
        system, ObstacleMap([]), lidars=(LIDAR,), settings=SimulationSettings(time_limit_s=6.0)
    )
    situation, _ = system.situation(6.0)
    way = run.decisions[-1].flight.decision.way_out
    assert way is not None
    goes = decide(planner, situation, commitment=Commitment(way_out=way))
    stays = decide(planner, situation, commitment=Commitment(way_out=way, stays=True))
    assert goes.choice.basis is Basis.RATED
    assert stays.choice.basis is Basis.WAY_OUT
    assert stays.movements == way.movements[:1]
    assert stays.way_out is not None
    assert stays.way_out.margin_m == pytest.approx(stays.margin_m)
