"""Movements under disturbances: exact without, inside the ball of def. 13 with, as wind does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.buffer import MovementBuffer
from clearway.vehicle.disturbed import (
    DisturbanceSample,
    add_disturbances,
    disturb,
    draw_bounded_noise,
    fly_disturbed,
    gust,
    stationary,
    steady_wind,
)
from clearway.vehicle.prediction import NoiseBounds, deviation_bound_m

PLANE = MovementAutomaton.plane(5.0)
BUFFER = MovementBuffer.of(PLANE.chain(["Straight", "Up-Left", "Left", "Down", "Straight"]), 3.0)
START = np.array([1.0, 2.0, 3.0, 0.0, 0.1, 0.4])


def test_without_disturbance_it_is_the_prediction():
    flown = fly_disturbed(PLANE, BUFFER, START, lambda _: DisturbanceSample())
    predicted = BUFFER.rollout(PLANE, START, 0.02)
    assert flown.time_s == pytest.approx(predicted.time_s)
    assert flown.states == pytest.approx(predicted.states, abs=1e-9)
    movement = PLANE["Left"]
    undisturbed = disturb(lambda _: DisturbanceSample())(movement, 0.3)
    assert undisturbed.tolist() == stationary(movement, 0.3).tolist()


def test_wind_carries_the_whole_flight_along():
    wind = np.array([1.0, -2.0, 0.5])
    flown = fly_disturbed(PLANE, BUFFER, START, steady_wind(wind))
    still = BUFFER.rollout(PLANE, START, 0.02)
    carried = (flown.time_s - 3.0)[:, None] * wind
    assert flown.states[:, :3] - still.states[:, :3] == pytest.approx(carried, abs=1e-9)
    assert flown.states[:, 3:] == pytest.approx(still.states[:, 3:], abs=1e-12)


def test_a_gust_displaces_by_half_its_peak_times_its_duration():
    flown = fly_disturbed(PLANE, BUFFER, START, gust([0.0, 3.0, 0.0], 4.0, 2.0), 0.01)
    still = BUFFER.rollout(PLANE, START, 0.01)
    off = flown.states[:, 1] - still.states[:, 1]
    assert off[-1] == pytest.approx(0.5 * 3.0 * 2.0, abs=1e-3)
    assert np.all(off[flown.time_s <= 4.0] == pytest.approx(0.0, abs=1e-9))


@settings(max_examples=25, deadline=None)
@given(
    bounds=st.builds(
        NoiseBounds,
        pitch_rad=st.floats(0, 0.1),
        yaw_rad=st.floats(0, 0.1),
        speed_mps=st.floats(0, 1.0),
        pitch_rate_rps=st.floats(0, 0.1),
        yaw_rate_rps=st.floats(0, 0.1),
        drift_mps=st.floats(0, 2.0),
    ),
    seed=st.integers(0, 1000),
)
def test_bounded_noise_stays_in_the_ball_of_the_prediction(bounds, seed):
    flown = fly_disturbed(PLANE, BUFFER, START, draw_bounded_noise(bounds, seed), 0.05)
    still = BUFFER.rollout(PLANE, START, 0.05)
    off = np.linalg.norm(flown.states[:, :3] - still.states[:, :3], axis=1)
    bound = deviation_bound_m(bounds, 5.0, flown.time_s - 3.0)
    assert np.all(off <= bound + 1e-9)


def test_noise_is_a_function_of_seed_and_time():
    noise = draw_bounded_noise(NoiseBounds(speed_mps=1.0, drift_mps=1.0), 7)
    again = draw_bounded_noise(NoiseBounds(speed_mps=1.0, drift_mps=1.0), 7)
    assert noise(1.23) == again(1.23) == noise(1.21)
    assert noise(1.23) != noise(1.33)
    assert noise(-0.05) == again(-0.05)
    assert noise(1.23) != draw_bounded_noise(NoiseBounds(speed_mps=1.0, drift_mps=1.0), 8)(1.23)


def test_disturbances_add_up():
    both = add_disturbances(steady_wind([1, 0, 0]), steady_wind([0, 2, 0]))
    assert both(0.0).drift_mps == (1.0, 2.0, 0.0)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: steady_wind([np.nan, 0, 0]),
        lambda: gust([1, 0, 0], 0.0, 0.0),
        lambda: draw_bounded_noise(NoiseBounds(), 0, 0.0),
        lambda: fly_disturbed(PLANE, BUFFER, START, steady_wind([0, 0, 0]), 0.0),
        lambda: fly_disturbed(
            MovementAutomaton(PLANE.movements, table=PLANE.measure()),
            BUFFER,
            START,
            steady_wind([0, 0, 0]),
        ),
    ],
)
def test_bad_input_is_refused(wrong):
    with pytest.raises(ClearwayError):
        wrong()
