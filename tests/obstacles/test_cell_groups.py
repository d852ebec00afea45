"""Groups of cells: what is far from a group is far from every cell of it."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.grid import AvoidanceGrid
from clearway.obstacles.cell_nodes import cell_nodes

GRIDS = [
    AvoidanceGrid.uniform(),
    AvoidanceGrid.uniform(range_m=15.0, layers=7, columns=3, rows=1),
    AvoidanceGrid.uniform(layers=1, columns=24, rows=12, azimuth_deg=180.0, elevation_deg=85.0),
]


@pytest.mark.parametrize("grid", GRIDS, ids=lambda grid: "x".join(map(str, grid.shape)))
def test_every_cell_is_in_one_group_and_within_its_ball(grid: AvoidanceGrid) -> None:
    nodes = cell_nodes(grid)
    assert np.array_equal(np.sort(nodes.by_group), np.arange(grid.cells))
    group = np.repeat(np.arange(len(nodes.group_radius_m)), np.diff(nodes.group_first))
    off_m = np.linalg.norm(nodes.center_m[nodes.by_group] - nodes.group_center_m[group], axis=1)
    within_m = nodes.group_radius_m[group] * (1.0 + 1e-12)
    assert np.all(off_m + nodes.radius_m[nodes.by_group] <= within_m)
