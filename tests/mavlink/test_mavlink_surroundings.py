"""What messages say of the surroundings: sectors of distance sensors, and traffic."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.state import State
from clearway.live.link.aircraft import MOST_AIRCRAFT, AircraftHeard, TrafficTerms
from clearway.live.link.own_motion import OwnMotion
from clearway.mavlink.adsb import read_adsb_aircraft
from clearway.mavlink.distances import Sectors, make_sector_scan, sector_lidar
from clearway.mavlink.remote_id import drone_of
from mavlink_for_tests import ORIGIN, SENSOR, aircraft, distances, drone, enu

# --- distances ----------------------------------------------------------------------------------


def sectors_of(message: Any) -> Sectors:
    sectors = Sectors.of(message, Counter())
    assert sectors is not None
    return sectors


def returns(scan: Any) -> Any:
    """Points of real returns, and how many beams ended within the blind range."""
    far = np.linalg.norm(scan.points_m, axis=1) > 0.0075
    return scan.points_m[far], int((~far).sum())


def test_sectors_are_clockwise_from_ahead() -> None:
    scan = make_sector_scan(
        sectors_of(distances(1.0, {18: 500})), SENSOR, State(np.zeros(3)), 0.0, Counter()
    )
    points, ended = returns(scan)
    # Sector 18 of 5 degrees is to the right: five beams of one degree, at 5 m, level.
    assert ended == 0
    assert points[:, 1] == pytest.approx(-5.0 * np.cos(np.radians([-2, -1, 0, 1, 2])), abs=0.02)
    assert np.abs(points[:, 0]).max() < 5.0 * np.sin(np.radians(2.6))
    assert points[:, 2] == pytest.approx(0.0)


def test_unknown_sectors_are_no_free_space_and_empty_ones_are() -> None:
    scan = make_sector_scan(
        sectors_of(distances(1.0, {0: 65_535, 1: 1_001, 2: 1_000, 3: 0})),
        SENSOR,
        State(np.zeros(3)),
        0.0,
        Counter(),
    )
    points, ended = returns(scan)
    assert ended == 5
    distance = np.linalg.norm(points, axis=1)
    assert np.sort(distance) == pytest.approx([0.01] * 5 + [10.0] * 5)


@given(
    heading=st.floats(-3.1, 3.1), course=st.floats(-3.1, 3.1), sector=st.integers(0, 71),
    offset=st.floats(-180.0, 180.0), from_north=st.booleans(),
)  # fmt: skip
def test_returns_lie_where_the_sector_says_whatever_the_course(
    heading: float, course: float, sector: int, offset: float, from_north: bool
) -> None:
    told = distances(1.0, {sector: 400}, offset=offset, frame=0 if from_north else 12)
    state = State(enu(7.0, -3.0, 5.0), enu(0.0, 0.0, course))
    points, _ = returns(make_sector_scan(sectors_of(told), SENSOR, state, heading, Counter()))
    world = points @ state.world_from_body.T
    clockwise = math.radians(offset + 5.0 * sector)
    towards = math.pi / 2 - clockwise if from_north else heading - clockwise
    middle = enu(math.cos(towards), math.sin(towards), 0.0)
    assert len(points) in (4, 5, 6)
    assert (world @ middle).min() >= 4.0 * math.cos(math.radians(2.5)) - 1e-6


def test_finer_and_fewer_sectors() -> None:
    told = distances(1.0, {0: 300, 71: 300}, increment=0, increment_f=1.25, offset=-44.375)
    points, ended = returns(
        make_sector_scan(sectors_of(told), SENSOR, State(np.zeros(3)), 0.0, Counter())
    )
    azimuth = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
    assert azimuth.max() == pytest.approx(44.5)
    assert azimuth.min() == pytest.approx(-44.5)
    assert ended == 360 - 90


def test_a_level_sensor_sees_nothing_along_a_steep_path_and_a_fan_does() -> None:
    climbing = State(np.zeros(3), enu(0.0, math.radians(-15.0), 0.0))
    told = sectors_of(distances(1.0, {0: 500}))
    points, ended = returns(make_sector_scan(told, SENSOR, climbing, 0.0, Counter()))
    assert len(points) == 0
    assert ended > 200
    wide = sector_lidar(10.0, math.radians(30.0))
    points, _ = returns(make_sector_scan(told, wide, climbing, 0.0, Counter()))
    world = points @ climbing.world_from_body.T
    assert len(points) > 20
    assert np.linalg.norm(world, axis=1) == pytest.approx(5.0)
    assert np.degrees(np.arcsin(world[:, 2] / 5.0)).max() < 18.1


def test_a_sensor_that_ends_early_clears_nothing() -> None:
    counts: Counter[str] = Counter()
    told = sectors_of(distances(1.0, {0: 300}, reach=600))
    points, ended = returns(make_sector_scan(told, SENSOR, State(np.zeros(3)), 0.0, counts))
    assert len(points) == 5
    assert ended == 355
    assert counts == {"distances: sensor ends before the mission's range": 1}


def test_messages_without_use_are_counted() -> None:
    counts: Counter[str] = Counter()
    unknown = distances(1.0, dict.fromkeys(range(72), 65_535))
    assert Sectors.of(unknown, counts) is None
    assert Sectors.of(distances(1.0, increment=0), counts) is None
    assert Sectors.of(distances(1.0, increment_f=math.nan), counts) is None
    assert Sectors.of(distances(1.0, increment_f=1e-30), counts) is None
    assert Sectors.of(distances(1.0, offset=math.inf), counts) is None
    assert Sectors.of(distances(1.0, reach=0), counts) is None
    assert Sectors.of(distances(1.0, frame=8), counts) is None
    assert dict(counts) == {"distances: no sector is known": 6, "distances: of another frame": 1}


# --- traffic ------------------------------------------------------------------------------------

OWN = OwnMotion(10.0, np.zeros(3), enu(1.0, 0.0, 0.0), 0.0)


def picture(**settings: Any) -> tuple[AircraftHeard, Counter[str]]:
    counts: Counter[str] = Counter()
    return AircraftHeard(TrafficTerms(**settings), counts), counts


def taken(view: AircraftHeard, message: Any, now_s: float = 10.0) -> Any:
    height = float(OWN.position_m[2])
    report = read_adsb_aircraft(message, np.array(ORIGIN), height, view._counts)
    return None if report is None else view.take(report, now_s, OWN)


def test_a_report_becomes_an_intruder_of_the_world_frame() -> None:
    view, counts = picture(position_std_m=0.5, velocity_std_mps=0.2, extra_radius_m=3.0)
    intruder = taken(view, aircraft(tslc=2, climb=-50))
    assert intruder.position_m == pytest.approx([6.0, 8.0, 0.0], abs=0.02)
    assert intruder.velocity_mps == pytest.approx([0.0, -1.0, -0.5], abs=1e-9)
    assert intruder.time_s == 8.0
    assert intruder.radius_m == 4.0
    assert (intruder.position_std_m, intruder.velocity_std_mps) == (0.5, 0.2)
    assert intruder.name == intruder.address == "abcdef"
    assert not counts


def test_flags_decide_what_is_used() -> None:
    view, counts = picture()
    assert taken(view, aircraft(flags=0)) is None
    assert taken(view, aircraft(lat=2**31 - 1)) is None
    assert taken(view, aircraft(climb=300, flags=1 | 2 | 4 | 8)).velocity_mps[2] == 0.0
    low = taken(view, aircraft(1, height_mm=-5_000, flags=1 | 4 | 8))
    assert low.position_m[2] == OWN.position_m[2]
    assert taken(view, aircraft(2, type=0)) is not None
    assert dict(counts) == {
        "traffic: no position": 2,
        "traffic: no altitude, taken at our height": 1,
        "traffic: altitude by pressure": 1,
    }


def test_without_a_velocity_two_positions_make_one() -> None:
    view, counts = picture()
    assert taken(view, aircraft(flags=1 | 2), 10.0) is None
    second = taken(view, aircraft(flags=1 | 2, lat=520_000_719 - 180), 11.0)
    assert second.velocity_mps == pytest.approx([0.0, -2.0, 0.0], abs=0.02)
    assert dict(counts) == {"traffic: no velocity yet": 1}


def test_our_own_echo_is_left_out_by_address_and_by_place() -> None:
    view, counts = picture(own_address=0xABCDEF)
    assert taken(view, aircraft()) is None
    echo = aircraft(0x111111, lat=520_000_000, lon=43_000_000, heading=9_000)
    by_place, more = picture()
    assert taken(by_place, echo) is None
    assert counts == more == {"traffic: own echo": 1}
    # With the address known, whoever else is in our place is no echo.
    assert taken(view, echo) is not None


def test_old_impossible_and_far_reports_are_left_out() -> None:
    view, counts = picture(reach_m=10.0, horizon_s=10.0)
    assert taken(view, aircraft(tslc=11)) is None
    assert taken(view, aircraft(speed=60_000)) is None
    assert taken(view, aircraft(lat=521_000_000)) is None
    assert read_adsb_aircraft(aircraft(), np.array(ORIGIN), None, counts) is None
    assert read_adsb_aircraft(aircraft(), None, 0.0, counts) is None
    assert dict(counts) == {
        "traffic: stale": 1,
        "traffic: impossible": 1,
        "traffic: too far to meet": 1,
        "traffic: no origin of the local frame yet": 2,
    }


def test_no_more_aircraft_than_decisions_can_take_and_the_gone_make_room() -> None:
    view, counts = picture()
    told = [taken(view, aircraft(number)) for number in range(1, 101)]
    assert sum(intruder is not None for intruder in told) == MOST_AIRCRAFT
    assert counts == {f"traffic: more than {MOST_AIRCRAFT} aircraft": 100 - MOST_AIRCRAFT}
    assert taken(view, aircraft(200), now_s=21.0) is not None


# --- Remote ID ------------------------------------------------------------------------------------


def told(message: Any, geoid_m: float | None = 48.0) -> tuple[Any, Counter[str]]:
    counts: Counter[str] = Counter()
    return drone_of(message, np.array(ORIGIN), 3.0, geoid_m, counts), counts


def test_a_drone_nearby_is_an_aircraft_as_wide_as_it_is_unsure() -> None:
    report, counts = told(drone(climb=-50))
    assert report.position_m == pytest.approx([6.0, 8.0, 0.0], abs=0.02)
    assert report.velocity_mps == pytest.approx([0.0, -1.0, -0.5], abs=1e-9)
    assert report.half_span_m == 4.0
    assert report.address > 0xFFFFFF
    assert told(drone(accuracy=0))[0].half_span_m == 31.0
    assert told(drone(direction=36_100))[0].velocity_mps is None
    assert not counts


def test_a_drone_at_an_unknown_height_counts_at_ours() -> None:
    for message, geoid_m, why in (
        (drone(), None, "Remote ID: height above the ellipsoid"),
        (drone(height_m=-1000.0), 48.0, "traffic: no altitude"),
        (drone(height_m=math.nan), 48.0, "traffic: no altitude"),
    ):
        report, counts = told(message, geoid_m)
        assert report.position_m[2] == 3.0
        assert [one.startswith(why) for one in counts] == [True]


@pytest.mark.parametrize(
    ("message", "why"),
    [
        (drone(sender=b""), "Remote ID: our own"),
        (drone(status=1), "Remote ID: on the ground"),
        (drone(lat=0, lon=0), "traffic: no position"),
    ],
)
def test_drones_that_are_nowhere_or_ours_are_counted(message: Any, why: str) -> None:
    report, counts = told(message)
    assert report is None
    assert dict(counts) == {why: 1}
