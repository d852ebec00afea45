"""What suits a vehicle where nothing is stated: laws over kinds, speeds and sensors."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.scale import MOST_LATERAL_MPS2, movement_s, scale_of

SPEEDS = st.floats(0.5, 30.0)
TURNS = st.floats(5.0, 60.0)
KINDS = st.sampled_from(["plane", "inertialess", "multirotor"])
SENSORS = st.none() | st.floats(5.0, 500.0)


def vehicle(kind: str, speed: float, turn: float = 15.0, acceleration: float = 3.0):
    if kind == "multirotor":
        return MovementAutomaton.multirotor(speed, acceleration_mps2=acceleration)
    lasts = movement_s(speed, turn)
    return getattr(MovementAutomaton, kind)(speed, turn, duration_s=lasts)


@pytest.mark.parametrize("kind", ["plane", "inertialess", "multirotor"])
@pytest.mark.parametrize("sees_m", [None, 4.0, 10.0, 100.0])
def test_the_papers_vehicle_has_the_papers_values(kind, sees_m):
    scale = scale_of(vehicle(kind, 1.0), sees_m)
    assert (scale.range_m, scale.margin_m, scale.reach_radius_m) == (10.0, 0.6, 1.5)
    assert movement_s(1.0, 15.0) == 1.0


@given(KINDS, SPEEDS, TURNS, st.floats(1.0, 10.0), SENSORS)
def test_the_range_covers_turning_and_stopping(kind, speed, turn, acceleration, sees_m):
    automaton = vehicle(kind, speed, turn, acceleration)
    scale = scale_of(automaton, sees_m)
    room = automaton.room_to_turn_m + automaton.step_m
    if kind == "multirotor":
        room = max(room, speed * automaton.movements[0].duration_s + speed**2 / (2 * acceleration))
    assert scale.range_m >= room + scale.margin_m - 1e-9
    if sees_m is not None:  # It is not asked to decide by what it cannot see, if that will do.
        assert scale.range_m <= max(sees_m + 1e-3, 10.0, 2.0 * room + scale.margin_m)
    assert scale.reach_radius_m >= min(1.5, 0.5 * automaton.step_m)


@given(KINDS, SPEEDS, SPEEDS, TURNS, SENSORS)
def test_all_grows_with_the_speed(kind, one, other, turn, sees_m):
    slow, fast = (scale_of(vehicle(kind, v, turn), sees_m) for v in sorted((one, other)))
    for key in ("range_m", "margin_m", "reach_radius_m"):
        assert getattr(slow, key) <= getattr(fast, key) + 1e-9


@given(SPEEDS, st.floats(1.0, 90.0))
def test_no_turn_is_banked_too_steeply_for_its_speed(speed, turn):
    lasts = movement_s(speed, turn)
    across = speed * np.radians(turn) / lasts
    assert across <= MOST_LATERAL_MPS2
    assert lasts == 1.0 or across >= 0.95 * MOST_LATERAL_MPS2


@given(SPEEDS, st.floats(0.1, 100.0))
def test_no_two_waypoints_are_reached_at_once(speed, apart_m):
    plane = vehicle("plane", speed)
    wide, near = scale_of(plane).reach_radius_m, scale_of(plane, apart_m=apart_m).reach_radius_m
    assert near == min(wide, max(1.5, near))
    assert near <= max(apart_m, 1.5)


@settings(deadline=None)
@given(SPEEDS, st.floats(5.0, 100.0))
def test_a_sensor_that_sees_farther_never_shortens_the_range(speed, sees_m):
    automaton = vehicle("plane", speed)
    assume(sees_m > 5.0)
    shorter, longer = scale_of(automaton, sees_m).range_m, scale_of(automaton, 2 * sees_m).range_m
    assert shorter <= longer <= scale_of(automaton).range_m
