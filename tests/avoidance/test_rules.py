"""Rules: what each forbids, that safety comes before them, and that decisions name them."""

from dataclasses import replace

import numpy as np
import pytest

from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.clear.crossing import crossings_ahead
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.avoidance.rules import (
    GroundHeights,
    Rule,
    Verdict,
    altitude_ceiling,
    altitude_floor,
    horizontal_only,
    keep_out,
    near_route,
    right_of_way,
    terrain_clearance,
    vertical_only,
)
from clearway.base.errors import ClearwayError, InputError
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mode
from clearway.live.outputs.explain import explanation
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim import SimulationSettings, simulate
from clearway.traffic import Intruder
from worlds_for_tests import LIBRARY, LIDAR, mission

AHEAD = np.array([30.0, 0.0, 0.0])
BALL = Obstacle.ball([6.0, 0.0, 0.0], 1.5, name="ball")


def ruled(*rules, obstacles=(), state=None, target=AHEAD, **more):
    settings = AvoidanceSettings(escape="off")
    planner = Planner.of(LIBRARY, settings, rules=rules)
    here = state or State(np.zeros(3))
    chart = ObstacleMap(obstacles)
    return decide(planner, Situation(here, np.asarray(target, float), obstacle_map=chart, **more))


def note(decision, name):
    return next(one for one in decision.choice.rules if one.name == name)


def wall(z_from, z_to):
    """Across the way, from one height to another."""
    middle = 0.5 * (z_from + z_to)
    return Obstacle.cuboid([7.0, 0.0, middle], (0.5, 80.0, z_to - z_from), name="wall")


def test_without_a_rule_that_is_concerned_nothing_changes():
    plain = ruled(obstacles=[BALL])
    same = ruled(altitude_floor(-50.0), right_of_way(), obstacles=[BALL])
    assert same.movements == plain.movements
    assert same.choice.rules == ()


def test_a_floor_turns_the_way_under_a_wall_into_one_round_or_over_it():
    low = wall(-1.2, 3.0)
    free = ruled(obstacles=[low])
    assert free.path_m[:, 2].min() < -1.2, "cheapest is the way under it"
    held = ruled(altitude_floor(-0.5), obstacles=[low])
    assert held.path_m[:, 2].min() >= -0.5
    assert note(held, "altitude floor").decided
    assert note(held, "altitude floor").forbidden > 0
    assert not note(held, "altitude floor").broken
    assert "rule altitude floor (limit -0.5 m): forbids" in explanation(
        held, Mode.AVOIDANCE, ObstacleMap([low])
    )


def test_a_ceiling_likewise():
    high = wall(-3.0, 1.2)
    assert ruled(obstacles=[high]).path_m[:, 2].max() > 1.2
    assert ruled(altitude_ceiling(0.5), obstacles=[high]).path_m[:, 2].max() <= 0.5


def test_below_the_floor_the_vehicle_climbs_back_and_sinks_no_further():
    sunk = State(np.array([0.0, 0.0, -4.0]))
    decision = ruled(altitude_floor(0.0), state=sunk, target=[30.0, 0.0, -4.0])
    assert decision.path_m[:, 2].min() >= -4.0 - 1e-6
    assert decision.path_m[-1, 2] > -2.0
    assert "the vehicle is 4.0 m beyond it" in note(decision, "altitude floor").reason


def test_safety_comes_before_rules_and_the_least_important_is_broken():
    shut = [
        wall(-30.0, 1.4),  # Only the way over it is free.
        Obstacle.cuboid([2.0, 4.5, 0.0], (12.0, 0.5, 80.0)),
        Obstacle.cuboid([2.0, -4.5, 0.0], (12.0, 0.5, 80.0)),
    ]
    over = ruled(altitude_ceiling(1.0), obstacles=shut)
    assert over.choice.basis is Basis.AGAINST_RULES
    assert over.choice.clearance_m >= over.margin_m
    assert note(over, "altitude ceiling").broken

    # Left keeps one rule and breaks the other, right the other way round.
    def lawless(side):
        def verdict(view):
            ends = view.reach_set.states[:, 1] * side
            return Verdict("test", view.worst_on_way(ends) > 0.5)

        return Rule("left" if side > 0 else "right", verdict)

    ahead = [Obstacle.cuboid([5.0, 0.0, 0.0], (0.5, 2.0, 80.0))]
    first_left = ruled(lawless(1), lawless(-1), obstacles=ahead)
    first_right = ruled(lawless(-1), lawless(1), obstacles=ahead)
    assert first_left.path_m[-1, 1] < 0.0 < first_right.path_m[-1, 1]
    assert note(first_left, "right").broken
    assert not note(first_left, "left").broken


