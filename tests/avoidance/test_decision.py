"""Decisions: candidates, tiers, the emergency rule, commitment, explanation."""

from dataclasses import replace

import numpy as np
import pytest

from clearway.avoidance.choose.candidates import Commitment, Side
from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.clear.hazards import Cause
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.situation import Situation, margin_m
from clearway.base.errors import ClearwayError
from clearway.base.state import State
from clearway.live.mission import Mode
from clearway.live.outputs.explain import explanation
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.traffic import Intruder
from worlds_for_tests import planner

HERE = State(np.zeros(3))
AHEAD = np.array([30.0, 0.0, 0.0])
PLANNER = planner(escape="off")


def situation(*obstacles, target=AHEAD, state=HERE, **more):
    return Situation(state, np.asarray(target, float), obstacle_map=ObstacleMap(obstacles), **more)


def test_free_space_is_flown_straight_and_the_next_decision_can_wait():
    decision = decide(PLANNER, situation())
    assert set(decision.movements) == {"Straight"}
    assert decision.choice.clearance_m == np.inf
    assert decision.choice.limited_by is Cause.NOTHING
    # Range less turning radius and margin, at 1 m/s.
    assert decision.decide_within_s == pytest.approx(10.0 - 3.8197 - 0.6, abs=1e-3)


def test_an_obstacle_is_passed_with_the_margin_and_decided_again_at_once():
    ball = Obstacle.ball([8.0, 0.0, 0.0], 1.5, name="balloon")
    decision = decide(PLANNER, situation(ball))
    path = decision.path_m
    gaps = np.linalg.norm(path - [8.0, 0, 0], axis=1) - 1.5
    assert gaps.min() >= 0.6
    assert decision.choice.clearance_m == pytest.approx(gaps.min(), abs=0.05)
    assert decision.choice.basis is Basis.RATED
    assert decision.decide_within_s == pytest.approx(1.0)


def test_only_complete_trajectories_are_candidates():
    wall = Obstacle.cuboid([9.0, 0.0, 0.0], (0.5, 60.0, 60.0))
    decision = decide(PLANNER, situation(wall))
    assert decision.choice.basis in (Basis.RATED, Basis.VERIFIED)
    end = decision.path_m[-1]
    assert abs(np.arctan2(end[1], end[0])) > np.radians(40.0), "out through the side, not up to it"
    assert decision.path_m[:, 0].max() <= 9.0 - 0.25 - 0.6


@pytest.mark.parametrize("gap_m", [0.05, 0.2, 0.59])
def test_what_is_mapped_just_beyond_the_range_keeps_its_margin_too(gap_m):
    """As returns do: a trajectory ends at 10 m, and the margin reaches farther."""
    wall = Obstacle.cuboid([10.25 + gap_m, 0.0, 0.0], (0.5, 60.0, 60.0))
    decision = decide(PLANNER, situation(wall))
    assert decision.path_m[:, 0].max() <= 10.0 + gap_m - 0.6 + 1e-6
    assert 0.6 <= decision.choice.clearance_m < np.inf
    assert decision.cells.evidence.coated.any()
    beyond = Obstacle.cuboid([10.25 + 0.61, 0.0, 0.0], (0.5, 60.0, 60.0))
    assert decide(PLANNER, situation(beyond)).choice.limited_by is Cause.NOTHING


def test_the_final_waypoint_ends_a_trajectory():
    wall = Obstacle.cuboid([6.5, 0.0, 0.0], (0.5, 60.0, 60.0))
    decision = decide(PLANNER, situation(wall, target=[4.5, 0.0, 0.0]))
    gaps = np.linalg.norm(decision.path_m - [4.5, 0.0, 0.0], axis=1)
    assert gaps[-1] <= 1.5
    assert decision.choice.clearance_m >= 0.6


