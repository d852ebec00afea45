"""The guardian: nobody flies into anything through it, and what is safe passes unchanged."""

from __future__ import annotations

import math

import numpy as np
import pytest

import clearway as cw
from clearway.base.errors import ClearwayError, InputError
from clearway.live.guard.wish import PathWish
from clearway.sensors import Scan
from guarded_flights import BODY_M, HOLD_S, MARGIN_M, GuardedFlight, planner_for

WALL = cw.ObstacleMap([cw.Obstacle.cuboid([3.0, 0.0, 0.0], (1.0, 9.0, 9.0))])
"""From x = 2.5 on."""


def guardian_at(place=(0.0, 0.0, 0.0), vehicle: str = "stops", **arguments) -> cw.Guardian:
    here = cw.State(np.array(place))
    at_once = {"acceleration_mps2": np.inf}  # As the vehicles of these flights do.
    arguments = {"obstacle_map": WALL, "hold_s": HOLD_S} | at_once | arguments
    guardian = cw.Guardian(planner_for(vehicle, "known"), here, **arguments)
    guardian.update(here)
    return guardian


def kept(flight: GuardedFlight, margin_m: float) -> None:
    assert flight.least_m >= margin_m, f"{flight.least_m:.3f} m from a surface"
    assert flight.lost == 0
    assert flight.unsafe_passed == 0
    assert flight.safe_passed >= 0.99 * flight.safe


@pytest.mark.parametrize("vehicle", ["stops", "flies on"])
def test_hostile_commands_end_in_no_collision_and_safe_ones_pass(vehicle: str) -> None:
    flight = GuardedFlight(3, vehicle, ticks=120)
    kept(flight, MARGIN_M - 0.02)
    assert flight.safe > 10, "there were commands to pass"
    assert flight.passed < 110, "there were commands to stop"


def test_nor_where_only_a_sensor_tells_what_is_there() -> None:
    flight = GuardedFlight(4, "stops", ticks=60, with_lidar=True)
    kept(flight, BODY_M)
    assert flight.passed > 5


def test_taking_in_before_a_command_comes_changes_nothing_of_what_is_flown() -> None:
    flights = [
        GuardedFlight(5, "flies on", ticks=40, with_lidar=True, ahead=ahead)
        for ahead in (False, True)
    ]
    assert flights[0].passed == flights[1].passed > 5
    assert np.array_equal(flights[0].track, flights[1].track)


@pytest.mark.nightly
@pytest.mark.parametrize("vehicle", ["stops", "flies on"])
@pytest.mark.parametrize("seed", range(100, 120))
def test_ten_thousand_hostile_commands(seed: int, vehicle: str) -> None:
    kept(GuardedFlight(seed, vehicle, ticks=500), MARGIN_M - 0.02)


@pytest.mark.nightly
@pytest.mark.parametrize("vehicle", ["stops", "flies on"])
@pytest.mark.parametrize("seed", range(200, 210))
def test_two_thousand_past_what_only_a_sensor_sees(seed: int, vehicle: str) -> None:
    kept(GuardedFlight(seed, vehicle, ticks=200, with_lidar=True), BODY_M)


def test_a_wish_passes_up_to_where_the_margin_ends_and_no_farther() -> None:
    asked = np.array([1.0, 0.0, 0.0])
    last_m = 2.5 - MARGIN_M - HOLD_S
    assert guardian_at((last_m - 1e-6, 0.0, 0.0)).guard_velocity(asked, 0.0).passed
    out = guardian_at((last_m + 1e-3, 0.0, 0.0)).guard_velocity(asked, 0.0)
    assert not out.passed
    assert "of the map" in out.why
    assert out.nearest
    assert out.velocity_mps == pytest.approx([0.95, 0.0, 0.0])
    assert out.changed_mps == pytest.approx(0.05)
    at_margin = guardian_at((2.5 - MARGIN_M - 1e-3, 0.0, 0.0)).guard_velocity(asked, 0.0)
    assert at_margin.decision is not None, "nothing near the wish keeps the margin"
    assert at_margin.changed_mps is not None
    assert at_margin.changed_mps >= 1.0
    sideways = guardian_at((1.89, 0.0, 0.0)).guard_velocity([0.0, 1.0, 0.0], 0.0)
    assert sideways.passed, "along the wall"
    assert sideways.velocity_mps.tolist() == [0.0, 1.0, 0.0]


