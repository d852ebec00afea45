"""What is filled in along a wire: each voxel between two of its returns once, and none twice."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.sensors.memory.remembered import BETWEEN, Boxes
from clearway.sensors.memory.remembered import Pitch as VoxelPitch
from clearway.sensors.memory.swept_boxes import boxes_of_returns
from clearway.sensors.memory.wire_gaps import fill_between
from clearway.sensors.memory.wires import MOST_NEIGHBOURS, _by_cell, _neighbours, join_lines

VOXEL_M, NOW_S = 0.12, 7.0


def boxes_at(places_m) -> Boxes:
    """A box for each place that has a voxel of its own."""
    count, nothing = len(places_m), np.zeros(len(places_m))
    pitch = VoxelPitch(VOXEL_M, np.inf)
    return boxes_of_returns(
        np.ascontiguousarray(places_m), nothing, np.zeros(count), np.zeros(3), pitch, 3.0
    )


def voxel_of(place_m) -> tuple[int, ...]:
    return tuple(np.floor(np.asarray(place_m) * (1.0 / VOXEL_M)).astype(int).tolist())


@pytest.mark.parametrize("seed", range(12))
def test_every_voxel_between_is_filled_in_that_none_is_in(seed: int) -> None:
    """Held against a dictionary; pairs either way round, far and near, some on one another."""
    rng = np.random.default_rng(seed)
    boxes = boxes_at(rng.uniform(-4.0, 4.0, (int(rng.integers(2, 3000)), 3)))
    middles = 0.5 * (boxes.low_m + boxes.high_m)
    pairs = rng.integers(0, len(middles), (int(rng.integers(1, 40)), 2))
    found = fill_between(boxes, middles, pairs, VOXEL_M, NOW_S)
    known = len(boxes.doubt)
    for before, after in zip(boxes, found, strict=True):
        np.testing.assert_array_equal(before, after[:known])
    taken = {voxel_of(place) for place in middles}
    between: dict[tuple[int, ...], list] = {}
    for one, other in pairs.tolist():
        if tuple(middles[one, :2]) > tuple(middles[other, :2]):
            one, other = other, one
        way = middles[other] - middles[one]
        pieces = int(np.ceil(np.sqrt(np.sum(way**2)) / VOXEL_M))
        for piece in range(1, pieces):
            place = middles[one] + way * (piece / pieces)
            if voxel_of(place) not in taken:
                between.setdefault(voxel_of(place), []).append(place)
    assert len(found.doubt) - known == len(between)
    for n, places in enumerate(between.values(), known):
        np.testing.assert_allclose(found.low_m[n], np.min(places, axis=0), atol=1e-12)
        np.testing.assert_allclose(found.high_m[n], np.max(places, axis=0), atol=1e-12)
        assert found.kind[n] == BETWEEN
        assert found.last_seen_s[n] == NOW_S


@pytest.mark.parametrize("seed", range(6))
def test_a_wire_is_joined_and_rain_is_not(seed: int) -> None:
    """Returns every half metre along a wire, anywhere and in any direction."""
    rng = np.random.default_rng(seed)
    along = rng.normal(size=3)
    along /= np.linalg.norm(along)
    start = rng.uniform(-50.0, 50.0, 3)
    wire = boxes_at(start + np.arange(0.0, 6.0, 0.5)[:, None] * along)
    joined = join_lines(wire, 0, VOXEL_M, 0.06, NOW_S)
    filled = joined.kind == BETWEEN
    middles = 0.5 * (joined.low_m + joined.high_m)
    off = middles - start - ((middles - start) @ along)[:, None] * along
    assert filled.sum() > 30
    assert np.abs(off).max() < 1e-9
    rain = boxes_at(start + rng.uniform(-3.0, 3.0, (40, 3)))
    assert not (join_lines(rain, 0, VOXEL_M, 0.06, NOW_S).kind == BETWEEN).any()


@pytest.mark.parametrize("spread_m", [0.5, 1.5, 6.0])
@pytest.mark.parametrize("size_m", [0.8, 2.4])
def test_neighbours_are_all_within_a_distance_or_too_many(spread_m: float, size_m: float) -> None:
    """Some of the boxes are thick and are none."""
    rng = np.random.default_rng(0)
    middles = rng.normal(0.0, spread_m, (800, 3)) - 20.0
    thin = rng.random(len(middles)) < 0.7
    cells = _by_cell(middles, thin, size_m)
    near, crowded = np.empty(MOST_NEIGHBOURS + 1, dtype=np.int64), 0
    for n in range(0, len(middles), 7):
        within = np.linalg.norm(middles - middles[n], axis=1) <= size_m
        expected = np.flatnonzero(within & thin & (np.arange(len(middles)) != n))
        found = _neighbours(middles, n, cells, near)
        if len(expected) > MOST_NEIGHBOURS:
            crowded += 1
            assert found == -1
        else:
            assert np.array_equal(np.sort(near[:found]), expected)
    assert (crowded > 0) == (spread_m * 1.7 < size_m * 2.0)
