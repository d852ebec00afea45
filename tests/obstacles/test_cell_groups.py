"""Groups of cells: what is far from a group is far from every cell of it."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.grid import AvoidanceGrid
from clearway.obstacles.cell_nodes import cell_nodes
from clearway.obstacles.near_cells import SURELY_M, look_around, near_cells
from clearway.obstacles.obstacle import Obstacle, Shapes, shape_distance, shapes_of

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


def crowd(seed: int, count: int) -> Shapes:
    """Boxes, balls and wires all through the grid and beyond it."""
    rng = np.random.default_rng(seed)
    told = []
    for middle in rng.uniform([-2, -8, -6], [12, 8, 6], (count, 3)):
        size, turn = rng.uniform(0.01, 5.0, 3), rng.normal(size=3)
        told.append(
            (
                Obstacle.cuboid(
                    middle, (size[0], size[1], size[2]), radius_m=0.1, orientation_rad=turn
                ),
                Obstacle.ball(middle, 0.5 * size[0]),
                Obstacle.line(middle, 2.0 * size[0], radius_m=0.02, orientation_rad=turn),
            )[rng.integers(3)]
        )
    return shapes_of(told)


@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize("margin_m", [0.0, 0.7])
@pytest.mark.parametrize("count", [1, 40, 400])
@pytest.mark.parametrize("grid", GRIDS, ids=lambda grid: "x".join(map(str, grid.shape)))
def test_cells_are_told_what_is_near_them_and_nothing_else(
    grid: AvoidanceGrid, count: int, margin_m: float, whole: bool
) -> None:
    nodes, shapes = cell_nodes(grid), crowd(count, count)
    near = near_cells(shapes, nodes)
    covered, told = 0, 0
    for group in range(len(nodes.group_radius_m)):
        any_near = look_around(shapes, nodes, group, margin_m, whole, near) > 0
        cells = nodes.by_group[nodes.group_first[group] : nodes.group_first[group + 1]]
        for c, cell in enumerate(cells):
            center, reach = nodes.center_m[cell], nodes.radius_m[cell]
            off_m = np.array([shape_distance(*center, shapes, s) for s in range(count)])
            decided = bool(np.any(off_m <= margin_m - (reach if whole else SURELY_M)))
            assert near.covered[c] == decided
            if not decided:
                found = near.found[c, : near.many[c]]
                np.testing.assert_array_equal(found, np.flatnonzero(off_m < margin_m + reach))
                told += len(found)
                assert any_near or not len(found)
            covered += whole
    assert covered + told > 0
