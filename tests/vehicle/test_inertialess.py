"""Multirotors: the model against integration, the movements, and what can stand still."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from clearway.base.errors import ClearwayError
from clearway.base.state import State
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.buffer import MovementBuffer
from clearway.vehicle.disturbed import fly_disturbed, steady_wind
from clearway.vehicle.inertialess import InertialessModel
from clearway.vehicle.model import Vehicle
from clearway.vehicle.paths import motion_depends_on_roll, movement_paths

MODEL = InertialessModel()
ROTOR = MovementAutomaton.inertialess(speed_mps=2.0)
RATE = st.one_of(st.just(0.0), st.floats(-2.0, 2.0), st.floats(-1e-9, 1e-9))
ANGLE = st.floats(-1.0, 1.0)
NAMES = st.lists(st.sampled_from(ROTOR.names), min_size=1, max_size=8)


@given(ANGLE, ANGLE, st.floats(-4.0, 4.0), st.floats(0, 20), RATE, st.floats(-5, 5))
def test_solves_its_differential_equation(roll, pitch, yaw, speed, yaw_rate, climb):
    def derivative(_, at):
        return [speed * np.cos(at[5]), speed * np.sin(at[5]), climb, 0.1, -0.2, yaw_rate]

    state, inputs = [1.0, -2.0, 3.0, roll, pitch, yaw], [speed, 0.1, -0.2, yaw_rate, climb]
    exact = solve_ivp(derivative, (0, 1.5), state, rtol=1e-11, atol=1e-12).y[:, -1]
    assert isinstance(MODEL, Vehicle)
    assert MODEL.advance(state, inputs, 1.5) == pytest.approx(exact, abs=1e-8)


@given(st.floats(-4, 4), RATE, st.floats(-5, 5), st.floats(0.0, 1.0))
def test_two_parts_make_the_whole(yaw, yaw_rate, climb, share):
    state, inputs = [0, 0, 0, 0, 0, yaw], [5.0, 0.0, 0.0, yaw_rate, climb]
    part = MODEL.advance(state, inputs, share)
    whole = MODEL.advance(state, inputs, 1.0)
    assert MODEL.advance(part, inputs, 1.0 - share) == pytest.approx(whole, abs=1e-12)


def test_inputs_without_climb_stay_level_and_others_are_refused():
    assert MODEL.advance(np.zeros(6), [2.0, 0, 0, 0], 3.0) == pytest.approx([6, 0, 0, 0, 0, 0])
    with pytest.raises(ClearwayError, match="4 or 5 inputs"):
        MODEL.advance(np.zeros(6), [2.0, 0, 0], 1.0)


@pytest.mark.parametrize(
    ("name", "end"),
    [
        ("Straight", (2, 0, 0, 0, 0, 0)),
        ("Left", (1.97723, 0.26031, 0, 0, 0, np.radians(15))),
        ("Up", (np.sqrt(3), 0, 1, 0, 0, 0)),
        ("Down", (np.sqrt(3), 0, -1, 0, 0, 0)),
        ("Slow", (1, 0, 0, 0, 0, 0)),
        ("Climb", (0, 0, 1, 0, 0, 0)),
        ("Sink", (0, 0, -1, 0, 0, 0)),
        ("Turn-Left", (0, 0, 0, 0, 0, np.radians(45))),
        ("Hold", (0, 0, 0, 0, 0, 0)),
    ],
)
def test_the_movements_from_level_flight(name, end):
    assert ROTOR.predict(np.zeros(6), ROTOR[name]) == pytest.approx(end, abs=1e-5)


@given(NAMES, st.floats(-3, 3), ANGLE, ANGLE)
def test_the_way_depends_on_neither_place_nor_attitude_but_yaw(names, yaw, roll, pitch):
    level = ROTOR.rollout(np.zeros(6), names, step_s=0.5).states
    moved = ROTOR.rollout([4.0, -3.0, 2.0, roll, pitch, yaw], names, step_s=0.5).states
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    assert moved[:, :3] == pytest.approx(level[:, :3] @ turn.T + [4.0, -3.0, 2.0], abs=1e-9)
    assert np.all(moved[:, 3:5] == [roll, pitch])


def test_what_stands_may_be_repeated_for_ever():
    standing = {n for n, stands in zip(ROTOR.names, ROTOR.stands, strict=True) if stands}
    assert standing == {"Turn-Left", "Turn-Right", "Hold"}
    assert ROTOR.can_stop
    assert ROTOR.hold == ROTOR["Hold"]
    assert ROTOR.room_to_turn_m == 0.0
    for name in standing:
        place = ROTOR.rollout([1, 2, 3, 0, 0, 0.4], [name] * 20).states[:, :3]
        assert np.all(place == [1, 2, 3])
    once = frozenset((name, name) for name in standing)
    assert not MovementAutomaton(ROTOR.movements, 0.0, vehicle=MODEL, forbidden=once).can_stop


def test_a_plane_cannot_stop():
    plane = MovementAutomaton.plane()
    assert not plane.can_stop
    assert plane.hold is None
    assert not plane.keeps_attitude
    assert plane.room_to_turn_m == plane.turning_radius_m
    assert plane.spot_turn_m_per_rad == np.inf
    tilted = State(np.zeros(3), np.array([0.1, 0.2, 0.3]))
    assert plane.upright(tilted) is tilted


def test_properties_of_the_set():
    assert ROTOR.keeps_attitude
    assert not motion_depends_on_roll(ROTOR)
    assert ROTOR.start_pitches_rad == (0.0,)
    assert ROTOR.steepest_rad == pytest.approx(
        np.radians(30), abs=2e-3
    )  # A turn that climbs is shorter.
    assert ROTOR.spot_turn_m_per_rad == pytest.approx(2.0 / np.radians(45))
    assert ROTOR.fastest_mps == pytest.approx(2.0)
    assert not ROTOR.stays_level
    mirrored = [ROTOR.names[index] for index in ROTOR.mirror]
    swapped = [n.replace("Left", "x").replace("Right", "Left") for n in ROTOR.names]
    assert mirrored == [n.replace("x", "Right") for n in swapped]
    tilted = State(np.zeros(3), np.array([0.1, 0.2, 0.3]))
    assert ROTOR.upright(tilted).attitude_rad.tolist() == [0.0, 0.0, 0.3]
    level = MovementAutomaton.inertialess(climb_mps=0.0)
    assert level.stays_level
    assert not {"Up", "Down", "Climb", "Sink"} & set(level.names)
    slow = MovementAutomaton.inertialess(slow_mps=(0.2, 0.4), diagonals=False)
    assert {"Slow-0.2-Left", "Slow-0.4"} <= set(slow.names)
    assert "Up-Left" not in slow.names


def test_paths_are_what_is_predicted():
    paths = movement_paths(ROTOR, 4)(0.1, -0.2)
    start = [0, 0, 0, 0.1, -0.2, 0]
    for movement, path in zip(ROTOR.movements, paths, strict=True):
        for sample in range(4):
            expected = ROTOR.predict(start, movement, (sample + 1) / 4)
            assert path[sample] == pytest.approx(expected, abs=1e-12)


def test_wind_carries_what_holds():
    buffer = MovementBuffer.of(ROTOR.chain(["Hold", "Climb"]))
    end = fly_disturbed(ROTOR, buffer, np.zeros(6), steady_wind((0.5, 0.0, 0.0))).states[-1]
    assert end[:3] == pytest.approx([1.0, 0.0, 1.0])


@pytest.mark.parametrize(
    "wrong",
    [
        {"speed_mps": 0.0},
        {"speed_mps": np.nan},
        {"turn_step_deg": 0.0},
        {"duration_s": -1.0},
        {"steepest_deg": 90.0},
        {"climb_mps": -1.0},
        {"climb_mps": np.inf},
        {"spot_turn_deg": 181.0},
        {"slow_mps": (1.0,)},
        {"slow_mps": (0.5, 0.5)},
    ],
)
def test_numbers_out_of_range_are_named(wrong):
    with pytest.raises(ClearwayError, match=next(iter(wrong))):
        MovementAutomaton.inertialess(**wrong)


def test_a_rate_of_climb_must_be_finite():
    with pytest.raises(ClearwayError, match="finite"):
        Movement("Up", 1.0, climb_mps=np.nan)
