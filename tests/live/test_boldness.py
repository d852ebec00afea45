"""Where what nobody has seen may count as free: ways out are insisted on while some lead on."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.avoidance.clear.hazards import no_points
from clearway.avoidance.plan.costs import Prices
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mode, Progress
from clearway.live.preflight.escape_plan import escape_plan
from clearway.live.recovery.risk_level import LONGEST, PATIENCE, Boldness
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sensors.observed.seen_space import NOTHING_SEEN
from clearway.sim import Run
from clearway.vehicle.automaton import MovementAutomaton
from worlds_for_tests import GRID, LIDAR, flown, mission, planner

TURN_S = 24.0
STREET = ObstacleMap(
    [Obstacle.cuboid([32.0, side * 102.5, 0.0], (24.0, 200.0, 200.0)) for side in (-1.0, 1.0)]
)
"""5 m wide and 24 m long, the only way through: a turn takes 7.6 m, and what is seen is 10 m."""
CLOSED = ObstacleMap([*STREET.obstacles, Obstacle.cuboid([44.5, 0.0, 0.0], (1.0, 5.0, 200.0))])
BEYOND = mission((60.0, 0.0, 0.0))


@cache
def through_the_street(seed: int = 0) -> Run:
    return flown(STREET, BEYOND, settings={"escape": "known"}, time_limit_s=360.0, seed=seed)


@pytest.mark.parametrize(
    ("seeds", "most"), [((0,), 1), pytest.param((0, 1, 2, 3), 3, marks=pytest.mark.nightly)]
)
def test_the_only_way_is_flown_once_others_have_come_to_nothing(
    seeds: tuple[int, ...], most: int
) -> None:
    """In that time by most: which one looks elsewhere for longer is chance."""
    runs = [through_the_street(seed) for seed in seeds]
    assert sum(run.reached for run in runs) >= most
    for run in runs:
        assert run.metrics.margin_violations == 0
        inside = run.time_s[(run.states[:, 0] > 25.0) & (run.states[:, 0] < 32.0)]
        if not run.reached:
            continue
        assert inside[0] > PATIENCE * TURN_S
        assert any(
            begin <= inside[0] and inside[-1] <= end
            for begin, end in run.summary()["no_guarantee_s"]
        )


def test_it_is_told_from_when_on_there_is_no_guarantee() -> None:
    flights = [entry.flight for entry in through_the_street().decisions]
    bold = [flight for flight in flights if flight.mode is Mode.NARROW]
    assert bold
    for flight in bold:
        assert flight.decision.way_out is None
        assert "no guarantee" in flight.mode_state.why
    assert "make no progress" in bold[0].mode_state.transition
    before = [flight for flight in flights if flight.time_s < bold[0].time_s]
    assert all(flight.decision.way_out is not None for flight in before[1:])


def test_what_cannot_be_left_is_not_entered_while_there_is_patience() -> None:
    """The street is closed after 20 m: whoever flew in at once would never come out again."""
    run = flown(CLOSED, BEYOND, settings={"escape": "known"}, time_limit_s=PATIENCE * TURN_S)
    assert run.metrics.margin_violations == 0
    assert run.states[:, 0].max() < 25.0


def test_a_new_goal_of_whoever_flies_begins_with_patience() -> None:
    system = AvoidanceSystem(planner(escape="known"), BEYOND, lidars=[LIDAR])
    system.update(State(np.zeros(3)))
    system.decide(0.0)
    system.progress = replace(system.progress, in_vain_s=LONGEST * TURN_S)
    assert system.decide(1.0).mode is Mode.NARROW
    system.fly_to(np.array([0.0, 40.0, 0.0]), 1.0)
    assert system.decide(1.0).mode is not Mode.NARROW


@pytest.mark.parametrize(
    ("gap_m", "aside_m", "length_m"),
    [
        (5.0, 40.0, 6.0),
        pytest.param(4.0, -20.0, 6.0, marks=pytest.mark.nightly),
        pytest.param(4.0, 8.0, 24.0, marks=pytest.mark.nightly),
    ],
)
def test_a_gap_far_from_the_straight_way_is_found_and_flown(
    gap_m: float, aside_m: float, length_m: float
) -> None:
    """In coarse cells there was none, and straight again meant never again so far aside."""
    beside_m = 0.5 * (200.0 + gap_m)
    walls = ObstacleMap(
        [
            Obstacle.cuboid(
                [20.0 + 0.5 * length_m, aside_m + side * beside_m, 0.0], (length_m, 200.0, 200.0)
            )
            for side in (-1.0, 1.0)
        ]
    )
    # Of sixteen seeds of noise the slowest needed 914 s.
    run = flown(walls, BEYOND, settings={"escape": "known"}, time_limit_s=1200.0)
    assert run.reached
    assert run.metrics.margin_violations == 0


def test_ways_that_came_to_nothing_are_tried_again_by_who_insists_no_more() -> None:
    system = AvoidanceSystem(planner(escape="known"), BEYOND, lidars=[LIDAR])
    system.update(State(np.zeros(3)))
    routes = system._known.seen_routes
    assert routes is not None
    routes.look(NOTHING_SEEN, no_points(), np.zeros(3), 10.0, 10.0)
    routes.spend(np.array([8.0, 0.0, 0.0]))
    assert routes.cells.in_vain.max() > 0.0
    system.decide(0.0)
    assert routes.cells.in_vain.max() > 0.0
    system.progress = replace(system.progress, in_vain_s=LONGEST * TURN_S)
    system.decide(1.0)
    assert routes.cells.in_vain.max() == 0.0


# Who insists --------------------------------------------------------------------------------


def test_ways_out_are_insisted_on_where_sensors_see_enough() -> None:
    plan = escape_plan(planner(escape="known"), [LIDAR])
    assert (plan.asked, plan.flown, plan.insists) == ("known", "known", True)
    assert "while some lead on" in plan.why
    assert not escape_plan(planner(escape="known"), []).insists
    assert not escape_plan(planner(escape="strict"), [LIDAR]).insists
    assert not escape_plan(planner(escape="off"), [LIDAR]).insists


def test_a_guardian_never_insists_and_says_so() -> None:
    plan = escape_plan(planner(escape="known"), [LIDAR]).count_unobserved_as_free()
    assert not plan.insists
    assert plan.why == "unobserved space counts as free: no guarantee"
    strict = escape_plan(planner(escape="strict"), [LIDAR])
    assert strict.count_unobserved_as_free() is strict


def test_who_pays_nothing_for_want_of_room_or_can_stop_does_not() -> None:
    assert not escape_plan(planner(escape="known", prices=Prices(no_room=0.0)), [LIDAR]).insists
    copter = ReachLibrary.load_or_build(MovementAutomaton.inertialess(speed_mps=1.0), GRID)
    hovers = Planner.of(copter, AvoidanceSettings(escape="known"))
    assert not escape_plan(hovers, [LIDAR]).insists


# For how long -------------------------------------------------------------------------------


def test_it_is_insisted_on_while_the_goal_or_a_way_to_it_comes_nearer() -> None:
    careful = Boldness()
    assert careful.after(Progress(nearest_s=900.0), 910.0, TURN_S) == careful
    on_a_way = Progress(nearest_s=0.0, in_vain_s=PATIENCE * TURN_S)
    assert careful.after(on_a_way, LONGEST * TURN_S, TURN_S) == careful
    assert careful.after(on_a_way, LONGEST * TURN_S + 1.0, TURN_S).bold


def test_each_way_is_given_up_for_the_other_in_the_end_and_a_new_goal_begins_anew() -> None:
    in_vain = Progress(in_vain_s=PATIENCE * TURN_S + 1.0)
    bold = Boldness().after(in_vain, 100.0, TURN_S)
    assert bold == Boldness(bold=True, since_s=100.0)
    assert not bold.after(in_vain, 200.0, TURN_S).bold
    assert bold.after(Progress(goal=1), 101.0, TURN_S) == Boldness(since_s=101.0, goal=1)


@given(
    in_vain_s=st.floats(0.0, 1e4),
    idle_s=st.floats(0.0, 1e4),
    since_s=st.floats(0.0, 1e4),
    bold=st.booleans(),
)
def test_neither_is_given_up_before_its_time(
    in_vain_s: float, idle_s: float, since_s: float, bold: bool
) -> None:
    now = 2e4
    before = Boldness(bold, since_s)
    after = before.after(Progress(nearest_s=now - idle_s, in_vain_s=in_vain_s), now, TURN_S)
    idle_s = min(idle_s, now - since_s)
    if in_vain_s <= PATIENCE * TURN_S and idle_s < LONGEST * TURN_S - 1e-6:
        assert after == before
    if in_vain_s > PATIENCE * TURN_S or idle_s > LONGEST * TURN_S + 1e-6:
        assert after == Boldness(not bold, now)
