"""What a session asks for, answers, and says of what is missing, wrong or strange."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from clearway.base.frames import geodetic_from_enu
from clearway.io.samples.plans import write_plan_sample
from clearway.io.toml import parse_model
from clearway.live.link.floor import FloorRule
from clearway.live.link.session import Session
from clearway.mavlink import dialect as known
from clearway.mavlink.distances import BODY_FRD
from clearway.mavlink.inbox import Inbox
from clearway.mavlink.outbox import Outbox, Packer
from clearway.mavlink.parameters import Parameters
from clearway.mavlink.set_points import HOLD
from clearway.mavlink.setup import fill_in_answers, read_led_mission
from clearway.mavlink.streams import Streams, streams_for
from clearway.mavlink.surroundings import Surroundings
from clearway.missions.mission_file import MissionFile
from clearway.missions.mission_sections import VehicleSection
from mavlink_for_tests import (
    KEY,
    ORIGIN,
    PEER,
    SENSOR,
    Bench,
    attitude,
    distances,
    framed,
    heartbeat,
    origin,
    position,
    sent,
)

# --- streams ------------------------------------------------------------------------------------


def test_it_asks_for_what_does_not_come_one_at_a_time_and_again_later() -> None:
    streams = Streams(streams_for(act=True, pitches=True, sensor=False), asks=True)
    asked = [message for n in range(40) for message in streams.to_ask(0.1 * n, 1, 1)]
    numbers = [int(message.param1) for message in asked]
    assert len(numbers) == len(set(numbers))
    assert {30, 32, 245, 242, 246} <= set(numbers)
    assert all((message.command, message.target_component) == (511, 1) for message in asked)
    interval = {int(message.param1): message.param2 for message in asked}
    assert interval[32] == pytest.approx(1e5)
    for n in range(40, 80):
        streams.hear(32, 0.1 * n)
        later = [int(message.param1) for message in streams.to_ask(0.1 * n, 1, 1)]
        assert 32 not in later
    assert not Streams(streams_for(act=False, pitches=True, sensor=False), asks=False).to_ask(
        9.0, 1, 1
    )


def answer(command: int, result: int, component: int = 196) -> Any:
    return mavlink.MAVLink_command_ack_message(command, result, 0, 0, 1, component)


def test_what_is_refused_and_not_needed_is_asked_for_once_a_minute() -> None:
    streams = Streams(streams_for(act=True, pitches=True, sensor=True), asks=True)
    asked: list[int] = []
    for n in range(500):
        for message in streams.to_ask(0.1 * n, 1, 1):
            number = int(message.param1)
            asked.append(number)
            # ArduPilot sends no OBSTACLE_DISTANCE of its own; all else is accepted, and lost.
            streams.hear_answer(answer(511, 2 if number == known.OBSTACLE_DISTANCE else 0))
    assert asked.count(known.OBSTACLE_DISTANCE) == 1
    assert asked.count(known.HOME_POSITION) >= 9


def test_what_others_are_refused_is_not_what_we_asked_for() -> None:
    streams = Streams(streams_for(act=True, pitches=True, sensor=False), asks=True)
    (first,) = streams.to_ask(0.0, 1, 1)
    assert first.param1 == known.ATTITUDE
    streams.hear_answer(answer(400, 4))
    streams.hear_answer(answer(511, 2, component=190))
    assert "asked for" in streams.how(("ATTITUDE",))
    assert not streams.to_ask(0.1, 1, 1)  # Its own answer is waited for, but not for ever.
    (second,) = streams.to_ask(0.4, 1, 1)
    assert second.param1 != first.param1
    streams.hear_answer(answer(511, 2))
    assert "denied" in streams.how(("LOCAL_POSITION_NED",))


def test_what_is_missing_is_said_every_five_seconds_with_its_parameters() -> None:
    bench = Bench(sensor=False, asks=True, airborne=False)
    notes = [
        note
        for n in range(120)
        for note in bench.tick(0.1 * n, heartbeat(), attitude(0.1 * n)).notes
    ]
    missing = [note for note in notes if "missing: " in note]
    assert 2 <= len(missing) <= 3
    assert (
        "hears ATTITUDE; missing: LOCAL_POSITION_NED (asked for; SRn_POSITION, or " in missing[-1]
    )
    assert "MAVn_POSITION from ArduPilot 4.7" in missing[-1]
    # No stream of ArduCopter has it, whatever SRn_EXT_STAT is.
    assert "EXTENDED_SYS_STATE (asked for; SET_MESSAGE_INTERVAL alone brings it)" in missing[-1]


def test_read_only_asks_nothing() -> None:
    bench = Bench(act=False, sensor=False)
    for n in range(30):
        told = bench.tick(0.1 * n, heartbeat()).messages
        assert {message.get_type() for message in told} <= {"HEARTBEAT"}


def test_who_else_sends_is_said() -> None:
    box = Inbox(1, 1, None, stream=False)
    box.take([(framed(heartbeat(), system=9), PEER), (framed(heartbeat(), component=100), PEER)])
    (said,) = box.strangers()
    assert said.startswith("hears system 9, other components; waits for system 1, component 1")


def test_an_old_protocol_is_named() -> None:
    old = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    box = Inbox(1, 1, None, stream=False)
    assert not box.take([(heartbeat().pack(old, force_mavlink1=True), PEER)])
    assert "hears MAVLink 1, which is refused" in box.strangers()[0]


# --- who we are ---------------------------------------------------------------------------------


def test_another_program_with_our_component_id_is_noticed_and_our_own_echo_is_not() -> None:
    outbox = Outbox(Packer(1), lambda _frame: True)
    box = Inbox(1, 1, None, stream=False, is_ours=outbox.is_ours)
    seen: list[bytes] = []
    echoing = Outbox(Packer(1), lambda frame: bool(seen.append(frame)) or True)
    outbox._lately = echoing._lately
    echoing.send([heartbeat()])
    assert not box.take([(seen[0], PEER)])
    assert not box.warnings
    box.take([(framed(heartbeat(base_mode=0), component=196), PEER)])
    assert "another program uses component 196" in box.warnings[0]


def test_signed_frames_without_a_key_are_said_once() -> None:
    box = Inbox(1, 1, None, stream=False)
    for _ in range(3):
        assert box.take([(framed(heartbeat(), key=KEY), PEER)])
    (said,) = box.warnings
    assert "signed and there is no --signing-key" in said


def ask(bench: Bench, message: Any, system: int = 255, component: int = 190) -> list[Any]:
    bench.tell(1002.0, message, system=system, component=component)
    return list(bench.session.tick(1002.0).messages)


def flying_bench(**more: Any) -> Bench:
    bench = Bench(sensor=False, **more)
    bench.tick(2.0, heartbeat(), origin(), attitude(2.0), position(2.0))
    return bench


def test_it_says_who_it_is_and_acknowledges_what_is_asked() -> None:
    bench = flying_bench()
    request = mavlink.MAVLink_command_long_message(1, 196, 512, 0, 148, 0, 0, 0, 0, 0, 0)
    told = ask(bench, request)
    (ack,) = [m for m in told if m.get_type() == "COMMAND_ACK"]
    assert (ack.command, ack.result) == (512, 0)
    assert (ack.target_system, ack.target_component) == (255, 190)
    assert [m for m in told if m.get_type() == "AUTOPILOT_VERSION"]
    unknown = mavlink.MAVLink_command_long_message(1, 196, 400, 0, 1, 0, 0, 0, 0, 0, 0)
    (ack,) = [m for m in ask(bench, unknown) if m.get_type() == "COMMAND_ACK"]
    assert (ack.command, ack.result) == (400, 3)
    of_others = mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)
    assert not [m for m in ask(bench, of_others) if m.get_type() == "COMMAND_ACK"]


def test_it_tells_its_time() -> None:
    bench = flying_bench()
    told = ask(bench, mavlink.MAVLink_timesync_message(0, 123_456), system=1, component=1)
    (answer,) = [m for m in told if m.get_type() == "TIMESYNC"]
    assert answer.ts1 == 123_456
    assert answer.tc1 > 0


# --- another goal -------------------------------------------------------------------------------


@pytest.mark.parametrize("how", ["command", "target"])
def test_a_new_goal_takes_the_mission_s_place(how: str) -> None:
    bench = flying_bench()
    place = geodetic_from_enu(np.array([0.0, 25.0, 3.0]), np.array(ORIGIN))
    whole = [round(place[0] * 1e7), round(place[1] * 1e7)]
    if how == "command":
        message = mavlink.MAVLink_command_int_message(
            1, 196, 5, 192, 0, 0, -1, 0, 0, math.nan, *whole, place[2]
        )
    else:
        message = mavlink.MAVLink_set_position_target_global_int_message(
            0, 1, 196, 5, 0xFF8, *whole, place[2], *[0.0] * 8
        )
    bench.tell(1002.1, message, system=255, component=190)
    outcome = bench.session.tick(1002.1)
    assert any("a new goal" in note for note in outcome.notes)
    assert bench.system.mission.goals_m == pytest.approx(np.array([[0.0, 25.0, 3.0]]), abs=0.05)
    assert outcome.flight is not None
    assert set(outcome.flight.movements) & {"Left", "Up-Left", "Down-Left"}


def reposition(north_m: float, height_m: float, kind: str) -> Any:
    """DO_REPOSITION to the autopilot, as ground stations send it."""
    place = geodetic_from_enu(np.array([0.0, north_m, height_m]), np.array(ORIGIN))
    if kind == "long":
        return mavlink.MAVLink_command_long_message(1, 1, 192, 0, -1, 1, 0, math.nan, *place)
    whole = [round(place[0] * 1e7), round(place[1] * 1e7)]
    return mavlink.MAVLink_command_int_message(
        1, 1, 5, 192, 0, 0, -1, 1, 0, math.nan, *whole, place[2]
    )


@pytest.mark.parametrize("kind", ["int", "long"])
def test_what_a_ground_station_tells_the_autopilot_is_the_new_goal(kind: str) -> None:
    """The next set-point would call the vehicle back."""
    bench = flying_bench()
    bench.tell(1002.1, reposition(25.0, 3.0, kind), system=255, component=190)
    outcome = bench.session.tick(1002.1)
    assert any("DO_REPOSITION to the autopilot: a new goal" in note for note in outcome.notes)
    # Single precision of COMMAND_LONG is half a metre on Earth.
    goals = bench.system.mission.goals_m
    assert goals == pytest.approx(np.array([[0.0, 25.0, 3.0]]), abs=0.05 if kind == "int" else 1.0)
    assert not sent(outcome, "COMMAND_ACK")  # The autopilot's own answer counts.


@pytest.mark.parametrize("nowhere", ["no place", "below the floor"])
def test_what_cannot_be_flown_to_pauses(nowhere: str) -> None:
    """PX4's ground stations pause by a place that is none."""
    if nowhere == "no place":
        bench = flying_bench()
        asked = mavlink.MAVLink_command_long_message(1, 1, 192, 0, -1, 1, 0, *[math.nan] * 4)
    else:
        bench = flying_bench(floor=FloorRule(0.6, -5.0))
        asked = reposition(25.0, -20.0, "int")
    bench.tell(1002.1, asked, system=255, component=190)
    outcome = bench.session.tick(1002.1)
    assert any("pauses, and holds its place" in note for note in outcome.notes)
    held = bench.tick(2.2, heartbeat(), attitude(2.2), position(2.2))
    (point,) = sent(held, "SET_POSITION_TARGET_LOCAL_NED")
    assert point.type_mask == HOLD
    assert [point.x, point.y, point.z] == pytest.approx([0.0, 0.0, 0.0])


