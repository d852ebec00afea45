"""A polar histogram in three dimensions: how far each direction is free of balls."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.hazards import PointHazards
from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray, cartesian_from_spherical

BIN_RAD = np.radians(6.0)
COLUMNS = 60
"""Bins all around in azimuth."""


class Histogram(NamedTuple):
    """Free distances by direction, from one place in the level frame."""

    directions: FloatArray
    """[bins, 3] unit vectors to the middles of the bins."""
    free_m: FloatArray
    """[bins] distance at which the widened balls begin; the horizon where there are none."""


def bin_directions(steepest_rad: float) -> FloatArray:
    """[bins, 3] all around, up to an elevation either way."""
    rows = max(1, round(2.0 * steepest_rad / BIN_RAD))
    azimuth = BIN_RAD * np.arange(COLUMNS)
    elevation = BIN_RAD * (np.arange(rows) - 0.5 * (rows - 1))
    mesh = np.meshgrid(azimuth, elevation, indexing="ij")
    angles = np.stack([np.ones_like(mesh[0]), *mesh], axis=-1).reshape(-1, 3)
    return np.ascontiguousarray(cartesian_from_spherical(angles))


def histogram_at(
    place_m: FloatArray,
    balls: PointHazards,
    directions: FloatArray,
    spare_m: float,
    horizon_m: float,
) -> Histogram:
    """The histogram seen from a place [3], with every ball widened by `spare_m`."""
    return Histogram(
        directions,
        _free(place_m, balls.position_m, balls.radius_m, directions, spare_m, horizon_m),
    )


@compiled
def _free(
    place: Floats,
    position: Floats2,
    radius: Floats,
    directions: Floats2,
    spare: float,
    horizon: float,
) -> Floats:
    """[bins] where rays along the directions enter the nearest widened ball."""
    free = np.full(len(directions), horizon)
    for n in range(len(radius)):
        x, y, z = position[n, 0] - place[0], position[n, 1] - place[1], position[n, 2] - place[2]
        wide = radius[n] + spare
        outside = x * x + y * y + z * z - wide * wide
        if outside >= horizon * horizon:
            continue
        for b in range(len(directions)):
            along = x * directions[b, 0] + y * directions[b, 1] + z * directions[b, 2]
            if along <= 0.0:
                continue
            if outside <= 0.0:
                free[b] = 0.0
                continue
            chord = along * along - outside
            if chord >= 0.0:
                free[b] = min(free[b], along - np.sqrt(chord))
    return free
