"""Messages into readings: clock, places and attitudes; and set-points back out."""

from __future__ import annotations

import math
from collections import Counter
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from clearway.base.frames import enu_from_geodetic
from clearway.base.state import State
from clearway.live.link.set_point import SetPoint
from clearway.live.link.vehicle_clock import Tick, VehicleClock
from clearway.mavlink.boot_time import WRAP_S, boot_ms, time_of
from clearway.mavlink.mode import status_of
from clearway.mavlink.own_state import OwnPlace
from clearway.mavlink.set_points import FOLLOW, HOLD, encode_set_point
from mavlink_for_tests import ORIGIN, attitude, enu, origin, position

# --- clock --------------------------------------------------------------------------------------


def test_the_least_delay_ties_the_clocks() -> None:
    clock = VehicleClock()
    for time_s, wall_s in ((10.0, 110.2), (11.0, 111.05), (12.0, 112.3)):
        assert clock.take(time_s, wall_s) is Tick.GOOD
    # The second message came soonest, 100.05 s after its time.
    assert clock.now(112.3) == pytest.approx(12.25)
    assert clock.newest_s == 12.0


def test_what_comes_late_is_old_and_time_never_runs_backwards() -> None:
    clock = VehicleClock()
    clock.take(10.0, 100.0)
    assert clock.take(10.1, 103.0) is Tick.GOOD
    assert clock.now(103.0) == pytest.approx(13.0, abs=5e-3)
    assert clock.take(9.5, 103.0) is Tick.GOOD
    assert clock.newest_s == 10.1


def test_the_counter_of_milliseconds_may_wrap() -> None:
    clock = VehicleClock()
    last = (2**32 - 500) / 1000.0
    assert clock.take(time_of(2**32 - 500, 0.0 + last), 0.0) is Tick.GOOD
    assert clock.take(time_of(500, clock.newest_s), 1.0) is Tick.GOOD
    assert clock.newest_s == pytest.approx(WRAP_S + 0.5)
    assert boot_ms(clock.newest_s) == 500


def test_one_stray_time_is_left_out_and_a_new_one_is_a_restart() -> None:
    clock = VehicleClock()
    clock.take(100.0, 100.0)
    assert clock.take(3.0, 100.1) is Tick.STRAY
    assert clock.take(100.2, 100.2) is Tick.GOOD
    ticks = [clock.take(1.0 + 0.1 * n, 100.3 + 0.1 * n) for n in range(5)]
    assert ticks == [Tick.STRAY] * 4 + [Tick.RESTARTED]
    assert clock.newest_s == 100.2


def test_a_restart_after_weeks_is_no_wrap() -> None:
    clock = VehicleClock()
    clock.take(WRAP_S - 1000.0, 0.0)
    told = [time_of(900_000 + n, clock.newest_s) for n in range(5)]
    assert [clock.take(time_s, 1.0) for time_s in told][-1] is Tick.RESTARTED


def test_a_leap_ahead_is_believed_when_it_lasts() -> None:
    clock = VehicleClock()
    clock.take(10.0, 10.0)
    ticks = [clock.take(30.0 + 0.1 * n, 10.1 + 0.1 * n) for n in range(6)]
    assert ticks == [Tick.STRAY] * 4 + [Tick.LEAPT, Tick.GOOD]
    assert clock.now(10.6) == pytest.approx(30.5, abs=1e-2)


def test_in_lock_step_time_stands_still_between_messages() -> None:
    clock = VehicleClock(None)
    clock.take(10.0, 10.0)
    assert clock.now(99.0) == 10.0
    assert clock.take(10.1, 500.0) is Tick.GOOD
    assert clock.now(500.0) == 10.1


# --- position and attitude ----------------------------------------------------------------------


def place_of(counts: Counter[str] | None = None, mission_origin: Any = None) -> OwnPlace:
    return OwnPlace(mission_origin, Counter() if counts is None else counts)


