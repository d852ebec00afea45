"""Spaces of 3.5: free, occupied, hidden, mixed; shares add up to one."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ball_world import BallWorld
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.sensors import (
    BeamPattern,
    Lidar,
    Scan,
    SpaceClass,
    classify_space,
    detect,
    simulate_scan,
)

GRID = AvoidanceGrid.uniform()
SHARES = st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3)


def test_spaces_around_a_wall_with_an_edge():
    # A ball so large that it fills the left columns of layer 5 and hides all behind.
    wall = BallWorld.of(((5.0, 52.0, 0.0), 51.0))
    lidar = Lidar("front", BeamPattern.per_cell(GRID, max_range_m=10.0))
    found = detect(GRID, lidar, simulate_scan(lidar, wall, State(np.zeros(3))))
    space = classify_space(found.probability, found.visibility)
    names = np.array(space.names).reshape(GRID.shape)
    assert (names[:, 0] == "free").all()
    assert (names[0] == "free").all()
    assert (names[9, 6] == "hidden").all()
    assert (names == "mixed").any()
    full = found.probability >= 1.0
    assert set(np.array(space.names)[full]) <= {"occupied"}
    np.testing.assert_array_equal(space.accessible, np.array(space.names) == "free")


def test_columns_without_beams_are_hidden_and_empty_ones_free():
    lidar = Lidar("puck", BeamPattern.rotating(np.linspace(-15.0, 15.0, 16), 0.2))
    found = detect(GRID, lidar, Scan(np.zeros((0, 3))))
    names = np.array(classify_space(found.probability, found.visibility).names).reshape(GRID.shape)
    assert (names[:, :, [0, 4]] == "hidden").all()
    assert (names[:, :, 1:4] == "free").all()


def test_the_map_speaks_for_the_hidden_part_only():
    visible, hidden = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0])
    space = classify_space(hidden, visible, np.array([1.0, 1.0, 0.4]))
    assert space.names == ["free", "occupied", "mixed"]
    np.testing.assert_allclose(space.hidden, [0.0, 0.0, 0.6])


@given(detected=SHARES, visibility=SHARES, base=SHARES)
def test_shares_add_up_to_one(detected, visibility, base):
    space = classify_space(np.array(detected), np.array(visibility), np.array(base))
    np.testing.assert_allclose(space.free + space.occupied + space.hidden, 1.0)
    for share in (space.free, space.occupied, space.hidden):
        assert share.min() >= 0.0
    assert np.all((space.code == SpaceClass.FREE) == (space.free >= 1.0 - 1e-9))
