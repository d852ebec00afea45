"""Live use: readings in any order, bad data counted, decisions when due."""

from dataclasses import fields, replace

import numpy as np
import pytest

from clearway.avoidance.plan.situation import Situation
from clearway.base.errors import ClearwayError
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mode
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import Scan, simulate_scan
from clearway.sim.worlds import ball_world
from clearway.traffic import Intruder, TrackerSettings
from worlds_for_tests import LIDAR, mission, planner

PLANNER = planner(escape="off")
MISSION = mission((30.0, 0.0, 0.0))
BALL = ObstacleMap([Obstacle.ball([8.0, 0.0, 0.0], 1.5)])


def system(**settings):
    planner = PLANNER.with_values(**settings) if settings else PLANNER
    return AvoidanceSystem(planner, MISSION, lidars=(LIDAR,))


def state(time_s, x=0.0, **more):
    return State(np.array([x, 0.0, 0.0]), time_s=time_s, **more)


def test_deciding_without_an_own_state_is_refused():
    with pytest.raises(ClearwayError, match="no state estimate yet"):
        system().decide(0.0)


def test_unusable_readings_are_counted_by_reason():
    live = system()
    live.update(Scan(np.zeros((0, 3)), 0.0, sensor="lidar"))
    live.update(state(1.0))
    live.update(state(1.0))
    live.update(state(0.5))
    assert not live.receive(State, [np.nan, 0, 0], time_s=2.0)
    assert not live.receive(
        State, [9.0, 0, 0], time_s=2.0, position_std_m=-1.0, attitude_std_rad=np.inf
    )
    assert not live.receive(Scan, np.zeros((0, 3)), np.nan, sensor="lidar")
    assert not live.receive(Intruder, [0, 0, np.inf], ["x", 0, 0])
    live.update(Scan(np.zeros((0, 3)), 1.0, sensor="radar"))
    live.update(Scan(np.zeros((0, 3)), 1.0, sensor="lidar"))
    live.update(Scan(np.zeros((0, 3)), 0.3, sensor="lidar"))
    at_once = {
        "state: unusable position_m": 1,
        "state: unusable position_std_m, attitude_std_rad": 1,
        "scan: unusable": 1,
        "intruder: unusable position_m, velocity_mps": 1,
        "scan: unknown sensor": 1,
    }
    assert dict(live.counts) == at_once
    live.catch_up(1.0)
    live.update(Scan(np.zeros((0, 3)), 0.9, sensor="lidar"))
    live.update(state(0.8))
    live.catch_up(1.0)
    assert dict(live.counts) == {
        "scan: no state estimate of its time": 2,
        "state: late or repeated": 2,
        "scan: late or repeated": 1,
        **at_once,
    }


def test_readings_out_of_order_before_a_question_are_all_used():
    live = system()
    for time_s in (0.6, 0.2, 0.4, 0.0):
        live.update(Scan(np.zeros((0, 3)), time_s, sensor="lidar"))
        live.update(state(time_s, x=time_s))
    live.catch_up(0.6)
    assert not live.counts
    assert live.situation(0.6)[0].state.position_m[0] == 0.6


def test_readings_from_the_future_are_counted_and_shut_nothing_out():
    live = system()
    live.update(state(0.0))
    live.update(Scan(np.zeros((0, 3)), 60.0, sensor="lidar"))
    live.update(Intruder([6, 5, 0], [0, -1, 0], name="i", time_s=60.0))
    live.catch_up(0.0)
    assert dict(live.counts) == {"scan: from the future": 1, "intruder: from the future": 1}
    live.update(Scan(np.zeros((0, 3)), 0.0, sensor="lidar"))
    live.update(Intruder([6, 5, 0], [0, -1, 0], name="i", time_s=0.5))
    situation, scan_age_s = live.situation(1.0)
    assert scan_age_s == 1.0
    assert [intruder.name for intruder in situation.intruders] == ["i"]
    # Whoever asks tells the time, without own states too.
    live.due(60.0)
    live.update(Scan(np.zeros((0, 3)), 60.0, sensor="lidar"))
    assert live.counts["scan: from the future"] == 1


