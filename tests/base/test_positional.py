"""Public names by position: two arguments are welcome, more are deprecated and still work."""

import warnings

import numpy as np
import pytest

import clearway as cw
from clearway.base.positional import keywords_beyond_two


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: cw.State(np.zeros(3), np.zeros(3), 4.0), "State.*name time_s"),
        (lambda: cw.Obstacle.ball([0, 0, 0], 1.0, "tree"), "Obstacle.ball.*name name"),
        (lambda: cw.AvoidanceGrid.uniform(10.0, 10, 45.0), "AvoidanceGrid.uniform.*name"),
        (lambda: cw.Prices(1.0, 2.0, 3.0), "Prices.*name"),
    ],
)
def test_a_third_argument_by_position_is_told_by_name(make, named):
    with pytest.warns(DeprecationWarning, match=named):
        assert make() is not None


def test_two_by_position_and_the_rest_by_name_are_silent():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        state = cw.State(np.ones(3), np.zeros(3), time_s=4.0)
        grid = cw.AvoidanceGrid.uniform(10.0, 10, azimuth_deg=45.0)
        cw.Obstacle.ball([0, 0, 0], 1.0, name="tree")
    assert state.time_s == 4.0
    assert grid.range_m == 10.0


def test_what_is_called_stays_what_it_was():
    @keywords_beyond_two
    def add(first: int, second: int, third: int = 0) -> int:
        """Sum."""
        return first + second + third

    assert (add(1, 2), add(1, 2, third=3), add.__doc__, add.__name__) == (3, 6, "Sum.", "add")
    with pytest.warns(DeprecationWarning, match="add.*name third"):
        assert add(1, 2, 3) == 6
