"""Movement buffers (3.15): chained, split, and flown in pieces as in one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.errors import ClearwayError
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.buffer import BufferedMovement, MovementBuffer

PLANE = MovementAutomaton.plane()
NAMES = st.lists(st.sampled_from(PLANE.names), min_size=1, max_size=8)


def buffer(*names, start_s=0.0):
    return MovementBuffer.of(PLANE.chain(names), start_s)


@given(NAMES, st.floats(0.0, 8.0))
def test_flying_in_two_parts_ends_where_flying_in_one_does(names, cut_s):
    whole = buffer(*names)
    before, after = whole.split(cut_s)
    middle = before.rollout(PLANE, np.zeros(6)).states[-1]
    end = after.rollout(PLANE, middle).states[-1]
    assert end == pytest.approx(whole.rollout(PLANE, np.zeros(6)).states[-1], abs=1e-8)
    assert sum(e.duration_s for e in before.entries + after.entries) == pytest.approx(len(names))


@given(NAMES, st.floats(-1.0, 8.0), st.floats(0.0, 8.0))
def test_legs_between_two_times_are_what_two_splits_leave(names, start_s, lasts_s):
    whole, end_s = buffer(*names), start_s + lasts_s
    left = whole.split(start_s)[1].split(end_s)[0]
    assert whole.legs(start_s, end_s) == [(e.movement, e.duration_s) for e in left.entries]


def test_chaining_flushes_what_is_left():
    first = buffer("Left", "Left", "Left")
    chain = first.chain(buffer("Right", start_s=1.5))
    assert chain.names == ("Left", "Left", "Right")
    assert [entry.duration_s for entry in chain.entries] == [1.0, 0.5, 1.0]
    assert first.chain(MovementBuffer()) is first


def test_the_movement_at_a_time():
    pair = buffer("Left", "Right", start_s=2.0)
    assert pair.at(2.0) is None
    assert pair.at(3.0).name == "Left"
    assert pair.at(3.001).name == "Right"
    assert pair.at(4.001) is None
    assert (pair.start_s, pair.end_s) == (2.0, 4.0)


def test_rollout_hits_each_movements_end():
    path = buffer("Left", "Up", start_s=5.0).rollout(PLANE, np.zeros(6), step_s=0.3)
    assert path.movements == ("Left", "Up")
    assert path.time_s[[0, 4, 8]].tolist() == [5.0, 6.0, 7.0]
    assert len(path.time_s) == 9


def test_gaps_and_empty_entries_are_refused():
    left = PLANE["Left"]
    with pytest.raises(ClearwayError, match="starts at"):
        MovementBuffer((BufferedMovement(left, 0.0, 1.0), BufferedMovement(left, 1.5, 1.0)))
    with pytest.raises(ClearwayError, match="no duration"):
        MovementBuffer((BufferedMovement(left, 0.0, 0.0),))
    with pytest.raises(ClearwayError, match="starts at"):
        buffer("Left").chain(buffer("Left", start_s=3.0))