def test_keep_out_volumes_are_flown_round_while_in_force_and_entered_in_need():
    zone = Obstacle.cuboid([6.0, 1.0, 0.0], (3.0, 4.0, 40.0), name="zone")
    kept = ruled(keep_out([zone], name="zone"))
    gaps = ObstacleMap([zone]).distance_m(kept.path_m)
    assert gaps.min() >= 0.0
    assert note(kept, "keep out of zone").decided
    later = ruled(keep_out([zone], from_s=10.0))
    assert set(later.movements) == {"Straight"}
    inside = ruled(keep_out([zone]), state=State(np.array([6.0, 1.0, 0.0])))
    assert ObstacleMap([zone]).distance_m(inside.path_m[-1:])[0] > 0.0
    tunnel = [
        Obstacle.cuboid([4.0, 3.5, 0.0], (16.0, 0.5, 80.0)),
        Obstacle.cuboid([4.0, -2.0, 0.0], (16.0, 0.5, 80.0)),
        Obstacle.cuboid([4.0, 0.0, 2.0], (16.0, 80.0, 0.5)),
        Obstacle.cuboid([4.0, 0.0, -2.0], (16.0, 80.0, 0.5)),
    ]
    through = ruled(keep_out([zone]), obstacles=tunnel)
    assert through.choice.basis is Basis.AGAINST_RULES
    assert through.choice.clearance_m >= through.margin_m


def test_terrain_is_flown_over_at_a_height_and_unknown_ground_forbids_nothing():
    heights = np.zeros((21, 41))
    heights[:, 24:] = 5.0  # A step 4 m ahead at the start, known on both sides of the route.
    ground = GroundHeights(heights, np.array([-20.0, -10.0]), 1.0)
    assert ground.under(np.array([[3.5, 0.0, 9.0]]))[0] == 5.0, "never below what is between"
    assert np.isnan(ground.under(np.array([[300.0, 0.0, 0.0]]))[0])
    start = State(np.array([0.0, 0.0, 3.0]))
    over = ruled(terrain_clearance(ground, 1.0), state=start, target=[30.0, 0.0, 8.0])
    room = over.path_m[:, 2] - ground.under(over.path_m)
    assert np.nanmin(room) >= 1.0 - 1e-6 or over.choice.basis is Basis.AGAINST_RULES
    unknown = GroundHeights(np.full((2, 2), np.nan), np.array([-50.0, -50.0]), 100.0)
    assert ruled(terrain_clearance(unknown, 50.0)).choice.rules == ()
    with pytest.raises(InputError, match="at least 2 x 2"):
        GroundHeights(np.zeros((1, 5)), np.zeros(2), 1.0)


def test_near_the_route_a_corridor_is_kept():
    blocked = [Obstacle.cuboid([6.0, 3.0, 0.0], (0.5, 9.0, 80.0))]
    start = State(np.array([0.0, 0.0, 0.0]))
    plain = ruled(obstacles=blocked, state=start)
    assert plain.path_m[:, 1].min() < -2.1
    narrow = ruled(near_route(2.0), obstacles=blocked, state=start)
    assert narrow.choice.basis is Basis.AGAINST_RULES, "no way past it inside the corridor"
    assert narrow.choice.clearance_m >= narrow.margin_m
    drifted = State(np.array([0.0, 5.0, 0.0]))
    back = ruled(near_route(2.0), state=drifted, from_m=np.zeros(3))
    assert back.path_m[-1, 1] < 3.0
    assert "3.0 m beyond it" in note(back, "near the route").reason