def test_who_only_watches_leaves_the_mission_as_it_is() -> None:
    bench = flying_bench(act=False)
    bench.tell(1002.1, reposition(25.0, 3.0, "int"), system=255, component=190)
    bench.session.tick(1002.1)
    assert bench.system.mission.goals_m[-1] == pytest.approx([30.0, 0.0, 0.0])


def test_a_goal_that_cannot_be_is_denied_with_the_reason() -> None:
    bench = flying_bench()
    lost = mavlink.MAVLink_command_int_message(1, 196, 6, 192, 0, 0, 0, 0, 0, 0, 1, 1, 5.0)
    bench.tell(1002.1, lost, system=255)
    outcome = bench.session.tick(1002.1)
    (ack,) = sent(outcome, "COMMAND_ACK")
    assert ack.result == 2
    assert any("refused, the place of the local frame, or of the home" in n for n in outcome.notes)
    assert bench.system.mission.goals_m[-1] == pytest.approx([30.0, 0.0, 0.0])


@pytest.mark.parametrize("place_e7", [(0, 0), (0, 2**31 - 1), (900_000_001, 0), (-(2**31),) * 2])
@pytest.mark.parametrize("height_m", [5.0, 3e38, -3e38, math.nan, math.inf])
@pytest.mark.parametrize("how", ["command", "target"])
def test_a_goal_that_is_nowhere_is_refused(
    how: str, height_m: float, place_e7: tuple[int, int]
) -> None:
    bench = flying_bench()
    if how == "command":
        message = mavlink.MAVLink_command_int_message(
            1, 196, 5, 192, 0, 0, -1, 0, 0, 0, *place_e7, height_m
        )
    else:
        message = mavlink.MAVLink_set_position_target_global_int_message(
            0, 1, 196, 5, 0xFF8, *place_e7, height_m, *[0.0] * 8
        )
    bench.tell(1002.1, message, system=255, component=190)
    outcome = bench.session.tick(1002.1)
    assert any("refused, " in note for note in outcome.notes)
    assert bench.system.mission.goals_m[-1] == pytest.approx([30.0, 0.0, 0.0])


