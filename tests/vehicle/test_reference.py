"""What a plan asks of the vehicle: velocity and acceleration are the derivatives of its way."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import clearway as cw
from clearway.vehicle.class_table import ClassTable
from clearway.vehicle.movement import Movement
from clearway.vehicle.reference import Reference

STEP_S = 1e-4


@cache
def copter(speed_mps: float) -> cw.MovementAutomaton:
    return cw.MovementAutomaton.multirotor(speed_mps=speed_mps, acceleration_mps2=4.0)


def curved() -> cw.MovementAutomaton:
    """A measured automaton: one way that bends, climbs and gains speed."""
    share = np.arange(1, 41) / 40
    way = np.stack([3.0 * share + share**2, 0.5 * share**2, 0.3 * share, 0.4 * share], axis=1)
    table = ClassTable.of_pairs(("A",), {("A", "A"): way}, "A")
    return cw.MovementAutomaton((Movement("A", 4.0),), 0.0, table=table)


def flown_in(automaton: cw.MovementAutomaton) -> list[tuple[np.ndarray, Movement]]:
    """States and movements that may begin in them, of every class or a few attitudes."""
    here = np.array([1.0, -2.0, 30.0, 0.0, 0.0, 2.1])
    classes, movements = automaton.classes, automaton.movements
    if classes is None:
        return [(here, movement) for movement in movements]
    flown = np.argwhere(classes.following >= 0).tolist()
    labelled = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    return [(here + classes.label_of(at) * labelled, movements[m]) for at, m in flown]


@pytest.mark.parametrize(
    ("automaton", "near"),
    [
        (copter(5.0), 1e-6),
        (copter(20.0), 1e-6),
        (cw.MovementAutomaton.plane(speed_mps=12.0), 1e-6),
        (cw.MovementAutomaton.inertialess(speed_mps=3.0), 1e-6),
        (curved(), 0.06),
    ],
    ids=["copter of 5 m/s", "of 20 m/s", "plane", "inertialess", "measured"],
)
def test_velocity_and_acceleration_are_those_of_the_way(
    automaton: cw.MovementAutomaton, near: float
) -> None:
    for state, movement in flown_in(automaton):
        for share in (0.2, 0.5, 0.83):
            at_s = share * movement.duration_s
            before, now, after = (
                Reference.of(automaton, state, movement, at_s + by) for by in (-STEP_S, 0.0, STEP_S)
            )
            moved = (after.position_m - before.position_m) / (2.0 * STEP_S)
            assert np.linalg.norm(moved - now.velocity_mps) < near * (1.0 + 100.0 * STEP_S)
            gained = (after.velocity_mps - before.velocity_mps) / (2.0 * STEP_S)
            assert np.linalg.norm(gained - now.acceleration_mps2) < max(1e-5, near)
            assert (after.yaw_rad - before.yaw_rad) / (2.0 * STEP_S) == pytest.approx(
                now.yaw_rate_rps, abs=max(1e-6, near)
            )


@pytest.mark.parametrize("speed_mps", [2.0, 5.0, 10.0, 20.0])
def test_a_copter_is_asked_to_be_where_it_is_predicted(speed_mps: float) -> None:
    automaton = copter(speed_mps)
    for state, movement in flown_in(automaton):
        for share in (0.0, 0.5, 1.0):  # Kept positions: between them lie chords.
            asked = Reference.of(automaton, state, movement, share * movement.duration_s)
            there = automaton.predict(state, movement, share * movement.duration_s)
            np.testing.assert_allclose(asked.position_m, there[:3], atol=2e-4)
            assert asked.yaw_rad == pytest.approx(float(there[5]))


@pytest.mark.parametrize(
    "speed_mps", [2.0, *(pytest.param(one, marks=pytest.mark.nightly) for one in (5.0, 20.0))]
)
def test_velocity_is_continuous_where_one_movement_follows_another(speed_mps: float) -> None:
    """And no movement asks for more than the copter can do."""
    automaton = copter(speed_mps)
    for state, movement in flown_in(automaton):
        end = automaton.predict(state, movement)
        last = Reference.of(automaton, state, movement, movement.duration_s)
        for following in automaton.movements:
            if automaton.is_allowed(end, following):
                first = Reference.of(automaton, end, following, 0.0)
                np.testing.assert_allclose(first.velocity_mps, last.velocity_mps, atol=1e-9)
        assert np.linalg.norm(last.acceleration_mps2[:2]) <= 4.0 + 1e-9


def test_before_the_start_and_beyond_the_end_nothing_is_made_up() -> None:
    automaton = copter(5.0)
    state, movement = np.zeros(6), automaton["Accelerate"]
    for outside, at in ((-1.0, 0.0), (movement.duration_s + 1.0, movement.duration_s)):
        there, kept = (Reference.of(automaton, state, movement, t) for t in (outside, at))
        np.testing.assert_array_equal(there.position_m, kept.position_m)
        np.testing.assert_array_equal(there.velocity_mps, kept.velocity_mps)