def meeting(place, velocity, name="N1"):
    return Intruder(
        np.array(place, float),
        np.array(velocity, float),
        spread_rad=np.zeros(2),
        radius_m=0.6,
        name=name,
        time_s=0.0,
    )


def test_head_on_both_turn_right_whatever_is_cheaper():
    # A little to the right: the cheaper way is to the left.
    intruder = meeting([9.0, -0.3, 0.0], [-1.0, 0.0, 0.0])
    free = ruled(intruders=[intruder])
    assert free.path_m[:, 1].max() > 0.5
    given = ruled(right_of_way(), intruders=[intruder])
    assert given.path_m[:, 1].min() < -0.5
    assert note(given, "right of way").reason == "N1 head on"
    assert note(given, "right of way").decided


def test_who_has_the_other_on_the_right_passes_behind_it():
    intruder = meeting([7.0, -6.0, 0.0], [0.0, 0.9, 0.0])
    given = ruled(right_of_way(), intruders=[intruder])
    assert "converging from the right" in note(given, "right of way").reason
    assert given.choice.clearance_m >= given.margin_m
    ahead = crossings_ahead(given.prepared.reach_set, given.hazards.moving)
    assert ahead[given.choice.node] == 0


def test_who_comes_from_the_left_gives_way_and_is_avoided_all_the_same():
    decision = ruled(right_of_way(), intruders=[meeting([6.0, 6.0, 0.0], [0.0, -1.0, 0.0])])
    assert "it gives way" in note(decision, "right of way").reason
    assert note(decision, "right of way").forbidden == 0
    assert decision.choice.clearance_m >= decision.margin_m


def test_overtaking_is_on_the_right():
    slow = meeting([4.0, -0.2, 0.0], [0.3, 0.0, 0.0])
    given = ruled(right_of_way(), intruders=[slow])
    assert "overtaking" in note(given, "right of way").reason
    assert given.path_m[:, 1].min() < -0.5


def test_no_conflict_no_right_of_way():
    assert (
        ruled(right_of_way(), intruders=[meeting([8.0, 9.0, 0.0], [-1, 0, 0])]).choice.rules == ()
    )


def test_separation_by_turns_or_by_height_only():
    intruder = meeting([8.0, 0.0, 0.0], [-1.0, 0.0, 0.0])
    level = ruled(horizontal_only(), intruders=[intruder])
    assert np.ptp(level.path_m[:, 2]) < 1e-9
    upright = ruled(vertical_only(), intruders=[intruder])
    assert np.ptp(upright.path_m[:, 1]) < 1e-9
    for decision in (level, upright):
        assert decision.choice.clearance_m >= decision.margin_m
    far = ruled(vertical_only(within_m=3.0), intruders=[intruder])
    assert far.choice.rules == ()


def test_rules_hold_in_flight_and_the_log_names_them():
    planner = Planner.of(LIBRARY, rules=(altitude_floor(-0.6), near_route(30.0)))
    system = AvoidanceSystem(planner, mission((20.0, 0.0, 0.0)), lidars=(LIDAR,))
    blocked = ObstacleMap([Obstacle.cuboid([10.0, 0.0, 1.0], (0.5, 8.0, 4.0))])
    run = simulate(system, blocked, lidars=(LIDAR,), settings=SimulationSettings())
    assert run.reached
    assert run.states[:, 2].min() >= -0.6 - 1e-3
    named = {n.name for e in run.decisions for n in e.flight.decision.choice.rules}
    assert named >= {"altitude floor", "near the route"}


def test_a_rule_is_a_function_and_too_many_are_refused():
    def no_left(view):
        return Verdict("no left turns", view.worst_on_way(view.reach_set.states[:, 5]) > 1e-6)

    decision = ruled(Rule("no left turns", no_left), obstacles=[replace(BALL, name="b")])
    assert decision.path_m[:, 1].max() <= 1e-9
    with pytest.raises(ClearwayError, match="33 are too many; at most 32"):
        ruled(*[altitude_floor(-9.0)] * 33)