def test_north_east_down_becomes_east_north_up() -> None:
    place = place_of()
    place.take_attitude(attitude(1.0, heading_deg=90.0), 1.0)
    motion = place.take_local(position(1.0, (3, 4, -5), (0.5, 2, -1)), 1.0, 1.5)
    assert motion is not None
    assert motion.position_m == pytest.approx([4, 3, 5])
    assert motion.velocity_mps == pytest.approx([2, 0.5, 1])
    assert motion.heading_rad == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("velocity_ned", "pitch_deg", "yaw_deg"),
    [
        ((0, 2, 0), 0.0, 0.0),
        ((2, 0, 0), 0.0, 90.0),
        ((0, 2, 2), 45.0, 0.0),  # going down is pitch above 0
        ((0, -2, -2), -45.0, 180.0),
        ((0.1, 0.1, 0), 0.0, 30.0),  # slower than the least speed: the heading, level
        ((0, 0, -2), -90.0, 30.0),
    ],
)
def test_the_attitude_is_that_of_the_flight_path(
    velocity_ned: Any, pitch_deg: float, yaw_deg: float
) -> None:
    place = place_of()
    place.take_attitude(attitude(1.0, heading_deg=60.0), 1.0)
    motion = place.take_local(position(1.0, velocity_ned=velocity_ned), 1.0, 1.5)
    assert motion is not None
    state = motion.state(0.3)
    assert np.degrees(state.attitude_rad) == pytest.approx([0.0, pitch_deg, yaw_deg], abs=1e-4)


def test_positions_without_attitude_or_that_are_no_numbers_are_counted() -> None:
    counts: Counter[str] = Counter()
    place = place_of(counts)
    assert place.take_local(position(1.0), 1.0, 1.5) is None
    place.take_attitude(attitude(1.0), 1.0)
    assert place.take_local(position(3.0), 3.0, 1.5) is None
    assert place.take_local(position(1.0, (math.nan, 0, 0)), 1.0, 1.5) is None
    assert place.take_local(position(1.0, velocity_ned=(math.inf, 0, 0)), 1.0, 1.5) is None
    place.take_attitude(attitude(1.5, math.nan), 1.5)
    assert dict(counts) == {
        "position: no attitude to go with it": 2,
        "position: not finite": 2,
        "attitude: not finite": 1,
    }


def global_position(time_s: float, place: Any, velocity_cm: Any = (0, 100, 0)) -> Any:
    latitude, longitude, height = place
    return mavlink.MAVLink_global_position_int_message(
        round(1000 * time_s), round(latitude * 1e7), round(longitude * 1e7),
        round(height * 1e3), 0, *velocity_cm, 0,
    )  # fmt: skip


def test_the_origin_comes_outright_or_by_a_pair_of_positions_or_by_the_home() -> None:
    outright, pair, home = place_of(), place_of(), place_of()
    outright.take_origin(origin())
    pair.take_attitude(attitude(1.0), 1.0)
    pair.take_local(position(1.0, (100, 50, -10)), 1.0, 1.5)
    there = [52.00089877, 4.30072826, 20.0]
    assert pair.take_global(global_position(1.02, there), 1.02, 1.5) is None
    told = [round(there[0] * 1e7), round(there[1] * 1e7), round(there[2] * 1e3)]
    local = [100.0, 50.0, -10.0]
    home.take_home(
        mavlink.MAVLink_home_position_message(*told, *local, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0)
    )
    for place in (outright, pair, home):
        assert place.origin_geodetic is not None
        assert enu_from_geodetic(place.origin_geodetic, ORIGIN) == pytest.approx(
            [0, 0, 0], abs=0.02
        )


def test_global_positions_stand_in_for_local_ones() -> None:
    place = place_of()
    place.take_origin(origin())
    place.take_attitude(attitude(1.0), 1.0)
    motion = place.take_global(global_position(1.0, (52.0009, 4.3, 15.0)), 1.0, 1.5)
    assert motion is not None
    assert motion.position_m == pytest.approx([0.0, 100.14, 5.0], abs=0.02)
    assert motion.velocity_mps == pytest.approx([1.0, 0.0, 0.0])
    assert place.take_local(position(1.2), 1.2, 1.5) is not None
    assert place.take_global(global_position(1.3, (52.0009, 4.3, 15.0)), 1.3, 1.5) is None


