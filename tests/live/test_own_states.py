"""Own states: interpolated between those that came, carried on along what is being flown."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.base.state import State
from clearway.live.inputs.own_states import Flown, OwnStates
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.buffer import MovementBuffer

AUTOMATON = MovementAutomaton.plane()


def kept(*times_s: float, history_s: float = 10.0, turn_rps: float = 0.5) -> OwnStates:
    """States of a vehicle that flies along x at 2 m/s and turns left evenly."""
    states = OwnStates(history_s, Flown(AUTOMATON, history_s))
    for time_s in times_s:
        yaw = (turn_rps * time_s + np.pi) % (2.0 * np.pi) - np.pi
        assert states.take(State([2.0 * time_s, 0.0, 0.0], [0.0, 0.0, yaw], time_s=time_s)) is None
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
    assert not OwnStates(10.0, Flown(AUTOMATON, 10.0)).reach_back_to(0.0)


def test_what_is_late_or_repeated_is_told_and_not_kept():
    states = kept(1.0, 2.0)
    assert states.take(State([9.0, 0.0, 0.0], time_s=2.0)) == "state: late or repeated"
    assert states.latest.position_m[0] == 4.0
    with pytest.raises(ClearwayError, match="no state estimate yet"):
        _ = OwnStates(10.0, Flown(AUTOMATON, 10.0)).latest


PLANS = (("Left", "Left", "Up"), ("Right", "Straight"), ("Down", "Left", "Straight", "Straight"))


def flown_through(
    switches_s: tuple[float, ...], history_s: float = 30.0
) -> tuple[Flown, list[State]]:
    """Plans that take over from each other, and the true states at the switches."""
    flown, truth = Flown(AUTOMATON, history_s), [State([0.0, 0.0, 0.0], time_s=switches_s[0])]
    for number, (begins, ends) in enumerate(pairwise((*switches_s, switches_s[-1] + 1.0))):
        buffer = MovementBuffer.of(AUTOMATON.chain(PLANS[number % len(PLANS)]), begins)
        flown.then(buffer)
        part, _ = buffer.split(ends)
        vector = part.rollout(AUTOMATON, truth[-1].vector, np.inf).states[-1]
        truth.append(State(vector[:3], vector[3:], time_s=ends))
    return flown, truth


@given(
    lasts_s=st.lists(st.floats(0.05, 1.9), min_size=1, max_size=6),
    seen=st.integers(0, 6),
    share=st.floats(0.0, 1.0),
)
def test_a_state_is_carried_through_all_that_was_flown_since(lasts_s, seen, share):
    """Dead reckoning is exact from any older state, whatever plans took over meanwhile."""
    flown, truth = flown_through(tuple(np.concatenate([[0.0], np.cumsum(lasts_s)])))
    older, last = truth[min(seen, len(truth) - 2)], truth[-1]
    carried = flown.carry(older, last.time_s)
    np.testing.assert_allclose(carried.vector, last.vector, atol=1e-9)
    halfway = flown.carry(older, older.time_s + share * (last.time_s - older.time_s))
    np.testing.assert_allclose(flown.carry(halfway, last.time_s).vector, last.vector, atol=1e-9)
    assert flown.unknown_s(older.time_s, last.time_s) == 0.0


@given(share=st.floats(0.0, 1.0))
def test_between_two_states_the_way_is_the_one_flown_and_ends_in_the_second(share):
    flown, truth = flown_through((0.0, 1.5))
    states = OwnStates(30.0, flown)
    states.take(truth[0])
    off = np.array([0.4, -0.2, 0.1])
    states.take(replace(truth[-1], position_m=truth[-1].position_m + off))
    there = states.at(share * truth[-1].time_s)
    exact = flown.carry(truth[0], share * truth[-1].time_s)
    np.testing.assert_allclose(there.position_m, exact.position_m + share * off, atol=1e-9)


def test_what_was_flown_is_unknown_before_after_and_between_plans():
    flown = Flown(AUTOMATON, 10.0)
    assert flown.unknown_s(0.0, 0.7) == pytest.approx(0.7)
    flown.then(MovementBuffer.of(AUTOMATON.chain(("Straight",)), 1.0))
    flown.then(MovementBuffer.of(AUTOMATON.chain(("Straight",)), 2.5))
    assert flown.unknown_s(0.5, 4.0) == pytest.approx(0.5 + 0.5 + 0.5)
    here = flown.carry(State([0.0, 0.0, 0.0], time_s=0.5), 4.0)
    assert here.position_m[0] == pytest.approx(2.0)


def test_movements_flown_long_ago_are_forgotten():
    flown = Flown(AUTOMATON, 3.0)
    for second in range(40):
        flown.then(MovementBuffer.of(AUTOMATON.chain(("Left",)), float(second)))
    assert len(flown._buffers) <= 5
