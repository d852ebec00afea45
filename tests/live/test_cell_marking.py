"""Coarse cells: how near balls come to their centres, and which were seen; against one by one."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.compiled import read_only
from clearway.live.routing.cell_marking import mark_seen, renew_nearest
from clearway.live.routing.nearest_balls import mark_balls

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
    mark_balls(nearest, read_only(position), read_only(radius), low, width, reach)
    np.testing.assert_allclose(nearest, by_hand(position, radius, low, width, reach), atol=1e-9)


def test_what_was_marked_before_stays_where_it_is_nearer() -> None:
    nearest = np.full(SHAPE, -0.5)
    low = np.zeros(3)
    mark_balls(nearest, read_only([[5.0, 5.0, 4.0]]), read_only([0.1]), low, 1.0, 3.0)
    assert (nearest == -0.5).all()


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("per_cell", [4, 8])
def test_a_cell_is_seen_where_most_of_its_eighths_are_free(seed: int, per_cell: int) -> None:
    """The window of free space lies anywhere, and its bits begin anywhere in it."""
    rng = np.random.default_rng([seed, per_cell])
    free_low = rng.integers(-500, 500, 3)
    free = rng.integers(0, 2**63, (32, 32, 2), dtype=np.uint64) * np.uint64(2)
    free[rng.random((32, 32)) < 0.5] = 0
    low, last = free_low // per_cell - 2, free_low + np.array([32, 32, 128])
    seen = rng.random((12, 12, 40)) < 0.1
    wanted = seen.copy()
    for cell in np.argwhere(~seen):
        begin = (low + cell) * per_cell
        if (begin < free_low).any() or (begin + per_cell > last).any():
            continue
        ends = np.array([per_cell // 4, per_cell - 1 - per_cell // 4])
        eighths = begin + ends[np.indices((2, 2, 2)).reshape(3, 8).T]
        u, v, w = eighths.T
        bits = free[u % 32, v % 32, w % 128 // 64] >> (w % 64).astype(np.uint64)
        wanted[tuple(cell)] = int(np.sum(bits & np.uint64(1))) >= 4
    mark_seen(seen, free, free_low, low, per_cell)
    assert 0.05 < wanted.mean() < 0.95
    np.testing.assert_array_equal(seen, wanted)


def test_what_is_not_known_any_more_was_nothing_nearby_alone() -> None:
    rng = np.random.default_rng(0)
    fresh = np.where(rng.random(SHAPE) < 0.3, rng.uniform(0.0, 3.0, SHAPE), np.inf)
    before = np.where(rng.random(SHAPE) < 0.3, rng.uniform(0.0, 3.0, SHAPE), np.inf)
    x, y, z = (rng.uniform(0.0, 9.0, n) for n in SHAPE)
    away = x[:, None, None] + y[:, None] + z
    nearest = before.copy()
    renew_nearest(nearest, fresh, (x, y, z), 12.0)
    np.testing.assert_array_equal(nearest[away <= 12.0], fresh[away <= 12.0])
    np.testing.assert_array_equal(nearest, np.where(away <= 12.0, fresh, np.minimum(fresh, before)))
