"""A copter with inertia: what it declares holds along every chain of its movements."""

from __future__ import annotations

from collections import deque
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clearway as cw
from clearway.base.errors import InputError
from clearway.vehicle.class_table import ClassTable
from clearway.vehicle.copter import CopterLimits
from clearway.vehicle.movement import Movement
from clearway.vehicle.reference import Reference

LIMITS = (
    CopterLimits(1.0),
    CopterLimits(5.0),
    CopterLimits(10.0, 5.0, climb_mps=4.0),
    CopterLimits(20.0, 8.0, yaw_rate_deg_s=45.0),
    CopterLimits(2.0, 0.5, sink_mps=0.0),
)


@cache
def copter(number: int) -> tuple[cw.MovementAutomaton, ClassTable]:
    automaton = cw.MovementAutomaton.of_copter(LIMITS[number])
    assert automaton.classes is not None
    return automaton, automaton.classes


def chain(number: int, picks: list[int]) -> list[tuple[np.ndarray, Movement]]:
    """States and the movements begun there, of a chain from rest; picks choose among what may be
    flown."""
    automaton, classes = copter(number)
    state = np.array([3.0, -1.0, 20.0, classes.label_of(classes.first), 0.0, 0.4])
    flown = []
    for pick in picks:
        may = np.flatnonzero(classes.following[classes.class_at(float(state[3]))] >= 0)
        movement = automaton.movements[int(may[pick % len(may)])]
        flown.append((state, movement))
        state = automaton.predict(state, movement)
    return flown


@settings(max_examples=60, deadline=None)
@given(st.integers(0, len(LIMITS) - 1), st.lists(st.integers(0, 200), min_size=2, max_size=12))
def test_every_chain_is_continuous_and_within_what_the_copter_can_do(
    number: int, picks: list[int]
) -> None:
    automaton, limits = copter(number)[0], LIMITS[number]
    flown = chain(number, picks)
    yaw_rate = np.radians(limits.yaw_rate_deg_s) + 1e-9
    for place, (state, movement) in enumerate(flown):
        asked = [
            Reference.of(automaton, state, movement, share * movement.duration_s)
            for share in (0.0, 0.3, 0.7, 1.0)
        ]
        for one in asked:
            assert np.hypot(*one.velocity_mps[:2]) <= limits.speed_mps + 1e-9
            assert -limits.sink_mps - 1e-9 <= one.velocity_mps[2] <= limits.climb_mps + 1e-9
            assert np.linalg.norm(one.acceleration_mps2) <= limits.acceleration_mps2 + 1e-9
            assert abs(one.yaw_rate_rps) <= yaw_rate
        if place + 1 < len(flown):
            after = Reference.of(automaton, *flown[place + 1], 0.0)
            np.testing.assert_allclose(asked[-1].velocity_mps, after.velocity_mps, atol=1e-9)
            np.testing.assert_allclose(asked[-1].position_m, after.position_m, atol=2e-3)
            assert asked[-1].yaw_rad == pytest.approx(after.yaw_rad, abs=1e-9)


@pytest.mark.parametrize("number", range(len(LIMITS)))
def test_every_class_brakes_to_rest_about_as_fast_as_it_may(number: int) -> None:
    automaton, classes = copter(number)
    movements = np.full(len(classes.classes), -1)
    movements[classes.first] = 0
    waiting = deque([classes.first])
    while waiting:
        at = waiting.popleft()
        for before in np.flatnonzero((classes.following == at).any(axis=1)).tolist():
            if movements[before] < 0:
                movements[before] = movements[at] + 1
                waiting.append(before)
    assert movements.min() >= 0
    lasts_s = automaton.movements[0].duration_s
    at_best_s = classes.speed_mps / LIMITS[number].acceleration_mps2
    assert np.all(movements * lasts_s <= at_best_s + 3.0 * lasts_s)


@pytest.mark.parametrize("number", range(len(LIMITS)))
def test_left_and_right_are_mirror_images_in_every_class(number: int) -> None:
    classes = copter(number)[1]
    swapped = [
        name.replace("Left", "?").replace("Right", "Left").replace("?", "Right")
        for name in classes.names
    ]
    mirror = [classes.names.index(name) for name in swapped]
    np.testing.assert_array_equal(classes.following, classes.following[:, mirror])
    mirrored = classes.paths[:, mirror] * [1.0, -1.0, 1.0, -1.0]
    np.testing.assert_allclose(classes.paths, mirrored, atol=1e-12)


def test_the_tube_grows_with_lag_gusts_acceleration_and_speed() -> None:
    speeds = np.linspace(0.0, 10.0, 5)
    least = CopterLimits(10.0, 3.0, gusts_mps=0.0).tube_m(speeds)
    assert np.all(np.diff(least) > 0.0)
    for more in (
        CopterLimits(10.0, 3.0, gusts_mps=1.0),
        CopterLimits(10.0, 3.0, gusts_mps=0.0, lag_s=0.3),
        CopterLimits(10.0, 6.0, gusts_mps=0.0),
    ):
        assert np.all(more.tube_m(speeds) > least)
    for speed_mps in (2.0, 10.0, 20.0):
        tube = CopterLimits(speed_mps, 8.0).tube_m(np.array([0.0, speed_mps]))
        assert np.all(tube <= 0.35 + 0.03 * np.array([0.0, speed_mps]))


def test_what_no_copter_can_do_is_refused_by_name() -> None:
    with pytest.raises(InputError, match=r"acceleration_mps2.*\n.*lag_s"):
        CopterLimits(5.0, 0.0, lag_s=-1.0)