# --- how a copter answers -----------------------------------------------------------------------


def filled_in(**vehicle: Any) -> tuple[VehicleSection, list[str]]:
    tables = {"mission": {"name": "m", "waypoints_m": [[40, 0, 7]]}, "vehicle": vehicle}
    said: list[str] = []
    file = fill_in_answers(parse_model("m", tables, MissionFile), said.append)
    return file.vehicle, said


def test_a_copter_answers_as_autopilots_do_where_its_mission_does_not_state_how() -> None:
    vehicle, said = filled_in(kind="multirotor", speed_mps=3.0)
    assert (vehicle.acceleration_mps2, vehicle.lag_s) == (2.0, 0.3)
    assert "vehicle.acceleration_mps2 = 2, vehicle.lag_s = 0.3" in said[0]
    assert vehicle.speed_mps == 3.0
    assert vehicle.to_automaton().step_m > 0.0


def test_what_a_mission_states_of_its_copter_is_kept() -> None:
    vehicle, said = filled_in(kind="multirotor", speed_mps=3.0, acceleration_mps2=4.0)
    assert (vehicle.acceleration_mps2, vehicle.lag_s) == (4.0, 0.3)
    assert "acceleration" not in said[0]
    _, said = filled_in(kind="multirotor", acceleration_mps2=4.0, lag_s=0.0)
    assert not said
    for kind in ("plane", "inertialess"):
        vehicle, said = filled_in(kind=kind)
        assert not said
        assert vehicle.lag_s is None


