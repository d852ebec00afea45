"""Sessions: every state of docs/mavlink.md, what is decided and sent in it, floods and silence."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.live import AvoidanceSystem
from clearway.live.link.link_state import LinkFacts, LinkLimits, LinkState, link_state
from clearway.live.mission import Mode
from clearway.mavlink.inbox import KEPT
from clearway.mavlink.set_points import HOLD
from mavlink_for_tests import (
    BEAT,
    COLLISION,
    SET_POINT,
    Bench,
    aircraft,
    attitude,
    distances,
    drone,
    framed,
    heartbeat,
    mavlink,
    origin,
    position,
    raw_frame,
    sent,
    words,
)
from repository import REPOSITORY

# --- the table ----------------------------------------------------------------------------------

GOOD: dict[str, Any] = {"heartbeat_age_s": 0.5, "position_age_s": 0.1, "distances_age_s": 0.1}


@pytest.mark.parametrize(
    ("state", "facts"),
    [
        ("waiting", {"heartbeat_age_s": math.inf}),
        ("waiting", {"position_age_s": math.inf}),
        ("waiting", {"distances_age_s": math.inf}),
        ("flying", {}),
        ("flying", {"heartbeat_age_s": 2.9}),
        ("flying", {"distances_age_s": None}),
        ("ageing", {"position_age_s": 0.6}),
        ("blind", {"distances_age_s": 3.1}),
        ("sensor lost", {"distances_age_s": 6.1}),
        ("stale position", {"position_age_s": 1.6}),
        ("stale position", {"position_age_s": 1.6, "distances_age_s": 3.1}),
        ("position lost", {"position_age_s": 3.1}),
        ("link lost", {"heartbeat_age_s": 3.1}),
        ("link lost", {"heartbeat_age_s": 3.1, "position_age_s": 9.0, "arrived": True}),
        ("arrived", {"arrived": True}),
        ("arrived", {"arrived": True, "distances_age_s": 60.0, "position_age_s": 2.0}),
        ("position lost", {"arrived": True, "position_age_s": 3.1}),
        ("autopilot restarted", {"restarted": True, "heartbeat_age_s": math.inf}),
        ("on the ground", {"airborne": False, "arrived": True, "mode_follows": False}),
        ("refused", {"refused": True, "arrived": True, "position_age_s": 2.0}),
        ("other mode", {"mode_follows": False, "followed": False}),
        ("blind", {"mode_follows": False, "distances_age_s": 3.1}),
        ("not followed", {"followed": False}),
    ],
)
def test_the_state_that_facts_make(state: str, facts: dict[str, Any]) -> None:
    assert link_state(LinkFacts(**{**GOOD, **facts}), LinkLimits()) == state


@pytest.mark.parametrize(
    ("state", "decides", "steers"),
    [
        (LinkState.WAITING, False, False),
        (LinkState.FLYING, True, True),
        (LinkState.AGEING, True, True),
        (LinkState.BLIND, True, True),
        (LinkState.STALE, False, True),
        (LinkState.POSITION_LOST, False, False),
        (LinkState.SENSOR_LOST, False, False),
        (LinkState.LINK_LOST, False, False),
        (LinkState.RESTARTED, False, False),
        (LinkState.ARRIVED, False, True),
        (LinkState.ON_GROUND, False, False),
        (LinkState.REFUSED, False, False),
        (LinkState.OTHER_MODE, True, True),
        (LinkState.NOT_FOLLOWED, True, True),
    ],
)
def test_what_a_state_allows(state: LinkState, decides: bool, steers: bool) -> None:
    assert (state.decides, state.steers) == (decides, steers)


# --- waiting and flying -------------------------------------------------------------------------


def test_nothing_is_decided_before_all_is_there() -> None:
    bench = Bench()
    assert bench.tick(1.0).state is LinkState.WAITING
    assert bench.tick(1.1, heartbeat()).state is LinkState.WAITING
    assert bench.tick(1.2, position(1.2)).state is LinkState.WAITING
    waiting = bench.tick(1.3, attitude(1.3), position(1.3))
    assert waiting.state is LinkState.WAITING
    assert waiting.set_point is waiting.flight is None
    flying = bench.tick(1.4, distances(1.4))
    assert flying.state is LinkState.FLYING
    assert flying.flight is not None


def test_a_free_way_is_flown_straight_towards_the_goal() -> None:
    outcome = Bench().all_well(1.0)
    (point,) = sent(outcome, SET_POINT)
    # East along x; the plan half a tick ahead at 1 m/s.
    assert (point.x, point.y, point.z) == pytest.approx((0.0, 0.05, 0.0), abs=1e-6)
    assert (point.vx, point.vy, point.vz) == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    assert point.yaw == pytest.approx(math.pi / 2)
    assert point.time_boot_ms == 1000


def test_what_the_sectors_show_is_flown_round() -> None:
    bench = Bench()
    ahead = dict.fromkeys((71, 0, 1), 500)
    outcome = bench.all_well(1.0, sectors=ahead)
    assert outcome.flight is not None
    assert outcome.flight.mode is Mode.AVOIDANCE
    assert set(outcome.flight.movements) & {"Left", "Right"}
    assert outcome.flight.decision.choice.clearance_m >= 0.6
    assert "avoidance: " in words(outcome)


def test_late_distances_are_placed_where_the_vehicle_was() -> None:
    bench = Bench(act=False)
    # It flies east until 2.0 s, then turns north within 0.2 s; what was 5 m ahead stays east.
    bench.all_well(1.0)
    path = [(1.9, (0, 0.9, 0), 90.0, (0, 1, 0)), (2.1, (0.1, 1.0, 0), 0.0, (1, 0, 0))]
    for t, place, heading, velocity in path:
        bench.tell(1000.0 + t, attitude(t, heading), position(t, place, velocity))
    outcome = bench.tick(2.1, heartbeat(), distances(1.9, {0: 500}))
    assert outcome.flight is not None
    points = outcome.flight.decision.hazards.points.position_m
    world = points @ outcome.flight.state.world_from_body.T + outcome.flight.state.position_m
    assert np.median(world[:, 0]) == pytest.approx(5.9, abs=0.15)
    assert np.abs(world[:, 1]).max() < 0.35


def test_unknown_ahead_is_not_rated_free() -> None:
    bench = Bench()
    outcome = bench.all_well(1.0, sectors=dict.fromkeys(range(-9, 10), 65_535))
    assert outcome.flight is not None
    cells = outcome.flight.decision.cells
    assert cells.evidence.visibility.max() == 0.0


def test_read_only_sends_nothing_but_our_heartbeat() -> None:
    bench = Bench(act=False)
    outcomes = [bench.all_well(1.0 + 0.1 * n, ned=(0.0, 0.1 * n, 0.0)) for n in range(30)]
    kinds = {message.get_type() for outcome in outcomes for message in outcome.messages}
    assert kinds == {BEAT}
    assert all(outcome.set_point is not None for outcome in outcomes)
    assert sum(len(outcome.messages) for outcome in outcomes) == 3


def test_heartbeats_tell_whether_we_steer() -> None:
    bench = Bench()
    states = [bench.tick(0.0), bench.all_well(1.0), bench.tick(9.0)]
    assert [sent(outcome, BEAT)[0].system_status for outcome in states] == [3, 4, 5]


# --- why ----------------------------------------------------------------------------------------


def test_an_aircraft_on_a_collision_course_is_avoided_and_told_of() -> None:
    bench = Bench(sensor=False)
    # From 8 m north and 8 m east southwards at 1 m/s: both are at [8, 0] after 8 s.
    closing = aircraft(lon=43_001_165)
    bench.tick(1.0, heartbeat(), origin(), attitude(1.0), position(1.0))
    outcome = bench.tick(1.1, attitude(1.1), position(1.1, (0, 0.1, 0)), closing)
    assert outcome.flight is not None
    assert outcome.flight.decision.intruders == ("abcdef",)
    assert outcome.flight.decision.choice.clearance_m >= 0.6
    (told,) = sent(outcome, COLLISION)
    assert told.id == 0xABCDEF
    assert told.src == 0
    assert told.threat_level == 2
    assert told.time_to_minimum_delta == pytest.approx(8.0, abs=0.2)
    assert told.horizontal_minimum_delta == pytest.approx(0.0, abs=0.2)
    assert told.altitude_minimum_delta == pytest.approx(0.0, abs=0.1)
    soon = bench.tick(1.2, attitude(1.2), position(1.2, (0, 0.2, 0)), closing)
    assert not sent(soon, COLLISION)


def test_a_drone_heard_by_remote_id_is_avoided_at_its_height() -> None:
    bench = Bench(sensor=False)
    closing = drone(lon=43_001_165, accuracy=12)
    fix = mavlink.MAVLink_gps_raw_int_message(
        0, 3, 520_000_000, 43_000_000, 10_000, 80, 80, 100, 9000, 12, 58_000
    )
    bench.tick(1.0, heartbeat(), origin(), attitude(1.0), position(1.0), fix)
    outcome = bench.tick(1.1, attitude(1.1), position(1.1, (0, 0.1, 0)), closing)
    assert outcome.flight is not None
    (name,) = outcome.flight.decision.intruders
    (told,) = sent(outcome, COLLISION)
    assert told.id == int(name, 16) > 0xFFFFFF
    assert told.altitude_minimum_delta == pytest.approx(0.0, abs=0.1)
    assert not any(reason.startswith("Remote ID") for reason in bench.session.counts)


def test_an_aircraft_that_flies_away_is_not_told_of() -> None:
    bench = Bench(sensor=False)
    bench.tick(1.0, heartbeat(), origin(), attitude(1.0), position(1.0))
    outcome = bench.tick(1.1, attitude(1.1), position(1.1, (0, 0.1, 0)), aircraft(heading=0))
    assert not sent(outcome, COLLISION)


# --- arrived ------------------------------------------------------------------------------------


def test_the_last_goal_is_held() -> None:
    bench = Bench(waypoints=((3.0, 4.0, 5.0),))
    outcome = bench.all_well(1.0, ned=(4.0, 3.0, -4.8))
    assert outcome.state is LinkState.ARRIVED
    (point,) = sent(outcome, SET_POINT)
    assert (point.x, point.y, point.z) == (4.0, 3.0, -5.0)
    assert point.type_mask == HOLD


# --- floods -------------------------------------------------------------------------------------


def test_a_flood_of_50_000_messages_neither_stops_nor_moves_the_flight() -> None:
    bench = Bench()
    bench.all_well(1.0)
    flood = [framed(aircraft(number % 2**24, lat=520_000_719 + number)) for number in range(5_000)]
    for n in range(1, 11):
        t = 1.0 + 0.1 * n
        # Heartbeat and position came first, and everything else after them.
        good = framed(heartbeat(), attitude(t), position(t, (0, 0.1 * n, 0)), distances(t))
        bench.hear(1000.0 + t, good, *flood)
        outcome = bench.session.tick(1000.0 + t)
        assert outcome.state is LinkState.FLYING
        assert sent(outcome, SET_POINT)
    assert outcome.flight is not None
    assert len(outcome.flight.decision.intruders) <= 64
    flooded = bench.inbox.refused["flood: more than can be used"]
    assert flooded + bench.inbox.received["ADSB_VEHICLE"] == 50_000
    assert bench.inbox.received["LOCAL_POSITION_NED"] == 11


FIELDS = st.lists(
    st.tuples(st.sampled_from(sorted(KEPT)), st.binary(min_size=1, max_size=60)), max_size=12
)


@settings(max_examples=60)
@given(told=FIELDS, stretched=st.booleans())
def test_whatever_fields_say_nothing_breaks(told: list[tuple[int, bytes]], stretched: bool) -> None:
    assert_unbroken(told, stretched=stretched)


@pytest.mark.nightly
@settings(max_examples=200)
@given(told=FIELDS, stretched=st.booleans())
def test_whatever_many_fields_say_nothing_breaks(
    told: list[tuple[int, bytes]], stretched: bool
) -> None:
    assert_unbroken(told, stretched=stretched)


def assert_unbroken(told: list[tuple[int, bytes]], *, stretched: bool) -> None:
    """No set-point holds what is no number."""
    bench = Bench()
    bench.all_well(1.0)
    for step, (number, payload) in enumerate(told):
        # Long messages need more than a few bytes to say much.
        bench.hear(1001.0, raw_frame(number, payload * 4 if stretched else payload))
        outcome = bench.tick(1.0 + 0.1 * step)
        for message in sent(outcome, SET_POINT):
            assert np.isfinite([message.x, message.y, message.z, message.vx, message.yaw]).all()


def test_traffic_while_nothing_is_decided_does_not_pile_up() -> None:
    bench = Bench(waypoints=((0.0, 0.0, 0.0),))
    bench.all_well(1.0)
    for n in range(20):
        t = 1.1 + 0.1 * n
        bench.tick(t, *(aircraft(number) for number in range(100)))
    assert isinstance(bench.system, AvoidanceSystem)
    assert len(bench.session.core._reports) <= 64
    assert len(bench.session.core._intruders) <= 64


def test_the_table_in_the_documentation_lists_every_state_in_the_order_that_counts() -> None:
    page = (REPOSITORY / "docs/mavlink.md").read_text()
    table = page.split("| state | when |")[1].split("\n\n")[0]
    names = [line.split("|")[1].strip() for line in table.splitlines()[2:]]
    assert sorted(names) == sorted(LinkState)
    worst = {
        "restarted": True, "heartbeat_age_s": math.inf, "position_age_s": 9.0,
        "distances_age_s": 9.0, "arrived": True, "airborne": False, "refused": True,
        "mode_follows": False, "followed": False,
    }  # fmt: skip
    steps = [
        {}, {"restarted": False}, {"heartbeat_age_s": 9.0}, {"heartbeat_age_s": 0.0},
        {"position_age_s": 2.0}, {"airborne": True}, {"refused": False, "arrived": False},
        {"arrived": True}, {"arrived": False, "distances_age_s": 4.0}, {"position_age_s": 1.0},
        {"distances_age_s": 0.0}, {"position_age_s": 0.0}, {"mode_follows": True},
        {"followed": True},
    ]  # fmt: skip
    found = [str(LinkState.RELIEVED)]  # Before all others, and not a matter of the link's facts.
    for step in steps:
        worst |= step
        found.append(str(link_state(LinkFacts(**worst), LinkLimits())))
    assert found == names


def test_who_flies_fast_for_what_the_sensor_sees_is_stopped_sooner_when_it_falls_silent() -> None:
    slow, fast = LinkLimits().seeing(10.0, 0.5), LinkLimits().seeing(12.0, 3.0)
    assert slow == LinkLimits()
    assert (fast.blind_s, fast.sensor_lost_s) == (1.0, 2.0)
    assert LinkLimits().seeing(10.0, 50.0).sensor_lost_s == 1.0
