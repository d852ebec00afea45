"""What balls leave of the room about cells' centres, against every ball held against every one."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.live.cell_marking import mark_balls

SHAPE = (24, 20, 8)


def by_hand(
    position: np.ndarray, radius: np.ndarray, low: np.ndarray, width: float, reach: float
) -> np.ndarray:
    ticks = [low[axis] + (np.arange(n) + 0.5) * width for axis, n in enumerate(SHAPE)]
    centers = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1)
    nearest = np.full(SHAPE, np.inf)
    for place, r in zip(position, radius, strict=True):
        nearest = np.minimum(nearest, np.linalg.norm(centers - place, axis=-1) - r)
    return np.where(nearest <= reach, nearest, np.inf)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("count", [0, 1, 400])
def test_cells_are_told_of_the_nearest_ball(seed: int, count: int) -> None:
    """Scattered and in walls, inside and outside of the cells, some of them as large as a house."""
    rng = np.random.default_rng([seed, count])
    low, width = rng.normal(0.0, 9.0, 3), float(rng.uniform(0.5, 2.5))
    size = width * np.array(SHAPE)
    position = rng.uniform(low - 0.3 * size, low + 1.3 * size, (count, 3))
    if seed % 2:
        position[:, 0] = low[0] + 0.4 * size[0]
    radius = rng.uniform(0.0, 0.5, count)
    radius[: count // 100] *= 20.0
    reach = float(rng.uniform(0.5, 5.0))
    nearest = np.full(SHAPE, np.inf)
    mark_balls(nearest, position, radius, low, width, reach)
    np.testing.assert_allclose(nearest, by_hand(position, radius, low, width, reach), atol=1e-9)


def test_what_was_marked_before_stays_where_it_is_nearer() -> None:
    nearest = np.full(SHAPE, -0.5)
    low = np.zeros(3)
    mark_balls(nearest, np.array([[5.0, 5.0, 4.0]]), np.array([0.1]), low, 1.0, 3.0)
    assert (nearest == -0.5).all()
