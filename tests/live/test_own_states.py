"""Own states: interpolated between those that came, carried on along what is being flown."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.base.state import State
from clearway.live.own_states import OwnStates, carried_on
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.buffer import MovementBuffer

AUTOMATON = MovementAutomaton.plane()
AHEAD_S = 5.0


def kept(*times_s: float, history_s: float = 10.0, turn_rps: float = 0.5) -> OwnStates:
    """States of a vehicle that flies along x at 2 m/s and turns left evenly."""
    states = OwnStates(history_s, AHEAD_S)
    for time_s in times_s:
        yaw = (turn_rps * time_s + np.pi) % (2.0 * np.pi) - np.pi
        assert states.take(State([2.0 * time_s, 0.0, 0.0], [0.0, 0.0, yaw], time_s), time_s) == []
    return states


@given(time_s=st.floats(0.0, 20.0))
def test_an_even_flight_is_interpolated_exactly_also_across_a_half_turn(time_s):
    place = kept(*np.arange(0.0, 21.0), history_s=30.0).at(time_s)
    assert place.time_s == time_s
    assert place.position_m[0] == pytest.approx(2.0 * time_s)
    np.testing.assert_allclose(
        np.exp(1j * place.attitude_rad[2]), np.exp(0.5j * time_s), atol=1e-12
    )


def test_only_the_last_seconds_are_kept():
    states = kept(0.0, 4.0, 8.0, 12.0, history_s=10.0)
    assert not states.reach_back_to(3.9)
    assert states.reach_back_to(4.0)
    assert not OwnStates(10.0, AHEAD_S).reach_back_to(0.0)


def test_flaws_are_told_and_nothing_of_them_is_kept():
    states = kept(1.0, 2.0)
    assert states.take(State([9.0, 0.0, 0.0], time_s=2.0), 2.0) == ["state: late or repeated"]
    assert states.latest.position_m[0] == 4.0
    with pytest.raises(ClearwayError, match="no own state yet"):
        _ = OwnStates(10.0, AHEAD_S).latest


def test_a_state_far_ahead_waits_for_the_next_one_or_the_clock():
    far, wrong = State([1.0, 0.0, 0.0], time_s=60.0), State([7.0, 0.0, 0.0], time_s=1e6)
    for bear_out in (
        lambda states: states.take(State([2.0, 0.0, 0.0], time_s=61.0), 2.0),
        lambda states: states.believe(58.0),
    ):
        states = kept(1.0, 2.0)
        assert states.take(far, 2.0) == []
        assert states.latest.time_s == 2.0
        assert not bear_out(states)
        assert states.latest.time_s >= 60.0
    states = kept(1.0, 2.0)
    assert states.take(wrong, 2.0) == []
    states.believe(3.0)
    assert states.take(State([6.0, 0.0, 0.0], time_s=3.0), 3.0) == ["state: from the future"]
    assert states.latest.time_s == 3.0


@given(ahead_s=st.floats(0.0, 3.0))
def test_a_state_is_carried_on_through_the_rest_of_the_buffer(ahead_s):
    buffer = MovementBuffer.of(AUTOMATON.chain(("Left", "Straight", "Right", "Straight")), 0.0)
    start = State([0.0, 0.0, 0.0])
    halfway = carried_on(start, 0.5, buffer, AUTOMATON)
    there = carried_on(halfway, 0.5 + ahead_s, buffer, AUTOMATON)
    straight_there = carried_on(start, 0.5 + ahead_s, buffer, AUTOMATON)
    assert there.time_s == pytest.approx(0.5 + ahead_s)
    np.testing.assert_allclose(there.vector, straight_there.vector, atol=1e-9)
