"""Prediction error (4.11), correction (4.12), and the deviation bound (3.28) under noise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.prediction import (
    NoiseBounds,
    correct_movement,
    deviation_bound_m,
    deviation_rate,
    needs_correction,
    prediction_error,
)

PLANE = MovementAutomaton.plane()
SMALL = st.floats(-0.1, 0.1)
BOUND = st.floats(0.0, 0.2)


def test_error_weighs_metres_and_angles():
    error = prediction_error([3, 4, 0, 9, 0.03, 0.04], np.zeros(6), angle_weight_m=2.0)
    assert (error.position_m, error.angle_rad) == pytest.approx((5.0, 0.05))
    assert error.total_m == pytest.approx(5.1)


def test_yaw_error_goes_the_short_way_round():
    error = prediction_error([0, 0, 0, 0, 0, np.pi - 0.01], [0, 0, 0, 0, 0, -np.pi + 0.01], 1.0)
    assert error.angle_rad == pytest.approx(0.02)


def test_correction_is_due_above_a_twelfth_of_the_margin():
    for metres, due in ((0.049, False), (0.051, True)):
        error = prediction_error([metres, 0, 0, 0, 0, 0], np.zeros(6), 1.0)
        assert needs_correction(error, safety_margin_m=0.6) is due


@given(SMALL, SMALL, st.sampled_from(PLANE.names))
def test_corrected_movement_ends_in_the_predicted_attitude(pitch_off, yaw_off, name):
    movement = PLANE[name]
    predicted = np.array([0, 0, 0, 0, 0, 1.0])
    state = np.array([0, 0, 0, 0, pitch_off, 1.0 + yaw_off])
    corrected = correct_movement(PLANE, movement, state, predicted)
    end = PLANE.predict(state, corrected)
    assert end[4:] == pytest.approx(PLANE.predict(predicted, movement)[4:], abs=1e-9)
    assert (corrected.name, corrected.speed_mps) == (name, movement.speed_mps)


def test_correction_stays_within_its_limits():
    movement = PLANE["Left"]
    state = np.array([0, 0, 0, 0, 0, -1.0])
    corrected = correct_movement(PLANE, movement, state, np.zeros(6), rate_limit_rps=0.3)
    assert corrected.yaw_rate_rps == pytest.approx(0.3)
    steep = np.array([0, 0, 0, 0, np.radians(29), 0])
    pushed = correct_movement(PLANE, PLANE["Down"], steep, steep)
    assert PLANE.predict(steep, pushed)[4] == pytest.approx(np.radians(30))
    beyond = np.array([0, 0, 0, 0, np.radians(40), 0])
    held = correct_movement(PLANE, PLANE["Down"], beyond, beyond)
    assert PLANE.predict(beyond, held)[4] <= beyond[4] + 1e-12


@given(
    st.builds(NoiseBounds, BOUND, BOUND, BOUND, BOUND, BOUND, BOUND),
    st.lists(st.sampled_from(PLANE.movements), min_size=1, max_size=6),
    st.integers(0, 2**32 - 1),
)
def test_bounded_noise_never_exceeds_the_bound(noise, movements, seed):
    """Noise at random, and noise held at its bounds, which strays the farthest."""
    rng = np.random.default_rng(seed)
    weight, step = 3.8, 0.1
    start = np.array([0, 0, 0, 0, *rng.uniform(-0.5, 0.5, 2)])
    true, predicted = start.copy(), start.copy()
    held = rng.choice([-1.0, 1.0], 6)
    for elapsed, movement in enumerate(movements):
        for part in range(10):
            share = held if seed % 2 else rng.uniform(-1.0, 1.0, 6)
            predicted = PLANE.predict(predicted, movement, step)
            true = _flown(true, movement, noise, share, step)
            error = prediction_error(true, predicted, weight).total_m
            time = elapsed + (part + 1) * step
            bound = deviation_bound_m(noise, movement.speed_mps, time, weight)[0]
            assert error <= bound + 1e-9


def _flown(state, movement, noise, share, step):
    """One step of (4.4) with the shares of the noise bounds held over it; w enters g only."""
    w = np.array([0, 0, 0, 0, share[0] * noise.pitch_rad, share[1] * noise.yaw_rad])
    v = np.array(
        [
            share[2] * noise.speed_mps,
            0.0,
            share[3] * noise.pitch_rate_rps,
            share[4] * noise.yaw_rate_rps,
        ]
    )
    end = PLANE.vehicle.advance(state + w, movement.inputs + v, step) - w
    return end + np.array([share[5] * noise.drift_mps * step, 0, 0, 0, 0, 0])


def test_bound_is_reached_by_speed_noise():
    """Straight flight with a speed off by its bound: the bound is not merely generous."""
    noise = NoiseBounds(speed_mps=0.1)
    end = PLANE.vehicle.advance(np.zeros(6), [1.1, 0, 0, 0], 5.0)
    assert prediction_error(end, [5, 0, 0, 0, 0, 0], 1.0).total_m == pytest.approx(
        deviation_bound_m(noise, 1.0, 5.0)[0]
    )
    assert deviation_rate(noise, 1.0, 5.0) == pytest.approx(0.1)


def test_without_noise_there_is_no_deviation():
    assert deviation_bound_m(NoiseBounds(), 20.0, [1.0, 10.0]).tolist() == [0.0, 0.0]


def test_bad_bounds_are_named():
    with pytest.raises(ClearwayError, match="yaw_rad"):
        NoiseBounds(yaw_rad=-0.1)
