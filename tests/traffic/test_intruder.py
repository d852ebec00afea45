"""The intruder value: validation, prediction, growth, frames."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.errors import InputError
from clearway.base.state import State
from clearway.traffic import Intruder, up_seen_from
from clearway.traffic.models.many import Intruders


def test_every_problem_is_named_at_once() -> None:
    with pytest.raises(InputError) as caught:
        Intruder(
            [np.nan, 0, 0],
            [1, 2],
            spread_rad=[math.pi / 2, 0.1],
            radius_m=-1.0,
            name="A",
            acceleration_bound_mps2=math.inf,
        )
    problems = "\n".join(caught.value.problems)
    for key in ("position_m", "velocity_mps", "spread", "radius_m", "acceleration_bound_mps2"):
        assert key in problems
    assert "intruder A" in str(caught.value)
    assert "[0, 90)" in problems


@pytest.mark.parametrize("spread", [[-0.01, 0.0], [0.0, math.pi / 2], [math.nan, 0.0]])
def test_spreads_outside_are_refused(spread: list[float]) -> None:
    with pytest.raises(InputError, match="spread"):
        Intruder([1, 0, 0], [1, 0, 0], spread_rad=spread)


def test_prediction_moves_straight_and_grows() -> None:
    now = Intruder([1, 2, 3], [4, 0, -1], time_s=10.0, position_std_m=0.3, velocity_std_mps=0.1)
    later = now.at(14.0)
    np.testing.assert_allclose(later.position_m, [17.0, 2.0, -1.0])
    assert later.time_s == 14.0
    assert later.position_std_m == pytest.approx(0.5)
    np.testing.assert_array_equal(now.position_m, [1, 2, 3])


def test_time_running_backwards_is_predicted_backwards_with_growth() -> None:
    now = Intruder([1, 0, 0], [1, 0, 0], time_s=5.0, position_std_m=0.3, velocity_std_mps=0.1)
    before = now.at(1.0)
    np.testing.assert_allclose(before.position_m, [-3.0, 0.0, 0.0])
    assert before.position_std_m == pytest.approx(0.5)


def test_deviation_covers_the_wider_spread_or_the_acceleration() -> None:
    spread = Intruder([0, 0, 0], [2, 0, 0], spread_rad=[0.2, 0.1])
    turning = Intruder([0, 0, 0], [2, 0, 0], acceleration_bound_mps2=1.0, velocity_std_mps=0.1)
    both = Intruders.of([spread, turning])
    for time_s in (3.0, -3.0):
        radius, growth = both.balls(both.velocity_mps, time_s, sigmas=3.0, horizon_s=10.0)
        assert radius == pytest.approx([6.0 * math.tan(0.2), 4.5 + 0.9])
        assert growth == pytest.approx([2.0 * math.tan(0.2), 0.3 + 5.0])


@given(
    st.lists(st.floats(-100, 100), min_size=3, max_size=3),
    st.lists(st.floats(-1.4, 1.4), min_size=3, max_size=3),
)
def test_seen_from_keeps_distance_and_speed(position: list[float], attitude: list[float]) -> None:
    state = State(np.array(position), np.array(attitude))
    intruder = Intruder([10, -5, 2], [1, 2, 3], radius_m=0.5)
    seen = intruder.see_from(state)
    assert np.linalg.norm(seen.position_m) == pytest.approx(
        np.linalg.norm(intruder.position_m - state.position_m), abs=1e-9
    )
    assert seen.speed_mps == pytest.approx(intruder.speed_mps)
    # Height above the vehicle does not depend on where its nose points.
    height = seen.position_m @ up_seen_from(state)
    assert height == pytest.approx(2.0 - position[2], abs=1e-9)


def test_many_are_predicted_and_then_seen_from():
    state = State(np.array([3.0, -2.0, 1.0]), np.array([0.1, -0.3, 2.0]), time_s=4.5)
    report = Intruder(
        np.array([9.0, 4.0, 2.0]), np.array([-1.0, 0.5, 0.2]), spread_rad=np.array([0.2, 0.1]),
        radius_m=0.5, name="A", time_s=1.25, position_std_m=0.3, velocity_std_mps=0.1,
    )  # fmt: skip
    other = Intruder([1.0, 0.0, -7.0], [0.0, 0.0, 0.0], time_s=9.0)
    once, *_ = both = Intruders.of([report, other]).see_at(state, state.world_from_body)
    twice = report.at(4.5).see_from(state)
    for key in ("position_m", "velocity_mps", "spread_rad"):
        assert getattr(once, key) == pytest.approx(getattr(twice, key), rel=1e-12)
        assert not getattr(once, key).flags.writeable
        # Whoever else is there changes nothing, not by a bit.
        (alone,) = Intruders.of([report]).see_at(state, state.world_from_body)
        assert np.array_equal(getattr(once, key), getattr(alone, key))
    assert [each.time_s for each in both] == [4.5, 4.5]
    assert list(Intruders.of([]).see_at(state, state.world_from_body)) == []
    for key in ("position_std_m", "velocity_std_mps", "time_s", "name", "radius_m"):
        assert getattr(once, key) == getattr(twice, key)


def test_whole_numbers_are_as_good_as_any():
    """Told without a point, they do not make time and deviation whole numbers too."""
    told = {"radius_m": 1, "time_s": 0, "position_std_m": 1, "velocity_std_mps": 1}
    report = Intruder([40, 5, 0], [-3, 0, 0], **told, acceleration_bound_mps2=2)
    (seen,) = Intruders.of([report]).see_at(State(np.zeros(3), time_s=2.5), np.eye(3))
    assert seen.time_s == 2.5
    assert seen.position_std_m == pytest.approx(math.hypot(1.0, 2.5))


def test_many_are_a_sequence_of_each_whether_they_were_moved_or_not():
    one = Intruder([9.0, 4.0, 2.0], [-1.0, 0.5, 0.2], name="A", position_std_m=0.3)
    other = Intruder([1.0, 0.0, -7.0], [0.0, 2.0, 0.0], name="B", time_s=1.0)
    many = Intruders.of([one, other])
    assert Intruders.of(many) is many
    assert list(many) == [one, other]
    assert many[-1] is other
    assert many[:1] == [one]
    seen = many.see_at(State(np.array([3.0, 0.0, 0.0]), time_s=2.0), np.eye(3))
    for each, row, alone in zip(seen, range(2), (one, other), strict=True):
        assert np.array_equal(each.position_m, seen.position_m[row])
        assert each.position_m == pytest.approx(alone.at(2.0).position_m - [3.0, 0.0, 0.0])
        assert (each.name, each.time_s) == (alone.name, 2.0)
    (left,) = seen.where(np.array([False, True]))
    assert left.name == "B"
    assert np.array_equal(left.position_m, seen[1].position_m)
    with pytest.raises(IndexError):
        seen[2]