def test_what_is_no_reading_and_no_time_is_refused():
    live = system()
    live.update(state(0.0))
    with pytest.raises(ClearwayError, match="takes a State, a Scan or an Intruder, got dict"):
        live.update({"position_m": [0, 0, 0]})
    for ask in (live.due, live.decide, live.situation, live.catch_up):
        for time_s in (np.nan, np.inf, 1e300, "now"):
            with pytest.raises(ClearwayError, match="must be a number"):
                ask(time_s)
    assert live.decide(0.0).movements, "a question at an impossible time leaves nothing behind"


def test_an_own_state_from_the_future_shuts_nothing_out():
    live = system()
    live.update(state(0.0))
    live.update(state(1e6, x=90.0))
    live.update(state(0.5, x=0.5))
    assert live.situation(0.5)[0].state.position_m[0] == 0.5
    assert live.counts["state: from the future"] == 1


def test_an_own_state_after_a_long_silence_is_believed():
    live = system()
    live.update(state(0.0))
    live.decide(0.0)
    live.update(state(60.0, x=20.0))
    situation, _ = live.situation(60.5)
    assert situation.state.position_m[0] >= 20.0
    assert not live.counts["state: from the future"]
    assert live.progress.nearest_s > 0.0


def test_nan_points_of_a_scan_do_no_harm():
    live = system()
    live.update(state(0.0))
    points = np.full((50, 3), np.nan)
    points[:10] = [5.0, 0.0, 0.0]
    live.update(Scan(points, 0.0, sensor="lidar"))
    decision = live.decide(0.0).decision
    assert np.isfinite(decision.path_m).all()
    assert len(decision.hazards.points.radius_m) >= 1


def test_without_a_fresh_scan_space_counts_as_unseen_and_it_is_said():
    live = system()
    live.update(state(0.0))
    flight = live.decide(0.0)
    assert not flight.decision.cells.evidence.seen.any()
    assert flight.counts == {"scan: none fresh of lidar": 1}
    assert np.isnan(flight.scan_age_s)


def test_a_late_scan_is_placed_where_the_vehicle_was():
    early = simulate_scan(LIDAR, BALL, state(0.0), 1)
    live = system()
    for time_s in (0.0, 1.0):
        live.update(state(time_s, x=time_s))
    live.update(early)
    flight = live.decide(1.0)
    assert flight.scan_age_s == pytest.approx(1.0)
    nearest = flight.decision.hazards.points.position_m[:, 0].min()
    assert nearest == pytest.approx(8.0 - 1.5 - 1.0, abs=0.15)


def test_the_state_is_carried_to_the_decision_time_along_the_plan():
    live = system()
    live.update(state(0.0))
    live.update(simulate_scan(LIDAR, ObstacleMap(), state(0.0)))
    live.decide(0.0)
    carried = live.decide(0.4).decision.state
    assert carried.position_m[0] == pytest.approx(0.4)
    assert live.decide(2.5).counts["state: stale"] == 1


def test_a_scan_before_its_own_state_is_placed_along_the_plan():
    live = system_after_free_flight()
    ahead = Obstacle.ball([8.0, 0.0, 0.0], 1.5)
    live.update(simulate_scan(LIDAR, ObstacleMap([ahead]), state(1.5, x=1.5)))
    live.catch_up(1.5)
    remembered = live._known.sensing.remembered.position_m
    assert remembered[:, 0].min() == pytest.approx(8.0 - 1.5, abs=0.15)
    hazards = live.decide(1.5).decision.hazards
    assert hazards.points.position_m[:, 0].min() == pytest.approx(8.0 - 1.5 - 1.5, abs=0.15)


def test_the_buffer_holds_what_was_decided_from_then_on():
    live = system_after_free_flight()
    assert live.buffer.start_s == 0.0
    assert set(live.buffer.names) == {"Straight"}
    live.update(state(1.5, x=1.5))
    again = live.decide(1.5)
    assert live.buffer.start_s == 1.5
    assert live.buffer.names == again.decision.movements