def test_a_plan_is_led_as_a_copter_that_keeps_its_heights(tmp_path: Path) -> None:
    write_plan_sample(tmp_path / "p.plan", np.random.default_rng(0))
    said: list[str] = []
    vehicle = read_led_mission(str(tmp_path / "p.plan"), said.append).vehicle
    assert (vehicle.kind, vehicle.acceleration_mps2, vehicle.lag_s) == ("multirotor", 2.0, 0.3)
    assert any('vehicle.kind = "multirotor"' in note for note in said)
    (tmp_path / "own.toml").write_text('[mission]\nplan = "p.plan"\n[vehicle]\nkind = "plane"\n')
    assert read_led_mission(str(tmp_path / "own.toml"), said.append).vehicle.kind == "plane"


# --- parameters ---------------------------------------------------------------------------------


def parameter(name: str, value: float) -> Any:
    return mavlink.MAVLink_param_value_message(name.encode(), value, 9, 1, 0)


def test_parameters_are_held_against_the_mission() -> None:
    parameters = Parameters()
    asked = parameters.to_ask(0.0, 1, 1)
    assert {message.param_id for message in asked} >= {"GUID_TIMEOUT", "WPNAV_SPEED"}
    for name, value in (("GUID_TIMEOUT", 3.0), ("WPNAV_SPEED", 200.0), ("AVD_ENABLE", 1.0)):
        parameters.hear(parameter(name, value))
    said = parameters.news(3.0)
    assert "flies on for 9.0 m at 3 m/s" in said[0]
    assert "WPNAV_SPEED allows 2 m/s, the mission asks for 3 m/s" in said[1]
    assert "AVD_ENABLE is 1" in said[2]
    assert not parameters.news(3.0)
    # Keeping to fences is what the docs ask for; the way ahead is ours.
    for value, told in ((1.0, []), (3.0, ["AVOID_ENABLE is 3"]), (2.0, ["AVOID_ENABLE is 2"])):
        parameters.hear(parameter("AVOID_ENABLE", value))
        assert [words.partition(":")[0] for words in parameters.news(3.0)] == told
    asked_again = [m.param_id for n in range(1, 9) for m in parameters.to_ask(3.0 * n, 1, 1)]
    assert "GUID_TIMEOUT" not in asked_again
    assert Counter(asked_again)["CP_DIST"] == 2


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("WPNAV_ACCEL", 250.0, "WPNAV_ACCEL allows 2.5 m/s2, the mission asks for 3"),
        ("WP_ACC", 2.5, "WP_ACC allows 2.5 m/s2, the mission asks for 3"),
        ("WPNAV_ACCEL", 300.0, None),
        ("PSC_JERK_XY", 5.0, "3 m/s2 take 0.6 s to come about"),
        ("PSC_JERK_NE", 5.0, "set it to 20"),
        ("PSC_JERK_NE", 7.5, None),
        ("PSC_JERK_XY", 20.0, None),
    ],
)
def test_accelerations_of_the_autopilot_are_held_against_the_plan(
    name: str, value: float, told: str | None
) -> None:
    parameters = Parameters()
    assert name in {message.param_id for message in parameters.to_ask(0.0, 1, 1)}
    parameters.hear(parameter(name, value))
    assert not parameters.findings(5.0)  # Of a vehicle without inertia.
    found = parameters.findings(5.0, 3.0)
    assert bool(found) == (told is not None)
    assert told is None or told in found[0]


