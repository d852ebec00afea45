"""A copter with inertia led over MAVLink: past a mast, answering late, with a clock that stalls."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pymavlink", reason="needs the packages of [mavlink]")

from clearway.live.link.link_state import LinkState
from clearway.live.link.set_point import SetPoint
from clearway.mavlink.simulated_habits import Habits
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from companion_missions import mission
from simulated_flight import SimulatedFlight

MARGIN_M, BODY_M = 1.0, 0.3
THICK_M = 3.0
"""Level distances 5 degrees apart show no thinner thing from afar: nothing thinner stands here."""
MAST = ObstacleMap(
    [Obstacle.line_between([30.0, 0.5, 0.0], [30.0, 0.5, 20.0], radius_m=0.5 * THICK_M)]
)
TILTS = Habits(tilt_s=0.15, acceleration_mps2=4.5)


def led(
    speed_mps: float, habits: Habits | None, *, sees: bool = True, **vehicle: float
) -> SimulatedFlight:
    file, setup = mission(
        mission={"name": "mast", "waypoints_m": [[60, 0, 7]], "reach_radius_m": 2},
        vehicle={"kind": "multirotor", "position_m": [0, 0, 7], "speed_mps": speed_mps} | vehicle,
        grid={"range_m": 30, "layers": 10},
        safety={"margin_m": MARGIN_M, "smallest_object_m": THICK_M},
        lidar=[{"max_range_m": 30.0}] if sees else [],
    )
    world = MAST if sees else ObstacleMap([])
    return SimulatedFlight(file, replace(setup, world=world), habits, fan_deg=30.0)


def off_plan_m(flight: SimulatedFlight, until_s: float) -> list[float]:
    """How far the vehicle was off what was asked for, tick by tick, until it arrived."""
    off: list[float] = []
    while flight.autopilot.time_s < until_s and not flight.autopilot.has_arrived:
        here, outcome = flight.autopilot.truth.position_m, flight.step()
        asked = flight.session.core.system.reference_at(outcome.time_s)
        if asked is not None and outcome.state is LinkState.FLYING:
            off.append(float(np.linalg.norm(asked.position_m - here)))
    return off


def last_target(flight: SimulatedFlight) -> Any:
    return flight.autopilot.target


@pytest.mark.parametrize("speed_mps", [pytest.param(5.0, marks=pytest.mark.nightly), 10.0])
def test_it_flies_past_a_mast_at_speed(speed_mps: float) -> None:
    """By set-points with velocity and acceleration, so that it keeps near its plan."""
    flight = led(speed_mps, None)
    off = off_plan_m(flight, 60.0)
    assert flight.autopilot.has_arrived
    assert flight.autopilot.nearest_obstacle_m >= MARGIN_M
    assert 0.85 * speed_mps <= flight.autopilot.fastest_mps <= 1.15 * speed_mps
    assert np.percentile(off, 90) <= 0.35 + 0.03 * speed_mps
    sent = [o.set_point for o in flight.outcomes if o.set_point is not None]
    moving = [point for point in sent if point.velocity_mps is not None]
    assert all(point.acceleration_mps2 is not None for point in moving)
    assert max(float(np.linalg.norm(p.acceleration_mps2)) for p in moving) > 2.0


def test_one_that_answers_late_is_given_more_room() -> None:
    late = Habits(tilt_s=0.3, acceleration_mps2=3.5, dead_s=0.2)
    flight = led(5.0, late)
    flight.run(90.0)
    assert flight.autopilot.has_arrived
    assert flight.autopilot.nearest_obstacle_m >= BODY_M
    margins = [o.flight.decision.margin_m for o in flight.outcomes if o.flight is not None]
    assert max(margins) > MARGIN_M + 0.1
    core = flight.session.core
    assert core.system.counts["state: outside the tube of its plan"] > 0
    assert core._lead.seconds > 0.05  # And is told earlier.


LAME = Habits(tilt_s=0.15, acceleration_mps2=2.5, jerk_mps3=5.0)
BRISK = Habits(tilt_s=0.2, acceleration_mps2=5.0, jerk_mps3=20.0)
"""ArduCopter in GUIDED with WPNAV_ACCEL and PSC_JERK_XY at their defaults, and as docs ask for."""


def test_jerk_has_a_copter_leave_its_tube_and_what_docs_ask_for_keeps_it_within() -> None:
    as_it_comes = led(3.0, LAME, sees=False)
    as_asked_for = led(3.0, BRISK, sees=False, acceleration_mps2=2.0, lag_s=0.3)
    for flight in (as_it_comes, as_asked_for):
        flight.run(10.0)
        assert flight.autopilot.fastest_mps >= 0.9 * 3.0
    outside = "state: outside the tube of its plan"
    assert as_it_comes.session.core.system.counts[outside] >= 3
    assert as_asked_for.session.core.system.counts[outside] == 0


def test_a_stall_of_its_clock_makes_no_chase() -> None:
    flight = led(5.0, replace(TILTS, stall_s=(6.0, 1.0)), sees=False)
    flight.run(12.0)
    assert flight.autopilot.fastest_mps <= 1.15 * 5.0
    after = flight.outcomes[-10:]
    assert {o.state for o in after} == {LinkState.FLYING}
    # What is told lies ahead for as long as nothing comes, and no longer.
    leads = np.array(flight.leads_m)
    assert np.count_nonzero(leads > 1.0) <= 10


@pytest.mark.parametrize("habits", [
    TILTS, Habits(tilt_s=0.2, acceleration_mps2=4.5, dead_s=0.15),
    Habits(tilt_s=0.3, acceleration_mps2=3.5, dead_s=0.2),
])  # fmt: skip
def test_it_flies_no_faster_than_its_mission_from_the_first_second_on(habits: Habits) -> None:
    flight = led(3.0, habits, sees=False)
    held: list[bool] = []
    while flight.autopilot.time_s < 12.0:
        outcome = flight.step()
        held.append(outcome.set_point is None or outcome.set_point.velocity_mps is None)
    assert flight.autopilot.fastest_mps <= 1.05 * 3.0
    assert flight.autopilot.truth.position_m[0] > 0.75 * 12.0 * 3.0
    assert not any(held[1:])  # Answering late, it is not told to hold where a movement ends.


def test_set_points_say_all_that_is_asked() -> None:
    flight = led(5.0, TILTS, sees=False)
    flight.run(1.5)
    target = last_target(flight)
    assert isinstance(target, SetPoint)
    assert target.acceleration_mps2 is not None
    assert np.linalg.norm(target.acceleration_mps2) > 1.0
    flight.run(30.0)
    held = last_target(flight)
    assert isinstance(held, SetPoint)
    assert held.velocity_mps is None
    assert held.acceleration_mps2 is None