def test_in_the_middle_of_a_movement_news_counts_if_it_endangers_the_plan():
    live = system_after_free_flight()
    live.update(state(0.6, x=0.6))
    live.update(simulate_scan(LIDAR, BALL, state(0.6, x=0.6)))
    assert "m of a return" in (live.due(0.6) or "")
    assert "m of a return" in (live.due(0.7) or ""), "until it is decided"
    live.decide(0.7)
    assert live.due(0.8) is None


def test_at_the_end_of_a_movement_any_news_counts():
    live = system_after_free_flight()
    live.update(state(0.4, x=0.4))
    aside = ObstacleMap([Obstacle.ball([4.0, 4.0, 0.0], 1.0)])
    live.update(simulate_scan(LIDAR, aside, state(0.4, x=0.4)))
    assert live.due(0.9) is None
    assert live.due(1.0) == "new returns"


def test_without_verification_all_news_counts():
    careless = PLANNER.with_values(verify=False)
    live = AvoidanceSystem(careless, MISSION, lidars=(LIDAR,))
    live.update(state(0.0))
    live.decide(0.0)
    live.update(Scan(np.array([[0.0, 5.0, 0.0]]), 0.0, sensor="lidar"))
    assert live.due(0.4) == "new returns"


@pytest.mark.parametrize("seed", range(6))
def test_what_a_plan_was_decided_on_does_not_endanger_it(seed):
    world, there, *_ = ball_world(seed)
    live = AvoidanceSystem(PLANNER, there, lidars=(LIDAR,), obstacle_map=world)
    at = there.start
    for second in range(12):
        live.update(replace(at, time_s=float(second)))
        flight = live.decide(float(second))
        if flight.mode is Mode.EMERGENCY:
            break
        for part in (0.0, 0.3, 0.7, 0.99):
            if part:
                live.update(live.state_at(second + part))
            live.catch_up(second + part)
            assert live._watch.find_danger_at(live._plan, second + part) is None
        at = live.state_at(second + 1.0)


def flown_live(begin_s):
    """Why and what is decided at ten scans a second, with an obstacle and an intruder ahead."""
    live, here = system(), State(np.zeros(3))
    told = []
    for n in range(60):
        now = begin_s + 0.1 * n
        here = replace(live.state_at(now) or here, time_s=now)
        live.update(here)
        live.update(simulate_scan(LIDAR, BALL, here))
        if n % 10 == 0:
            place = [14.0 - 0.1 * n, 4.0, 0.0]
            live.update(Intruder(place, [-1.0, 0.0, 0.0], name="i", time_s=now))
        why = live.due(now)
        if why is not None:
            told.append((n, why, live.decide(now).movements))
    return told


def test_the_clock_may_count_from_1970():
    told = flown_live(0.0)
    assert [n for n, _, _ in told] == [0, 10, 20, 30, 40, 50]
    assert flown_live(1_763_700_000.0) == told


def test_a_decision_is_due_when_something_changes():
    live = system()
    live.update(state(0.0))
    assert live.due(0.0) == "the buffer is empty"
    live.update(simulate_scan(LIDAR, ObstacleMap(), state(0.0)))
    live.decide(0.0)
    live.update(state(1.0, x=1.0))
    live.update(simulate_scan(LIDAR, ObstacleMap(), state(1.0, x=1.0)))
    assert live.due(1.0) is None, "nothing in sight: the plan is flown on"
    live.update(state(2.0, x=2.0))
    live.update(simulate_scan(LIDAR, BALL, state(2.0, x=2.0)))
    assert live.due(2.0) == "new returns"
    assert "turn away" in (system_after_free_flight().due(5.6) or "")


def system_after_free_flight():
    live = system()
    live.update(state(0.0))
    live.update(simulate_scan(LIDAR, ObstacleMap(), state(0.0)))
    live.decide(0.0)
    return live