# --- other distances ----------------------------------------------------------------------------


def placed(told: list[Any]) -> np.ndarray[Any, Any]:
    """Returns of a scan made of messages, vehicle level with its nose east."""
    bench = Bench()
    bench.tick(1.0, heartbeat(), origin(), attitude(1.0), position(1.0))
    surroundings = Surroundings(bench.session.core, SENSOR, bench.counts)
    for message in told:
        if message.get_type() == "DISTANCE_SENSOR":
            surroundings.take_sector(message, 1.0, 1001.0)
        else:
            surroundings.take_obstacle(message, 1.0)
    surroundings.flush(1001.0)
    (scan,) = bench.session.core._scans.place_waiting()
    far = np.linalg.norm(scan.points_m, axis=1) > 0.0075
    assert isinstance(bench.session.core, Session)
    return scan.points_m[far]


def sector(orientation: int, centimetres: int, fov: float = 0.0) -> Any:
    return mavlink.MAVLink_distance_sensor_message(
        1000, 20, 1000, centimetres, 0, 0, orientation, 0, fov, 0.0, [0.0] * 4
    )


def test_eight_distance_sensors_are_a_circle() -> None:
    told = [sector(n, 400 if n == 2 else 1000) for n in range(8)]
    points = placed(told)
    # The third of eight is to the right.
    azimuth = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
    assert azimuth.min() >= -90.0 - 25.1
    assert azimuth.max() <= -90.0 + 25.1
    assert np.ptp(azimuth) >= 43.9
    assert np.linalg.norm(points, axis=1) == pytest.approx(4.0)


def test_a_narrow_sensor_says_nothing_of_what_is_beside_its_beam() -> None:
    points = placed([sector(0, 400, fov=math.radians(5.0))])
    azimuth = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
    assert np.abs(azimuth).max() <= 2.6


def test_single_obstacles_are_points_where_they_are() -> None:
    told = mavlink.MAVLink_obstacle_distance_3d_message(
        1000, 0, BODY_FRD, 65_535, 4.0, 2.0, -1.0, 0.2, 20.0
    )
    points = placed([told])
    assert points == pytest.approx(np.array([[4.0, -2.0, 1.0]]), abs=1e-6)


def test_distance_sensors_of_a_flight_count() -> None:
    bench = Bench()
    told = [sector(n, 300 if n == 0 else 1000) for n in range(8)]
    outcome = bench.tick(1.0, heartbeat(), origin(), attitude(1.0), position(1.0), *told)
    assert outcome.flight is not None
    assert str(outcome.flight.mode) == "avoidance"
    assert bench.tick(1.1, distances(1.1)).state is outcome.state


# --- places -------------------------------------------------------------------------------------


def test_places_are_the_same_with_and_without_an_origin_heard() -> None:
    """The autopilot's metres are 0.33 % longer than geodesy's, as ArduPilot's are in places."""
    north_m, mission_origin = 2000.0, ORIGIN
    there = geodetic_from_enu(np.array([0.0, north_m, 5.0]), np.array(ORIGIN))
    pair = mavlink.MAVLink_global_position_int_message(
        1000, round(there[0] * 1e7), round(there[1] * 1e7), round(there[2] * 1e3),
        round(1e3 * 15.0), 0, 0, 0, 0,
    )  # fmt: skip
    local = position(1.0, (1.0033 * north_m, 0.0, -5.0))
    found = []
    for heard in ((), (origin(),)):
        bench = Bench(sensor=False, mission_origin=mission_origin)
        bench.tick(0.9, heartbeat(), *heard, attitude(0.9))
        bench.tick(1.0, attitude(1.0), local, pair)
        bench.tick(1.05, attitude(1.05), position(1.05, (1.0033 * north_m, 0.0, -5.0)))
        motion = bench.session.core.motion
        assert motion is not None
        found.append(motion.position_m)
        assert bench.session.place.ground_m == pytest.approx(-10.0, abs=0.02)
    assert found[0] == pytest.approx(found[1], abs=1e-6)
    assert found[0] == pytest.approx([0.0, north_m, 5.0], abs=0.05)
