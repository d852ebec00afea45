"""What a sweep marks is what each voxel, asked on its own, says: no column is passed over."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.frames import world_from_body
from clearway.sensors.beams.pattern import BeamPattern
from clearway.sensors.beams.raster import beam_raster, nearest_returns
from clearway.sensors.observed.free_marking import (
    COLUMNS,
    ROWS,
    WITHIN,
    _goes_on,
    _nearest_around,
    field_of,
    mark,
)
from clearway.sensors.observed.seen_space import WORD, pack_voxels
from clearway.sensors.passing.passed_points import Sensor

VOXEL_M, SHORT_M = 0.3, 0.4


def pattern(rng: np.random.Generator, seed: int) -> BeamPattern:
    """All round, to a side, straight up or across the rear, narrow and wide."""
    wide_deg, middle_deg = rng.uniform(10.0, 178.0), rng.uniform(-60.0, 60.0)
    if seed % 4 == 0:
        wide_deg = 360.0
    if seed % 4 == 1:
        middle_deg = rng.uniform(-180.0, 180.0)
    across = np.arange(int(rng.integers(8, 60))) / 60.0 * wide_deg + middle_deg - wide_deg / 2
    up = np.linspace(*np.sort(rng.uniform(-88.0, 88.0, 2)), int(rng.integers(4, 20)))
    azimuth, elevation = np.meshgrid(np.radians((across + 180.0) % 360.0 - 180.0), np.radians(up))
    spacing = float(np.radians(max(wide_deg / 60.0, np.diff(up).max())))
    return BeamPattern("p", azimuth.ravel(), elevation_rad=elevation.ravel(), spacing_rad=spacing)


@pytest.mark.parametrize("seed", [*range(8), 19, 29, 42, 47, 65, 70])
def test_every_voxel_is_marked_that_says_so(seed: int) -> None:
    """The later ones have columns that only just reach into what beams see."""
    rng = np.random.default_rng(seed)
    raster = beam_raster(pattern(rng, seed))
    field = field_of(raster)
    rotation = world_from_body(rng.uniform([-0.6, -1.2, -3.0], [0.6, 1.2, 3.0]))
    origin, reach = rng.uniform(-2.0, 2.0, 3), float(rng.uniform(2.0, 4.5))
    blind = float(rng.choice([0.0, 0.6]))
    sensor = Sensor(rotation, origin, origin, blind, 30.0, 0.0, 0.01, 0.0)
    nearest = nearest_returns(rng.normal(size=(40, 3)) * 2.0, raster)
    free = pack_voxels(np.zeros((COLUMNS, COLUMNS, ROWS), dtype=np.bool_))
    low = np.array([-COLUMNS // 2, -COLUMNS // 2, -ROWS // 2])
    mark(free, low, VOXEL_M, raster, field, nearest, sensor, reach, SHORT_M)

    around, far = _nearest_around(nearest, raster), int(reach / VOXEL_M) + 3
    tall = min(reach, (WITHIN * ROWS - 1.0) * VOXEL_M)
    ticks = np.arange(-far, far + 1)
    steps = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    voxels = np.floor(origin / VOXEL_M).astype(np.int64) + steps
    said = 0
    for a, b, c in voxels.tolist():
        away = (np.array([a, b, c]) + 0.5) * VOXEL_M - origin
        x, y, z = (rotation.T @ away).tolist()
        distance = float(np.linalg.norm(away))
        within = blind <= distance <= reach and abs(away[2]) <= tall
        aside = abs(x) + abs(y)
        sees = field.behind or (x >= 0.0 and field.right * aside <= y <= field.left * aside)
        sees = sees and field.least * distance <= z <= field.most * distance
        says = within and sees and _goes_on(x, y, z, distance, SHORT_M, around, field)
        word = free[a & (COLUMNS - 1), b & (COLUMNS - 1), (c & (ROWS - 1)) // WORD]
        assert bool(int(word) >> (c & (WORD - 1)) & 1) == says, (a, b, c)
        said += says
    assert int(np.unpackbits(free.view(np.uint8)).sum()) == said
    assert said or seed % 4 != 0