def test_a_remembered_obstacle_outside_the_field_of_view_still_counts():
    live = system()
    live.update(state(0.0))
    live.update(simulate_scan(LIDAR, BALL, state(0.0), 1))
    turned = State(np.array([5.0, 0.0, 0.0]), np.array([0.0, 0.0, np.pi / 2]), time_s=5.0)
    live.update(turned)
    live.update(simulate_scan(LIDAR, BALL, turned, 1))
    assert len(live.decide(5.0).decision.hazards.points.radius_m) > 20


def test_stale_intruders_are_dropped_and_counted():
    live = system()
    live.update(state(0.0))
    live.update(Intruder(np.array([8.0, 0, 0]), np.array([-1.0, 0, 0]), radius_m=0.3, name="a"))
    assert len(live.decide(0.0).decision.hazards.moving.radius_m) == 1
    live.update(state(20.0))
    assert len(live.decide(20.0).decision.hazards.moving.radius_m) == 0
    assert live.counts["intruder: stale"] == 1


def test_the_mode_after_the_last_waypoint_is_landing():
    landing = AvoidanceSystem(
        PLANNER,
        type(MISSION)(
            "land",
            state(0.0),
            waypoints_m=np.array([[2.0, 0, 0]]),
            reach_radius_m=1.5,
            landing_m=np.array([[12.0, 0, -3.0]]),
        ),
    )
    landing.update(state(0.0))
    assert landing.decide(0.0).mode is Mode.NAVIGATION
    landing.update(state(1.0, x=1.0))
    assert landing.decide(1.0).mode is Mode.LANDING


def test_a_tracker_smooths_reports_and_counts_what_it_leaves_out():
    live = system(tracker=TrackerSettings(), transponder_address="own")
    rng = np.random.default_rng(3)
    for second in range(6):
        live.update(state(float(second), x=float(second)))
        truth = np.array([40.0 - second, 5.0, 0.0])
        report = Intruder(
            truth + rng.normal(0.0, 0.3, 3),
            np.array([-1.0, 0.0, 0.0]) + rng.normal(0.0, 0.1, 3),
            radius_m=0.6,
            name="a",
            time_s=float(second),
            position_std_m=0.3,
            velocity_std_mps=0.1,
        )
        live.update(report)
        if second == 3:
            live.update(report)
        assert live.due(float(second))
        decision = live.decide(float(second)).decision
    moving = decision.hazards.moving
    np.testing.assert_allclose(moving.position_m[0], [30.0, 5.0, 0.0], atol=0.5)
    assert moving.radius_m[0] < 0.6 + 3 * 0.3, "six reports tell more than one"
    assert live.counts["report: duplicate"] == 1


def test_what_was_measured_before_a_decision_and_comes_after_it_makes_the_next_one_due():
    live = system()
    live.update(state(0.0))
    live.update(Scan(np.array([[8.0, 0.0, 0.0]]), 0.0, sensor="lidar"))
    live.decide(0.0)
    live.update(state(0.5, x=0.5))
    assert live.due(0.5) is None
    late = Intruder(
        np.array([9.0, 1.0, 0.0]),
        np.array([-1.0, 0, 0]),
        spread_rad=np.zeros(2),
        radius_m=0.5,
        name="A",
        time_s=-0.5,
    )
    live.update(late)
    assert live.due(0.5) == "the plan comes within -0.46 m of an intruder"
    live.decide(0.5)
    assert live.due(0.6) is None
    live.update(Scan(np.array([[7.0, 0.0, 0.0]]), 0.4, sensor="lidar"))
    assert live.due(0.6) is None
    assert live.due(1.5) is not None


def test_what_a_system_knows_says_all_that_a_checked_situation_does():
    live = AvoidanceSystem(planner(), mission((30.0, 0.0, 0.0)), lidars=(LIDAR,))
    live.update(State(np.zeros(3)))
    live.update(simulate_scan(LIDAR, ball_world(0)[0], State(np.zeros(3))))
    known = vars(live.situation(0.0)[0])
    names = {field.name for field in fields(Situation)}
    assert names <= known.keys()
    checked = Situation(**{name: known[name] for name in names})
    np.testing.assert_array_equal(checked.frame.world_from_grid, known["frame"].world_from_grid)
    np.testing.assert_array_equal(checked.frame.origin_m, known["frame"].origin_m)