def test_a_mission_with_a_place_is_flown_there_whatever_the_local_origin_is() -> None:
    counts: Counter[str] = Counter()
    place = place_of(counts, ORIGIN)
    place.take_attitude(attitude(1.0), 1.0)
    assert place.take_local(position(1.0), 1.0, 1.5) is None
    assert place.world_from_local_m is None
    place.take_origin(origin((52.0009, 4.3, 12.0)))
    motion = place.take_local(position(1.1, (10, 0, 0)), 1.1, 1.5)
    assert motion is not None
    assert motion.position_m == pytest.approx([0.0, 110.14, 2.0], abs=0.02)
    assert counts == {"position: no origin of the local frame yet": 1}


@pytest.mark.parametrize(
    ("autopilot", "kind", "base", "custom", "follows"),
    [
        (0, 2, 8, 0, True),
        (0, 2, 1, 0, False),
        (3, 2, 89, 4, True),  # ArduCopter GUIDED, and AUTO, which sets the flag as well
        (3, 2, 89, 3, False),
        (3, 13, 89, 4, True),
        (3, 1, 89, 15, False),  # ArduPlane GUIDED takes no set-points in the local frame
        (3, 1, 89, 4, False),
        (12, 2, 157, 6 << 16, True),  # PX4 OFFBOARD and AUTO
        (12, 2, 157, 4 << 16 | 4 << 24, False),
    ],
)
def test_modes_that_follow_set_points(
    autopilot: int, kind: int, base: int, custom: int, follows: bool
) -> None:
    told = mavlink.MAVLink_heartbeat_message(kind, autopilot, base, custom, 4, 3)
    assert status_of(told).follows is follows


# --- set-points ---------------------------------------------------------------------------------


def test_a_set_point_follows_the_plan_in_the_autopilot_s_frame() -> None:
    state = enu(5.0, 2.0, 10.0, 0.0, math.radians(-30.0), math.radians(90.0))
    following = SetPoint.following(State(state[:3], state[3:]), 2.0)
    message = encode_set_point(following, enu(1.0, -1.0, 4.0), 1234, 7, 1)
    assert (message.x, message.y, message.z) == pytest.approx((3.0, 4.0, -6.0))
    climb = 2.0 * math.cos(math.radians(30.0))
    assert (message.vx, message.vy, message.vz) == pytest.approx((climb, 0.0, -1.0), abs=1e-9)
    assert message.yaw == pytest.approx(0.0, abs=1e-9)
    assert message.type_mask == FOLLOW == 0b1001_1100_0000
    assert message.coordinate_frame == mavlink.MAV_FRAME_LOCAL_NED
    assert (message.time_boot_ms, message.target_system, message.target_component) == (1234, 7, 1)


def test_holding_leaves_the_velocity_out() -> None:
    message = encode_set_point(SetPoint.holding(enu(5.0, 2.0, 10.0), 0.0), np.zeros(3), 0, 1, 1)
    assert message.type_mask == HOLD == 0b1001_1111_1000
    assert (message.x, message.y, message.z) == (2.0, 5.0, -10.0)
    assert message.yaw == pytest.approx(math.pi / 2)


def test_masks_are_those_of_the_dialect() -> None:
    bits = SimpleNamespace(
        **{n.removeprefix("POSITION_TARGET_TYPEMASK_"): getattr(mavlink, n)
           for n in dir(mavlink) if n.startswith("POSITION_TARGET_TYPEMASK_")}
    )  # fmt: skip
    still = bits.AX_IGNORE | bits.AY_IGNORE | bits.AZ_IGNORE | bits.YAW_RATE_IGNORE
    assert still == FOLLOW
    assert still | bits.VX_IGNORE | bits.VY_IGNORE | bits.VZ_IGNORE == HOLD
