"""Planners that clearway is compared with: each flies, and does what it is known for."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from clearway.base.errors import ClearwayError
from clearway.missions.setup import FlightSetup, prepare
from clearway.missions.world_file import read_mission
from clearway.sim import Run
from clearway.sim.baselines import CLEARWAY, PLANNERS, BaselinePilot, Manoeuvre, pilot_named
from clearway.sim.pilot import Steering
from clearway.sim.worlds import WORLD_FAMILIES, make_world


@cache
def setup(mission: str = "static-obstacles") -> FlightSetup:
    return prepare(read_mission(mission))


@cache
def flown(planner: str, mission: str = "static-obstacles") -> Run[Steering]:
    return setup(mission).fly_with(planner)


@pytest.mark.parametrize("planner", PLANNERS)
def test_every_planner_flies_and_explains_itself(planner):
    run = flown(planner)
    assert run.time_s[-1] >= 8.0
    assert all(entry.flight.explanation for entry in run.decisions)
    assert all(entry.flight.movements for entry in run.decisions)
    assert run.safety_margin_m == flown("clearway").safety_margin_m


def test_straight_flight_crashes_into_the_first_ball():
    run = flown("straight")
    assert run.crashed_s == pytest.approx(8.0, abs=0.1)
    assert not run.reached
    assert run.time_s[-1] == pytest.approx(run.crashed_s, abs=0.1)


@pytest.mark.parametrize("planner", ["deterministic", "deterministic-reduced"])
def test_a_threshold_of_hits_violates_the_margin_that_clearway_keeps(planner):
    run = flown(planner)
    assert run.reached
    assert 0.0 < run.metrics.min_obstacle_distance_m < 0.5
    assert flown("clearway").safe


@pytest.mark.parametrize("planner", ["turn-back", "adaptive", "vfh"])
def test_planners_with_a_margin_keep_clear_of_three_balls(planner):
    assert flown(planner).safe


def test_wider_margins_cost_time():
    times = [flown(planner).metrics.time_s for planner in ("clearway", "adaptive", "turn-back")]
    assert times == sorted(times)


def test_wide_margins_are_those_of_the_paper():
    assert "4.60 m" in flown("turn-back").decisions[0].flight.explanation
    assert "1.80 m" in flown("adaptive").decisions[0].flight.explanation


@pytest.mark.nightly
def test_straight_flight_meets_the_intruders_that_others_avoid():
    straight = flown("straight", "intruders-collision")
    assert straight.metrics.intruders.min_distance_m < 0.6
    assert straight.crashed_s is not None
    for planner in ("potential-field", "vfh", "adaptive", "turn-back", "clearway"):
        assert flown(planner, "intruders-collision").safe, planner


def test_the_predecessor_knows_nothing_of_traffic():
    blind, straight = (
        flown(name, "intruders-collision") for name in ("deterministic-reduced", "straight")
    )
    np.testing.assert_array_equal(blind.states, straight.states)


@pytest.mark.parametrize("planner", sorted(set(PLANNERS) - {CLEARWAY}))
def test_a_map_alone_is_known_to_all_but_the_predecessor_and_the_blind(planner):
    told = replace(setup(), sensors=(), obstacle_map=setup().world)
    told = replace(told, simulation=replace(told.simulation, time_limit_s=15.0))
    run = told.fly_with(planner)
    knows_no_map = planner == "straight" or planner.startswith("deterministic")
    assert (run.crashed_s is not None) == knows_no_map


@pytest.mark.parametrize(
    "planner",
    [
        "potential-field",
        *(pytest.param(each, marks=pytest.mark.nightly) for each in ("vfh", "mvp")),
    ],
)
def test_the_same_seed_gives_the_same_flight(planner):
    again = setup().fly_with(planner)
    np.testing.assert_array_equal(flown(planner).states, again.states)


def test_a_rule_is_asked_with_its_last_manoeuvre():
    asked = []

    def rule(_situation, before):
        asked.append(before)
        return Manoeuvre(("Straight", "Left"), "as told")

    pilot = BaselinePilot(setup().system(), rule)
    start = setup().mission.start
    for second in range(2):
        pilot.update(replace(start, time_s=float(second)))
        assert pilot.due(float(second)) is not None
        pilot.decide(float(second))
    assert asked[0] is None
    assert asked[1].movements == ("Straight", "Left")
    assert pilot.due(1.5) is None


def test_an_unknown_planner_says_which_there_are():
    with pytest.raises(ClearwayError, match="potential-field"):
        pilot_named("best", setup().system(), setup().craft)


@pytest.mark.parametrize("family", sorted(WORLD_FAMILIES))
def test_made_worlds_come_from_their_seed_and_leave_room_at_both_ends(family):
    worlds = [make_world(family, seed) for seed in (0, 0, 1)]
    shapes = [np.array([one.position_m for one in made.world.obstacles]) for made in worlds]
    np.testing.assert_array_equal(shapes[0], shapes[1])
    assert shapes[0].shape != shapes[2].shape or not np.array_equal(shapes[0], shapes[2])
    for made in worlds:
        corners = [made.mission.start.position_m, *made.mission.waypoints_m]
        assert made.world.distance_m(np.array(corners)).min() > 1.0
    assert not np.isinf(setup(f"{family}:1").world.distance_m(np.zeros((1, 3)))).any()


@pytest.mark.parametrize(
    "family",
    [
        "balls-100",
        "wires",
        *(pytest.param(name, marks=pytest.mark.nightly) for name in ("forest", "street", "walls")),
    ],
)
def test_clearway_is_safe_where_straight_flight_is_not(family):
    mission = f"{family}:2"
    assert flown("clearway", mission).safe
    assert not flown("straight", mission).safe


def test_an_unknown_family_says_which_there_are():
    with pytest.raises(ClearwayError, match="forest"):
        make_world("swamp", 0)