def test_the_emergency_rule_takes_the_best_clearance_and_says_so():
    shell = [
        Obstacle.cuboid([4.0, 0.0, 0.0], (0.5, 7.0, 60.0)),
        Obstacle.cuboid([0.0, 3.5, 0.0], (8.0, 0.5, 60.0)),
        Obstacle.cuboid([0.0, -3.8, 0.0], (8.0, 0.5, 60.0)),
    ]
    told = situation(*shell)
    decision = decide(PLANNER, told)
    assert decision.choice.basis is Basis.EMERGENCY
    assert decision.choice.margin_m < decision.margin_m
    assert decision.choice.ruled_out_by["map"] > 50
    text = explanation(decision, Mode.EMERGENCY, told.obstacle_map)
    assert text.startswith("EMERGENCY: no trajectory keeps 0.60 m; margin stepped down to")


def test_a_commitment_keeps_the_side_where_both_cost_alike():
    ball = Obstacle.ball([8.0, 0.0, 0.0], 1.5)
    sides = {
        side: decide(PLANNER, situation(ball), commitment=Commitment(side)).choice.side
        for side in (Side.LEFT, Side.RIGHT)
    }
    assert Side.RIGHT not in (sides[Side.LEFT],)
    assert Side.LEFT not in (sides[Side.RIGHT],)
    ends = {
        side: decide(PLANNER, situation(ball), commitment=Commitment(side)).path_m[:, 1]
        for side in sides
    }
    assert ends[Side.LEFT].max() > 0.5
    assert ends[Side.RIGHT].min() < -0.5


def test_an_intruder_on_a_collision_course_is_avoided_at_equal_times():
    intruder = Intruder(np.array([6.0, 6.0, 0.0]), np.array([0.0, -1.0, 0.0]), radius_m=0.6)
    straight = decide(PLANNER, situation())
    decision = decide(PLANNER, situation(intruders=[intruder]))
    assert decision.choice.clearance_m >= 0.6
    assert decision.movements != straight.movements


def test_the_margin_grows_with_uncertainty_and_age():
    sure = margin_m(PLANNER.settings, situation())
    unsure = situation(state=replace(HERE, position_std_m=0.1), state_age_s=2.0)
    assert sure == pytest.approx(0.6)
    assert margin_m(PLANNER.settings, unsure) == pytest.approx(0.6 + 0.3 + 0.1)


def test_the_explanation_names_the_obstacle_that_ruled_out_the_cheaper_ones():
    told = situation(Obstacle.ball([8.0, 0.3, 0.0], 1.5, name="mast 7"))
    blind = planner(threshold=0.0)
    free = replace(blind.settings.prices, coated=0.0)
    decision = decide(planner(threshold=0.0, prices=free), told)
    text = explanation(decision, Mode.AVOIDANCE, told.obstacle_map)
    assert decision.choice.ruled_out
    assert "by map" in text
    assert "mast 7" in text
    assert all(r.clearance_m < 0.6 for r in decision.choice.ruled_out)


def test_feasibility_of_the_first_movement_is_reported():
    decision = decide(PLANNER, situation(Obstacle.ball([8.0, 0.0, 0.0], 1.5)))
    assert 0.0 < decision.choice.feasibility <= 1.0
    assert 0.0 < decision.choice.continuations <= 1.0


def test_a_user_can_bring_a_terminal_cost():
    def climb(reach_set, nodes, goal, arrived, automaton):
        del goal, arrived, automaton
        return -100.0 * reach_set.states[nodes, 2]

    from clearway.avoidance.plan.planner import Planner
    from worlds_for_tests import LIBRARY

    climbing = Planner.of(LIBRARY, terminal_cost=climb)
    assert decide(climbing, situation()).path_m[-1, 2] > 3.0


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ({"rating": "best"}, "valid ratings"),
        ({"threshold": 1.5}, "threshold"),
        ({"safety_margin_m": 0.0}, "safety_margin_m"),
        ({"sigmas": float("nan")}, "sigmas"),
    ],
)
def test_impossible_settings_are_refused(setting, said):
    with pytest.raises(ClearwayError, match=said):
        planner(**setting)
