"""What the window of free space does not hold is not marked in it, wherever the sensor sits."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.state import State
from clearway.sensors import BeamPattern, Lidar, Mounting, Scan
from clearway.sensors.observed.free_space import SHAPE, FreeSpace
from clearway.sensors.range_sensor import LidarSensor

VOXEL_M, RANGE_M = 0.25, 15.0
ALL_ROUND = BeamPattern.from_angles(
    np.radians(np.arange(-180.0, 180.0, 4.0)),
    np.radians(np.arange(-88.0, 89.0, 4.0)),
    max_range_m=RANGE_M,
)

LIDAR = Lidar("top", ALL_ROUND)


def marked_m(free: FreeSpace) -> np.ndarray:
    """[n, 3] middles of the voxels that count as free."""
    marked = np.unpackbits(free.seen.free.view(np.uint8), axis=2, bitorder="little")
    low = free.seen.low
    return (low + (np.argwhere(marked) - low) % np.array(SHAPE) + 0.5) * VOXEL_M


class SeesAll:
    """A sensor of one's own that looks through everything."""

    name, sigma_m = "all", 0.0

    def passes(self, _scan: Scan, _state: State, position_m: np.ndarray, *_: object) -> np.ndarray:
        return np.ones(len(position_m), dtype=bool)


@pytest.mark.parametrize(
    "height_m",
    [-4.0, 0.0, 3.9, *(pytest.param(one, marks=pytest.mark.nightly) for one in (-3.9, 4.0))],
)
def test_nor_by_a_sensor_of_ones_own(height_m: float) -> None:
    free, here = FreeSpace(VOXEL_M, np.zeros(3), reach_m=RANGE_M), np.array([0.0, 0.0, height_m])
    for time_s in range(50):
        free.take(SeesAll(), Scan(np.zeros((0, 3)), time_s, sensor="all"), State(here))  # type: ignore[arg-type]
    away_m = np.linalg.norm(marked_m(free) - here, axis=1)
    assert len(away_m) > 100_000
    assert away_m.max() <= RANGE_M


@pytest.mark.parametrize("above_m", [-5.0, -0.5, 0.0, 0.5, 5.0])
@pytest.mark.parametrize("height_m", [-3.9, 0.0, 3.9])
def test_nothing_is_marked_where_no_beam_can_reach(above_m: float, height_m: float) -> None:
    lidar = Lidar("top", ALL_ROUND, mounting=Mounting(np.array([0.0, 0.0, above_m])))
    free = FreeSpace(VOXEL_M, np.zeros(3), reach_m=1.2 * RANGE_M)
    here = State(np.array([0.0, 0.0, height_m]))
    free.take(LidarSensor(lidar), Scan(np.zeros((0, 3)), sensor="top"), here)
    sensor_m = np.array([0.0, 0.0, height_m + above_m])
    away_m = np.linalg.norm(marked_m(free) - sensor_m, axis=1)
    assert len(away_m) > 100_000
    assert away_m.max() <= RANGE_M


def test_what_is_seen_is_told_of_where_the_window_is_and_of_what_is_left_of_the_start() -> None:
    free, sensor = FreeSpace(VOXEL_M, np.zeros(3), 5.0, reach_m=RANGE_M), LidarSensor(LIDAR)

    def told() -> tuple[list[int], float]:
        seen = free.seen
        assert seen.window[4:8].tolist() == [0.0, 0.0, 0.0, free.start[1]]
        return seen.low.tolist(), float(seen.window[7])

    at_first, radius_m = told()
    assert radius_m == 5.0
    assert free.seen is free.seen, "told once until it changes"
    free.withdraw_start(np.array([[4.0, 0.0, 0.0]]), np.array([0.5]))
    assert told() == (at_first, 3.5)
    far_m = np.array([20.0, 0.0, 0.0])
    free.take(sensor, Scan(np.zeros((0, 3)), sensor="top"), State(far_m))
    moved, _ = told()
    assert moved[0] - at_first[0] == round(far_m[0] / VOXEL_M)
    assert moved[1:] == at_first[1:]
    free.forget()
    assert told() == (moved, 0.0)
