"""Heights of the ground in a local frame, from a terrain raster, for the rule that keeps above it.

Every height is the highest sample of the raster within a step around it, so that what lies between
two heights is never above both.
"""

from __future__ import annotations

import numpy as np

from clearway.avoidance.rules import GroundHeights
from clearway.base.frames import enu_from_geodetic, geodetic_from_enu
from clearway.io.maps.placing import Bounds, Place
from clearway.io.maps.terrain import Terrain

MOST_HEIGHTS = 500
"""Along each side of the area."""


def ground_heights(terrain: Terrain, place: Place, bounds_m: Bounds) -> GroundHeights:
    """The ground within bounds of a local frame, as fine as the raster or as 500 steps a side."""
    from scipy.ndimage import maximum_filter

    low, high = bounds_m
    metres = _metres_a_sample(terrain, place)
    step = max(metres, float(np.max(high - low)) / MOST_HEIGHTS)
    columns, rows = np.ceil((high - low) / step).astype(np.int64) + 1
    east, north = np.meshgrid(low[0] + step * np.arange(columns), low[1] + step * np.arange(rows))
    places = np.stack([east, north, np.zeros_like(east)], axis=-1)
    latitude, longitude, _ = np.moveaxis(geodetic_from_enu(places, place.origin), -1, 0)
    x, y = terrain.from_geographic.transform(longitude.ravel(), latitude.ravel())
    column, across = _nearest(terrain.x, np.asarray(x))
    row, along = _nearest(terrain.y, np.asarray(y))
    around = 2 * int(np.ceil(step / metres)) + 3
    known = np.where(np.isnan(terrain.height_m), -np.inf, terrain.height_m)
    highest = maximum_filter(known, size=around, mode="nearest")[row, column]
    highest = np.where(across & along & np.isfinite(highest), highest, np.nan).reshape(east.shape)
    there = np.stack([latitude, longitude, highest], axis=-1)
    return GroundHeights(enu_from_geodetic(there, place.origin)[..., 2], low, step)


def _metres_a_sample(terrain: Terrain, place: Place) -> float:
    """The raster's finer spacing in metres: its reference system may count in degrees."""
    corners = place.enu(terrain.extent(), place.origin[2])[:, :2]
    rows, columns = terrain.height_m.shape
    sides = np.linalg.norm(corners[[1, 3]] - corners[0], axis=1)
    return float(min(sides / [columns, rows]))


def _nearest(samples: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index of the nearest sample, and whether there is one within half a spacing."""
    spacing = samples[1] - samples[0]
    index = np.round((at - samples[0]) / spacing).astype(np.int64)
    inside = (index >= 0) & (index < len(samples))
    return np.clip(index, 0, len(samples) - 1), inside