def test_a_wish_along_a_wall_and_into_it_is_turned_along_it() -> None:
    """The nearest velocity: as the part along the wall, and no slower than that is."""
    wish = np.array([math.cos(math.radians(60.0)), math.sin(math.radians(60.0)), 0.0])
    out = guardian_at((1.89, 0.0, 0.0)).guard_velocity(wish, 0.0)
    assert out.nearest
    assert out.velocity_mps[1] >= 0.7
    assert abs(out.velocity_mps[0]) < 0.1
    assert out.changed_mps is not None
    assert out.changed_mps == pytest.approx(np.linalg.norm(out.velocity_mps - wish))


def test_braking_takes_room() -> None:
    """At 1 m/s and 0.5 m/s^2 a metre more."""
    asked, own = np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0])
    last_m = 2.5 - MARGIN_M - HOLD_S - 1.0
    for off_m, passes in ((-0.02, True), (0.02, False)):
        guardian = guardian_at((last_m + off_m, 0.0, 0.0), acceleration_mps2=0.5)
        out = guardian.guard_velocity(asked, 0.0, own_velocity_mps=own)
        assert out.passed is passes


def test_what_is_too_fast_is_slowed() -> None:
    out = guardian_at().guard_velocity([0.0, 30.0, 0.0], 0.0)
    assert not out.passed
    assert out.why.startswith("slowed to 1 m/s")
    assert out.velocity_mps == pytest.approx([0.0, 1.0, 0.0])


def test_what_cannot_stop_is_told_so_and_circles() -> None:
    guardian = guardian_at((-20.0, 0.0, 0.0), "flies on")
    out = guardian.guard_velocity(np.zeros(3), 0.0)
    assert not out.passed
    assert "stands still" in out.why
    places = np.array([guardian.state_at(t).position_m for t in np.arange(0.0, 100.0, 0.5)])
    assert np.linalg.norm(places - [-20.0, 0.0, 0.0], axis=1).max() < 30.0


