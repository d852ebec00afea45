"""A scan placed in a grid: where its sensor sits there, and which returns are of no obstacle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from weakref import WeakKeyDictionary

import numpy as np

from clearway.base.compiled import read_only
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State, freeze_array
from clearway.sensors.beams.binning import cell_tables, count_beams
from clearway.sensors.beams.lidar import Lidar, Scan
from clearway.sensors.cells.return_block import Filters
from clearway.sensors.cells.scan_cells import PlacedScan


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """Ground as a half-space of the grid frame: returns from it are no obstacles."""

    up: FloatArray
    """[3] unit normal, grid frame."""
    height_m: float
    """Ground is where up . point <= height_m + clearance_m; negative below the vehicle."""
    clearance_m: float = 0.3
    """Roughness: returns up to this high above the plane still count as ground."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "up", freeze_array(self.up, (3,)))

    @classmethod
    def at_height(cls, state: State, height_m: float, clearance_m: float = 0.3) -> Ground:
        """Level ground at a height of the world frame, seen from a vehicle in a state."""
        up = state.world_from_body[2]
        return cls(up, height_m - float(state.position_m[2]), clearance_m)


NO_GROUND = Ground(np.array([0.0, 0.0, 1.0]), -np.inf)
IDENTITY = (freeze_array(np.eye(3), (3, 3)), freeze_array(np.zeros(3), (3,)))


def place_scan(
    grid: AvoidanceGrid,
    lidar: Lidar,
    scan: Scan,
    grid_from_body: tuple[FloatArray, FloatArray] | None,
    ground: Ground | None,
) -> PlacedScan:
    """A scan in a grid; arguments as of `detect`."""
    if grid_from_body is None and ground is None:
        filters = _filters_at_scan(lidar)
    else:
        filters = _filters(lidar, grid_from_body or IDENTITY, ground or NO_GROUND)
    beams = count_beams(grid, lidar.pattern, filters.rotation)
    layers_in_range = layers_within(grid, lidar.pattern.max_range_m)
    return PlacedScan(scan.points_m, filters, cell_tables(grid), beams, layers_in_range)


@lru_cache(maxsize=16)
def layers_within(grid: AvoidanceGrid, range_m: float) -> int:
    """Layers that begin within a sensor's range."""
    return int(np.searchsorted(grid.range_edges_m[:-1], range_m * (1.0 - 1e-10)))


def _filters(
    lidar: Lidar, grid_from_body: tuple[FloatArray, FloatArray], ground: Ground
) -> Filters:
    rotation, translation = grid_from_body
    mounting, pattern = lidar.mounting, lidar.pattern
    return Filters(
        rotation=read_only(rotation @ mounting.body_from_sensor),
        origin=read_only(rotation @ mounting.position_m + translation),
        body=read_only(translation),
        up=ground.up,
        ground=float(ground.height_m + ground.clearance_m),
        min_range=float(pattern.min_range_m),
        max_range=float(pattern.max_range_m),
        airframe_radius=float(lidar.airframe_radius_m),
        half_spacing=0.5 * float(pattern.spacing_rad),
    )


_at_scan: WeakKeyDictionary[Lidar, Filters] = WeakKeyDictionary()
"""As of `_filters_at_scan`, for as long as there is the sensor."""


def _filters_at_scan(lidar: Lidar) -> Filters:
    """Where nothing has moved since the scan, and no ground is reported."""
    found = _at_scan.get(lidar)
    if found is None:
        found = _at_scan[lidar] = _filters(lidar, IDENTITY, NO_GROUND)
    return found
