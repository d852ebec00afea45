"""A good companion computer: flights of the simulated autopilot with the habits of real ones."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from clearway.live.link.following import SetPointsFollowed
from clearway.live.link.link_state import LinkState
from clearway.mavlink.set_points import HOLD
from clearway.mavlink.simulated_habits import Habits
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import CombinedWorld
from clearway.sim.scripted import ScriptedIntruder
from companion_missions import CALM, mission
from mavlink_for_tests import SET_POINT, Bench, attitude, heartbeat, in_the_air, position, sent
from simulated_flight import SimulatedFlight


@pytest.fixture(scope="module")
def calm() -> tuple[MissionFile, FlightSetup]:
    """Nothing in the way, at 7 m with a margin of 5."""
    return mission()


def set_points(flight: SimulatedFlight) -> list[tuple[float, Any]]:
    return [(o.time_s, p) for o in flight.outcomes for p in sent(o, SET_POINT)]


# --- in the air, followed, with a floor ---------------------------------------------------------


def test_nothing_is_sent_before_the_autopilot_has_taken_off(calm: Any) -> None:
    flight = SimulatedFlight(*calm, Habits(takes_off_s=4.0))
    flight.run(8.0)
    boot_s = 10.0
    assert set_points(flight)[0][0] >= boot_s + 4.0
    assert flight.autopilot.truth.position_m[0] > 3.0
    assert flight.states[:2] == ["on the ground", "flying"]


def test_a_vehicle_that_stays_on_the_ground_is_left_alone(calm: Any) -> None:
    flight = SimulatedFlight(*calm, Habits(stays_on_ground=True))
    flight.run(3.0)
    assert not set_points(flight)
    assert flight.states[-1] == "on the ground"


def test_what_is_not_armed_is_on_the_ground_whatever_else_is_said() -> None:
    bench = Bench(sensor=False)
    outcome = bench.tick(1.0, heartbeat(8), attitude(1.0), position(1.0))
    assert outcome.state is LinkState.ON_GROUND
    assert not sent(outcome, SET_POINT)


def test_where_nothing_says_that_it_flies_nothing_is_sent_and_that_is_said() -> None:
    bench = Bench(airborne=False, sensor=False)
    outcome = bench.tick(1.0, heartbeat(), attitude(1.0), position(1.0))
    assert outcome.state is LinkState.ON_GROUND
    assert outcome.why_state == "nothing says that the vehicle is in the air"
    assert bench.tick(1.1, in_the_air(), position(1.1)).state is LinkState.FLYING
    assert bench.tick(1.2, in_the_air(4), position(1.2)).state is LinkState.ON_GROUND


def test_a_pilot_who_hands_back_is_not_chased_after(calm: Any) -> None:
    flight = SimulatedFlight(*calm, Habits(pauses_s=(4.0, 9.0), acceleration_mps2=3.0))
    flight.run(14.0)
    assert "other mode" in flight.states
    assert flight.states[-1] in ("flying", "arrived")
    assert len(flight.leads_m) > 100
    # 0.3 s at 3 m/s, and what it flies in a tick; the plan itself ran on for 15 m meanwhile.
    assert max(flight.leads_m) <= 0.3 * 3.0 + 0.5


def test_handed_back_far_from_the_last_goal_it_is_led_there_and_not_told_to_hold_it() -> None:
    file, setup = mission(
        mission={"name": "near", "waypoints_m": [[12, 0, 7]], "reach_radius_m": 2},
        safety={"margin_m": 2.0},
    )
    habits = Habits(acceleration_mps2=3.0, pauses_s=(9.0, 17.0), led_away_mps=(1.5, 3.0, 0.0))
    flight = SimulatedFlight(file, setup, habits)
    while flight.autopilot.time_s < 9.0:
        flight.step()
    assert flight.states[-1] == "arrived"
    flight.run(60.0)
    assert flight.autopilot.has_arrived
    assert flight.states[-2:] == ["flying", "arrived"]
    goal = np.array([12.0, 0.0, 7.0])
    assert np.linalg.norm(flight.autopilot.truth.position_m - goal) < 1.0
    # An autopilot flies straight to a place that is to be held, as fast as it may.
    assert max(flight.hold_leads_m[180:]) < 4.0


def test_the_floor_is_the_home_plus_the_margin_even_in_an_emergency(calm: Any) -> None:
    file, setup = calm
    # It comes up from behind and below the only way out would be down.
    who = ScriptedIntruder("FAST", 2.0, np.array([20.0, 130.0, 8.5]),
                           np.array([0.0, -20.0, 0.0]), radius_m=6.0, spawn="world")  # fmt: skip
    flight = SimulatedFlight(file, replace(setup, script=(who,)))
    flight.run(20.0)
    assert flight.autopilot.lowest_m >= 5.0 - 0.05
    assert min(p.position_m[2] for o in flight.outcomes if (p := o.set_point) is not None) >= 5.0


def test_the_floor_is_kept_by_a_vehicle_that_brakes_its_sinking_slowly() -> None:
    """As ArduCopter does, at 1 m/s^2: told to sink to the floor at 1.5 m/s it overshot by 1.4 m."""
    file, setup = mission(
        mission={"name": "low", "waypoints_m": [[80, 0, 7]], "reach_radius_m": 4},
        vehicle={"position_m": [0, 0, 7], "speed_mps": 3.0, "kind": "inertialess"},
    )
    velocity = 20.0 * np.array([np.cos(1.3), np.sin(1.3), 0.0])
    meets = np.array([42.0, 0.0, 9.0])
    who = ScriptedIntruder("FAST", 1.0, meets - 13.0 * velocity, velocity, radius_m=6.0,
                           spawn="world")  # fmt: skip
    habits = Habits(acceleration_mps2=2.5, climb_acceleration_mps2=1.0, dead_s=0.3)
    flight = SimulatedFlight(file, replace(setup, script=(who,)), habits)
    flight.run(20.0)
    assert flight.autopilot.lowest_m < 6.0  # It does sink.
    assert flight.autopilot.lowest_m >= 5.0 - 0.05


@pytest.mark.parametrize(("height_m", "said"), [
    (3.5, "refused: goal 1 at 3.5 m is below the floor of 5.0 m (home at 0.0 m"),
])  # fmt: skip
def test_a_goal_below_the_floor_is_refused_with_numbers(height_m: float, said: str) -> None:
    file, setup = mission(
        mission={"name": "low", "waypoints_m": [[40, 0, height_m]], "reach_radius_m": 2},
        vehicle={"position_m": [0, 0, 9], "speed_mps": 3.0},
        safety={"margin_m": 5.0},
    )
    flight = SimulatedFlight(file, setup)
    # The simulated home is put well below a mission that flies low; here it is where it is.
    flight.autopilot.ground_m = 0.0
    flight.run(2.0)
    assert flight.states[-1] == "refused"
    assert any(said.removeprefix("refused: ") in o.why_state for o in flight.outcomes)
    assert not set_points(flight)


def test_without_a_home_it_may_not_pitch() -> None:
    from clearway.live.link.floor import FloorRule

    bench = Bench(sensor=False, floor=FloorRule(5.0))
    outcome = bench.tick(1.0, heartbeat(), attitude(1.0), position(1.0))
    assert outcome.state is LinkState.REFUSED
    assert "no floor" in outcome.why_state
    assert "5 m are to be kept" in outcome.why_state
    home = mavlink.MAVLink_home_position_message(
        520_000_000, 43_000_000, -6_000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0
    )
    origin = mavlink.MAVLink_gps_global_origin_message(520_000_000, 43_000_000, 10_000)
    flying = bench.tick(1.1, origin, home, position(1.1))
    assert flying.state is LinkState.FLYING
    assert bench.session.core.floor_m == pytest.approx(-11.0)


def test_in_free_space_the_height_is_held(calm: Any) -> None:
    flight = SimulatedFlight(*calm, Habits(acceleration_mps2=3.0))
    heights_m = []
    while not flight.autopilot.has_arrived and flight.autopilot.time_s < 30.0:
        flight.step()
        heights_m.append(float(flight.autopilot.truth.position_m[2]))
    assert flight.autopilot.has_arrived
    assert max(abs(height - 7.0) for height in heights_m) <= 0.3


def test_streams_that_come_only_when_asked_for_are_asked_for(calm: Any) -> None:
    flight = SimulatedFlight(*calm, Habits(asks_first=True))
    flight.run(30.0)
    assert flight.autopilot.has_arrived
    assert flight.states[0] == "waiting"


def test_little_is_said_on_a_calm_flight(calm: Any) -> None:
    flight = SimulatedFlight(*calm, Habits(acceleration_mps2=3.0, pauses_s=(6.0, 8.0)))
    flight.run(20.0)
    # Each change of the link's state once, in two pieces at most.
    assert len(flight.autopilot.texts) <= 2 * len(flight.states) + 2


# --- it ends ------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", ["told to end", "sensor dies"])
def test_the_last_set_point_holds(calm: Any, how: str) -> None:
    if how == "told to end":
        flight = SimulatedFlight(*calm, Habits(acceleration_mps2=2.5))
        flight.run(5.0)
        before = flight.autopilot.truth.position_m
        flight.end()
    else:
        file, setup = mission(
            lidar=[{}],
            vehicle={"position_m": [0, 0, 7], "speed_mps": 3.0, "pitch_limit_deg": 0},
            mission={"name": "long", "waypoints_m": [[400, 0, 7]], "reach_radius_m": 2},
        )
        flight = SimulatedFlight(file, setup, Habits(acceleration_mps2=2.5, sensor_dies_s=3.0))
        while flight.states[-1:] != ["sensor lost"]:
            before = flight.autopilot.truth.position_m
            flight.step()
        assert [o for o in flight.outcomes if o.state is LinkState.SENSOR_LOST]
    assert flight.autopilot.target is not None
    assert flight.autopilot.target.velocity_mps is None
    flight.autopilot.fly(flight.autopilot.time_s + 15.0)
    after = flight.autopilot.truth
    assert np.linalg.norm(after.velocity_mps) < 0.05
    # 3 m/s and 2.5 m/s^2: 1.8 m to stop, and the lead. A time-out of 3 s alone is 9 m more.
    assert np.linalg.norm(after.position_m - before) < 4.0


def test_the_loop_holds_whatever_ends_it() -> None:
    from simulated_flight import Wire, looped

    bench, wire = Bench(sensor=False), Wire()
    bench.tick(1.0, heartbeat(), attitude(1.0), position(1.0))
    loop = looped(wire, bench, 0.01)

    def fails(_outcome: Any) -> None:
        raise KeyboardInterrupt

    # The bench's clock is not the loop's: what was led last is all that counts here.
    with pytest.raises(KeyboardInterrupt):
        loop.run(lambda _elapsed, _outcome: False, fails)
    codec = mavlink.MAVLink(None)
    told = [codec.decode(bytearray(data)) for data, _ in wire.told]
    last = [m for m in told if m.get_type() == SET_POINT]
    assert last[-1].type_mask == HOLD


# --- the clock ----------------------------------------------------------------------------------


def test_a_stall_of_a_second_is_got_over() -> None:
    file, setup = mission(
        lidar=[{}],
        vehicle={"position_m": [0, 0, 7], "speed_mps": 3.0, "pitch_limit_deg": 0},
        mission={"name": "long", "waypoints_m": [[400, 0, 7]], "reach_radius_m": 2},
    )
    flight = SimulatedFlight(file, setup, Habits(stall_s=(5.0, 1.0), jitter_s=0.03))
    flight.run(40.0)
    assert flight.counts["distances: no own position of their time"] <= 5
    assert not {"blind", "sensor lost", "position lost"} & set(flight.states)
    last = [o for o in flight.outcomes if o.time_s > flight.outcomes[-1].time_s - 10.0]
    assert {o.state for o in last} == {LinkState.FLYING}
    times = np.diff([o.time_s for o in flight.outcomes])
    assert times.min() >= 0.0


# --- being followed -----------------------------------------------------------------------------


def test_an_autopilot_that_takes_no_set_points_is_noticed_within_two_seconds(calm: Any) -> None:
    flight = SimulatedFlight(*calm, Habits(deaf=True))
    flight.run(5.0)
    first = set_points(flight)[0][0]
    noticed = next(o for o in flight.outcomes if o.state is LinkState.NOT_FOLLOWED)
    assert noticed.time_s - first <= 2.0
    assert noticed.why_state == "the vehicle does not move as commanded"


def test_one_that_follows_slowly_is_not_suspected(calm: Any) -> None:
    flight = SimulatedFlight(*calm, Habits(acceleration_mps2=1.5, timeout_s=1.0))
    flight.run(12.0)
    assert "not followed" not in flight.states


def test_one_that_turns_first_and_gets_going_late_is_not_suspected() -> None:
    # As ArduCopter got going from a hover: half a second after it was told to, at 3 m/s^2.
    file, setup = mission(
        mission={"name": "behind", "waypoints_m": [[-30, -2, 7]], "reach_radius_m": 2},
        vehicle={"position_m": [0, 0, 7], "speed_mps": 1.5, "kind": "inertialess"},
        grid={**CALM["grid"], "range_m": 15},
        safety={"margin_m": 1.0},
    )
    flight = SimulatedFlight(file, setup, Habits(acceleration_mps2=3.0, dead_s=0.5))
    flight.run(8.0)
    assert flight.states == ["flying"]


def test_a_vehicle_that_booted_long_ago_makes_no_clock_leap() -> None:
    bench = Bench(sensor=False)
    for n in range(5):
        bench.session.tick(1000.0 + 0.1 * n)
    bench.tick(500.0, heartbeat(), attitude(500.0), position(500.0))
    assert bench.tick(500.1, attitude(500.1), position(500.1)).state is LinkState.FLYING
    assert not [why for why in bench.session.core.left_out if why.startswith("clock")]


def test_another_target_is_noticed() -> None:
    following = SetPointsFollowed(3.0)
    for n in range(10):
        place = np.array([0.3 * n, 0.0, 0.0])
        following.tell(0.1 * n, place, np.array([3.0, 0.0, 0.0]), place)
    following.hear_target(np.array([1.5, 0.2, 0.0]))
    assert following.flaw is None
    following.hear_target(np.array([80.0, 0.0, 0.0]))
    following.hear_target(np.array([80.0, 0.0, 0.0]))
    assert following.flaw == "the autopilot flies to another target"


# --- sectors of the autopilot's own sensor ------------------------------------------------------


def past_posts(**habits: Any) -> SimulatedFlight:
    """Between posts and out into the open, with the autopilot's own sensor of distances."""
    file, setup = mission(
        mission={"name": "open", "waypoints_m": [[30, 0, 7]], "reach_radius_m": 1.5},
        vehicle={"position_m": [0, 0, 7], "speed_mps": 1.0, "pitch_limit_deg": 0},
        grid={**CALM["grid"], "range_m": 10},
        safety={"margin_m": 0.6},
        lidar=[{"max_range_m": 10}],
    )
    places = [(-6, 0), (6, 6), (-6, 6), (-6, -6), (6, -6), (0, 7), (0, -7), (8, 0.5)]
    posts = [Obstacle.line_between((x, y, 0), (x, y, 14), radius_m=0.3) for x, y in places]
    setup = replace(setup, world=CombinedWorld([ObstacleMap(posts)]))
    return SimulatedFlight(file, setup, Habits(sectors=True, acceleration_mps2=3.0, **habits))


def test_silence_of_a_healthy_sensor_is_free_space() -> None:
    flight = past_posts()
    flight.run(70.0)
    assert flight.autopilot.shown == set(range(8))
    assert flight.autopilot.has_arrived
    assert not {"blind", "sensor lost"} & set(flight.states)
    assert flight.autopilot.nearest_obstacle_m >= 0.6


def test_silence_of_a_sensor_that_is_not_healthy_is_none() -> None:
    flight = past_posts(sensor_dies_s=9.0)
    flight.run(30.0)
    assert flight.states[-2:] == ["blind", "sensor lost"]