def test_a_path_passes_until_it_leads_into_something() -> None:
    path = np.array([[-5.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    first = guardian_at((-2.0, 0.1, 0.0)).guard_path(path, 0.0)
    assert first.passed
    assert first.velocity_mps[0] > 0.7
    into = guardian_at((1.5, 0.0, 0.0)).guard_path([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]], 0.0)
    assert not into.passed


def test_who_falls_silent_is_held_for() -> None:
    guardian = guardian_at()
    guardian.guard_velocity([1.0, 0.0, 0.0], 0.0)
    for time_s in (0.2, 0.5, 60.0):
        assert guardian.state_at(time_s).position_m[0] == pytest.approx(min(time_s, HOLD_S))
    guardian.update(cw.State(np.array([0.5, 0.0, 0.0]), time_s=1.0))
    out = guardian.guard(None, 1.0)
    assert not out.passed
    assert np.linalg.norm(out.velocity_mps) == pytest.approx(0.0, abs=1e-9)


def test_an_aircraft_is_dodged_though_nobody_asks() -> None:
    guardian = guardian_at(obstacle_map=None)
    coming = cw.Intruder(np.array([6.0, 0.0, 0.0]), np.array([-1.5, 0.0, 0.0]), radius_m=0.3)
    guardian.update(coming)
    guardian.guard_velocity([0.2, 0.0, 0.0], 0.0)
    places = []
    for tick in range(1, 60):
        now = 0.1 * tick
        state = guardian.state_at(now)
        guardian.update(state)
        guardian.guard_velocity([0.2, 0.0, 0.0], now)
        places.append(np.linalg.norm(state.position_m - (6.0 - 1.5 * now, 0.0, 0.0)) - 0.3)
    assert min(places) >= MARGIN_M - 0.05


def test_a_floor_is_kept() -> None:
    guardian = guardian_at((0.0, 0.0, 5.0), obstacle_map=None)
    guardian.floor_m = 4.8
    assert guardian.guard_velocity([0.0, 0.0, -0.3], 0.0).passed
    out = guardian.guard_velocity([0.0, 0.0, -0.5], 0.0)
    assert not out.passed
    assert "below the floor of 4.8 m" in out.why


def test_a_dip_below_the_floor_on_the_way_does_not_pass_either() -> None:
    guardian = guardian_at((0.0, 0.0, 5.0), obstacle_map=None)
    guardian.floor_m = 4.8
    up_again = [[0.0, 0.0, 5.0], [0.05, 0.0, 4.75], [0.1, 0.0, 5.0]]
    out = guardian.guard_path(up_again, 0.0, speed_mps=1.0)
    assert not out.passed
    assert "below the floor of 4.8 m" in out.why
    guardian.floor_m = 5.0
    assert guardian.guard_velocity([0.3, 0.2, 0.0], 0.0).passed, "along the floor"


@pytest.mark.parametrize(
    ("problem", "wish"),
    [
        ("velocity_mps", lambda g: g.guard_velocity([np.nan, 0.0, 0.0], 0.0)),
        ("velocity_mps", lambda g: g.guard_velocity([1.0, 0.0], 0.0)),
        ("yaw_rate_rps", lambda g: g.guard_velocity(np.zeros(3), 0.0, yaw_rate_rps=np.inf)),
        ("places_m", lambda g: g.guard_path(np.zeros((0, 3)), 0.0)),
        ("places_m", lambda g: g.guard_path([[np.inf, 0.0, 0.0]], 0.0)),
        ("speed_mps", lambda g: g.guard_path([[1.0, 0.0, 0.0]], 0.0, speed_mps=0.0)),
        ("own_velocity_mps", lambda g: g.guard(None, 0.0, own_velocity_mps=[np.nan] * 3)),
    ],
)
def test_what_is_no_wish_is_refused(problem: str, wish) -> None:
    with pytest.raises(InputError, match=problem):
        wish(guardian_at())


def test_who_has_no_way_out_gets_no_guardian() -> None:
    planner = planner_for("stops", "off")
    with pytest.raises(ClearwayError, match="no escape is asked for"):
        cw.Guardian(planner, cw.State(np.zeros(3)))
    with pytest.raises(ClearwayError, match="no state estimate"):
        cw.Guardian(planner_for("stops", "known"), cw.State(np.zeros(3))).guard(None, 0.0)
    for wrong in ({"hold_s": 0.0}, {"acceleration_mps2": -1.0}):
        with pytest.raises(InputError):
            guardian_at(**wrong)


def test_unusable_readings_are_counted() -> None:
    guardian = guardian_at()
    assert not guardian.receive(cw.State, np.array([np.nan, 0.0, 0.0]))
    guardian.update(Scan(np.zeros((3, 3)), 0.0, sensor="nobody"))
    guardian.guard_velocity([0.1, 0.0, 0.0], 0.0)
    assert guardian.counts.total() == 2


def test_a_path_ahead_begins_where_the_vehicle_is() -> None:
    corners = PathWish(np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0]]), 1.0)
    ahead = corners.ahead_of(np.array([3.0, 1.0, 0.0]), 3.0)
    assert ahead[0].tolist() == [3.0, 1.0, 0.0]
    gone = np.linalg.norm(np.diff(ahead, axis=0), axis=1).sum()
    assert gone == pytest.approx(3.0)
