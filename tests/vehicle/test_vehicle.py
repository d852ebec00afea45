"""The plane model against numerical integration, its symmetries and its published table."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from clearway.vehicle.model import PlaneModel, Vehicle

ANGLE = st.floats(-1.5, 1.5)
RATE = st.one_of(st.just(0.0), st.floats(-2.0, 2.0), st.floats(-1e-6, 1e-6))
MODEL = PlaneModel()


def by_integration(state, inputs, duration_s):
    """Equation (4.4) by a high-order integrator."""

    def derivative(_, at):
        speed, roll_rate, pitch_rate, yaw_rate = inputs
        pitch, yaw = at[4], at[5]
        return [
            speed * np.cos(pitch) * np.cos(yaw),
            speed * np.cos(pitch) * np.sin(yaw),
            -speed * np.sin(pitch),
            roll_rate,
            pitch_rate,
            yaw_rate,
        ]

    return solve_ivp(derivative, (0, duration_s), state, rtol=1e-11, atol=1e-12).y[:, -1]


def test_is_a_vehicle():
    assert isinstance(MODEL, Vehicle)


@given(ANGLE, ANGLE, ANGLE, RATE, RATE, RATE, st.floats(0.0, 30.0), st.floats(0.01, 2.0))
def test_solves_the_differential_equation(
    roll, pitch, yaw, roll_rate, pitch_rate, yaw_rate, speed, duration
):
    state = [1.0, -2.0, 3.0, roll, pitch, yaw]
    inputs = [speed, roll_rate, pitch_rate, yaw_rate]
    exact = by_integration(state, inputs, duration)
    assert MODEL.advance(state, inputs, duration) == pytest.approx(exact, abs=1e-8)


@given(ANGLE, ANGLE, RATE, RATE, st.floats(0.0, 1.0))
def test_two_parts_make_the_whole(pitch, yaw, pitch_rate, yaw_rate, share):
    state, inputs = [0, 0, 0, 0, pitch, yaw], [5.0, 0.1, pitch_rate, yaw_rate]
    half_way = MODEL.advance(state, inputs, share)
    assert MODEL.advance(half_way, inputs, 1.0 - share) == pytest.approx(
        MODEL.advance(state, inputs, 1.0), abs=1e-12
    )


@given(ANGLE, ANGLE, RATE, RATE)
def test_mirror_image_is_exact(pitch, yaw, pitch_rate, yaw_rate):
    left = MODEL.advance([0, 0, 0, 0, pitch, yaw], [1, 0, pitch_rate, yaw_rate], 1.0)
    right = MODEL.advance([0, 0, 0, 0, pitch, -yaw], [1, 0, pitch_rate, -yaw_rate], 1.0)
    assert right.tolist() == (left * [1, -1, 1, 1, 1, -1]).tolist()


def test_tiny_rates_do_not_lose_digits():
    straight = MODEL.advance(np.zeros(6), [1, 0, 0, 0], 1.0)
    for rate in (1e-3, 1e-5, 1e-9, 1e-300):
        bent = MODEL.advance(np.zeros(6), [1, 0, 0, rate], 1.0)
        assert bent[0] == pytest.approx(straight[0] - rate**2 / 6, abs=1e-13)
        assert bent[1] == pytest.approx(rate / 2 - rate**3 / 24, rel=1e-10)


def test_pitch_down_is_positive_and_yaw_left_is_positive():
    down = MODEL.advance(np.zeros(6), [1, 0, np.radians(15), 0], 1.0)
    left = MODEL.advance(np.zeros(6), [1, 0, 0, np.radians(15)], 1.0)
    assert down[2] == pytest.approx(-0.130154, abs=1e-6)
    assert left[1] == pytest.approx(0.130154, abs=1e-6)


def test_does_not_write_into_its_arguments():
    state, inputs = np.zeros(6), np.array([1.0, 0.0, 0.1, 0.2])
    MODEL.advance(state, inputs, 1.0)
    assert not state.any()
    assert inputs.tolist() == [1.0, 0.0, 0.1, 0.2]
