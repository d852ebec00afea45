"""Which cells were seen to be free: against one by one."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.live.routing.field.cell_prices import middle_of_cell
from clearway.live.routing.field.route_levels import Levels
from clearway.live.routing.field.seen_marking import ASIDE, MOSTLY, mark_seen
from clearway.sensors.observed.free_voxels import WORD
from clearway.sensors.observed.seen_space import NOTHING_SEEN

VOXEL_M, COLUMNS = 0.25, 32


@pytest.mark.parametrize("layers", [1, 5])
@pytest.mark.parametrize("seed", range(6))
def test_a_cell_is_seen_where_most_of_its_eighths_are_free(seed: int, layers: int) -> None:
    """The window of free space lies anywhere, and its bits begin anywhere in it."""
    rng = np.random.default_rng([seed, layers])
    free_low = rng.integers(-500, 500, 3)
    free = rng.integers(0, 2**63, (COLUMNS, COLUMNS, 2), dtype=np.uint64) * np.uint64(2)
    free[rng.random((COLUMNS, COLUMNS)) < 0.5] = 0
    size, window = np.array([COLUMNS, COLUMNS, 2 * WORD]), NOTHING_SEEN.window.copy()
    window[:3], window[3] = free_low, 1.0 / VOXEL_M
    middle_m = (free_low + 0.5 * size) * VOXEL_M
    low = np.floor(middle_m[:2] / [[0.9], [1.8]]).astype(np.int64) // 2 * 2 - 6
    levels = Levels(2, 12, layers, low, np.zeros_like(low), 0.9, float(middle_m[2]) - 3.0, 1.4)
    seen = rng.random(2 * 12 * 12 * layers) < 0.1
    wanted = seen.copy()
    for cell in np.flatnonzero(~seen):
        x, y, z = middle_of_cell(levels, int(cell))
        aside = ASIDE * levels.width_m * (1 if cell < len(seen) // 2 else 2)
        up = ASIDE * levels.layer_m if layers > 1 else 0.0
        count = 0
        for u, v, w in np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), axis=-1).reshape(-1, 3):
            place = np.array([x + u * aside, y + v * aside, z + w * up])
            at = np.floor(place / VOXEL_M).astype(np.int64)
            if (at < free_low).any() or (at - free_low >= size).any():
                continue
            bits = free[at[0] % COLUMNS, at[1] % COLUMNS, at[2] % (2 * WORD) // WORD]
            count += int(bits >> np.uint64(at[2] % WORD)) & 1
        wanted[cell] = count >= MOSTLY
    space = NOTHING_SEEN._replace(free=free, window=window)
    mark_seen(levels, seen, space, middle_m, 100.0)
    assert 0.05 < wanted.mean() < 0.95
    np.testing.assert_array_equal(seen, wanted)


def test_all_is_seen_where_a_map_is_declared_complete() -> None:
    low = np.zeros((1, 2), dtype=np.int64)
    levels = Levels(1, 8, 1, low, low, 1.0, 0.0, 1.5)
    window = NOTHING_SEEN.window.copy()
    window[8:11], window[11:14] = [2.0, 0.0, -1.0], [5.0, 8.0, 1.0]
    seen = np.zeros(64, dtype=bool)
    mark_seen(levels, seen, NOTHING_SEEN._replace(window=window), np.zeros(3), 0.1)
    np.testing.assert_array_equal(
        seen.reshape(8, 8).all(axis=1), [False] * 2 + [True] * 3 + [False] * 3
    )
    assert seen.sum() == 24
