"""Whether a ball was seen to be free, held against every voxel one by one."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.sensors.free_space import NO_BOX, is_free

VOXEL_M = 0.25
SHAPE = (32, 32, 16)


def nearest_unseen_m(free: np.ndarray, low: np.ndarray, place: np.ndarray) -> float:
    """Distance of a place to the nearest voxel that was not seen to be free."""
    unseen = np.argwhere(free == 0)
    first = low + (unseen - low) % np.array(SHAPE)  # A voxel lies at its number modulo the shape.
    corner = first * VOXEL_M
    off = np.maximum(np.maximum(corner - place, place - corner - VOXEL_M), 0.0)
    return float(np.linalg.norm(off, axis=1).min())


@pytest.mark.parametrize("seed", range(6))
def test_a_ball_is_free_where_it_meets_no_voxel_that_was_not_seen(seed: int) -> None:
    rng = np.random.default_rng(seed)
    free = (rng.random(SHAPE) < 0.97).astype(np.uint8)
    low = rng.integers(-40, 40, 3)
    window = np.concatenate([low, [1.0 / VOXEL_M], np.zeros(4), NO_BOX.ravel()])
    answers = set()
    for _ in range(300):
        place = (low + rng.uniform(4.0, 12.0, 3)) * VOXEL_M
        radius = float(rng.uniform(0.0, 0.7))
        away = nearest_unseen_m(free, low, place)
        if abs(away - radius) > 1e-9:
            answer = bool(is_free(free, window, *place, radius))
            assert answer == (away > radius)
            answers.add(answer)
    assert answers == {True, False}
