"""A flight may start anywhere and head anywhere: what pre-flight promises holds there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.live.preflight.escape_plan import escape_plan
from clearway.missions.fly import fly
from clearway.missions.setup import FlightSetup, prepare
from clearway.missions.world_file import read_mission
from random_starts import AIRFRAMES, Tables, flight

STUCK = (
    "stuck-min",
    pytest.param("stuck-default-1", marks=pytest.mark.nightly),
    pytest.param("stuck-default-10", marks=pytest.mark.nightly),
)
MANY = 200
NARROW: Tables = {"grid": {"azimuth_deg": 40.0, "elevation_deg": 16.0}}
OFF_MIDDLE: Tables = {"lidar": {"position_m": [0.13, -0.08, -0.11]}}
WIDE_BODY: Tables = {"vehicle": {"body_radius_m": 0.5}, "safety": {"margin_m": 1.0}}
SLOW: Tables = {"vehicle": {"speed_mps": 0.5}}
LONG_RANGE: Tables = {"grid": {"range_m": 30.0}, "lidar": {"max_range_m": 30.0}}
UNSURE: Tables = {"simulation": {"position_sigma_m": 0.05}}


def arrives(setup: FlightSetup) -> None:
    """In empty air, and with the guarantee."""
    run = setup.fly()
    told = run.summary()
    assert run.reached, told["reason"]
    assert told["alarms"] == []
    assert told["reason"] is None
    assert told["guarantee"] is True


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("airframe", ["plane", "copter"])
def test_it_leaves_and_arrives_in_empty_air(airframe: str, seed: int) -> None:
    arrives(flight(airframe, seed))


@pytest.mark.parametrize(
    ("seed", "changes"),
    [
        pytest.param(1, WIDE_BODY, id="wide body"),
        pytest.param(3, LONG_RANGE, id="long range"),
        pytest.param(9, UNSURE, id="unsure place", marks=pytest.mark.nightly),
        pytest.param(2, NARROW, id="narrow field", marks=pytest.mark.nightly),
        pytest.param(5, OFF_MIDDLE, id="off middle", marks=pytest.mark.nightly),
        pytest.param(0, SLOW, id="slow", marks=pytest.mark.nightly),
    ],
)
def test_so_do_other_copters(seed: int, changes: Tables) -> None:
    """Stuck beyond the start too: the ball did for the straight way alone, or it looked to and
    fro between two ways that were shut, or held before one."""
    assert flight("copter", seed, changes).fly().reached


@pytest.mark.nightly
@pytest.mark.parametrize("airframe", AIRFRAMES)
@pytest.mark.parametrize("seed", range(MANY))
def test_every_airframe_leaves_and_arrives(airframe: str, seed: int) -> None:
    if airframe == "F450":
        pytest.importorskip("jsbsim")
    arrives(flight(airframe, seed))


@pytest.mark.parametrize("name", STUCK)
def test_copters_that_stayed_for_ever_arrive(name: str, data_dir: Path) -> None:
    path = data_dir.parent / "missions" / "flights" / f"{name}.toml"
    if not path.is_file():
        pytest.skip(f"needs data: no {path.name}")
    assert fly(path).reached


@settings(max_examples=6)
@given(seed=st.integers(0, 2**31), airframe=st.sampled_from(["plane", "copter"]))
def test_what_is_promised_of_a_start_is_kept_straight_on(seed: int, airframe: str) -> None:
    """The escape is held by the movement that the plan names, and at every one from then on."""
    rng = np.random.default_rng(seed)
    start_m, heading = rng.uniform(-100.0, 100.0, 3), float(rng.uniform(-np.pi, np.pi))
    ahead_m = start_m + 12.0 * np.array([np.cos(heading), np.sin(heading), 0.0])
    placed = {
        "kind": "inertialess" if airframe == "copter" else "plane",
        "position_m": start_m.tolist(),
        "attitude_deg": [0.0, 0.0, float(np.degrees(heading))],
    }
    changes = {"mission": {"waypoints_m": [ahead_m.tolist()]}, "vehicle": placed}
    setup = flight(airframe, 0, changes)
    assert setup.escape.within is not None
    run = setup.fly()
    held = [entry.flight.decision.way_out for entry in run.decisions[setup.escape.within :]]
    assert held
    assert all(way is not None and way.certain for way in held)


def test_the_ball_about_the_start_does_for_any_place_and_heading() -> None:
    """One trial serves all flights of a vehicle; a movement's length does for a small one."""
    small = {flight("copter", seed).escape.start_free_m for seed in range(3)}
    assert small == {None}
    wide = {flight("copter", seed, WIDE_BODY).escape.start_free_m for seed in range(3)}
    assert len(wide) == 1
    assert 1.0 < (wide.pop() or 0.0) <= 3.0


def test_where_nobody_says_where_the_flight_starts_it_is_tried_at_the_origin() -> None:
    flown = prepare(read_mission("static-obstacles"))
    assert escape_plan(flown.planner, flown.sensors) == flown.escape
