"""Cones that pass a grid by: none of their rays meets a cell, so that none need be followed."""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats
from clearway.base.compiled import compiled
from clearway.base.rounding import SURELY
from clearway.traffic.models.borders import AZIMUTH, ELEVATION, RANGE, Borders


@compiled
def ball_around(borders: Borders) -> tuple[float, float]:
    """The smallest ball around all cells: how far ahead of the origin its middle is, and its
    radius; metres."""
    outer = borders.table[RANGE, borders.layers]
    azimuths = borders.table[AZIMUTH, : borders.columns + 1]
    elevations = borders.table[ELEVATION, : borders.rows + 1]
    aside = max(abs(azimuths[0]), abs(azimuths[borders.columns]))
    above = max(abs(elevations[0]), abs(elevations[borders.rows]))
    # Of the outermost corners, seen from straight ahead.
    cosine = np.cos(min(aside, np.pi)) * np.cos(above)
    if borders.full_circle or cosine <= 0.0:
        return 0.0, outer
    if cosine * cosine <= 0.5:
        return outer * cosine, outer * np.sqrt(1.0 - cosine * cosine)
    through_corners = 0.5 * outer / cosine
    return through_corners, through_corners


@compiled
def passes_by(
    apex: Floats, velocity: Floats, tangent: float, middle_m: float, radius_m: float
) -> bool:
    """Whether a cone from an apex [3] along a velocity [3], not 0, surely misses a ball straight
    ahead of the origin. tangent: of half its angle, where it is widest."""
    speed = np.sqrt(velocity[0] ** 2 + velocity[1] ** 2 + velocity[2] ** 2)
    x, y, z = middle_m - apex[0], -apex[1], -apex[2]
    along = (x * velocity[0] + y * velocity[1] + z * velocity[2]) / speed
    away = np.sqrt(x * x + y * y + z * z)
    beside = np.sqrt(max(0.0, (away - along) * (away + along)))
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    # In the plane through axis and middle: beside the cone's edge, or behind its apex.
    off = beside * cosine - along * sine
    if off > 0.0 and along * cosine + beside * sine < 0.0:
        off = away
    # What rounding may take grows with how far away the apex is.
    return bool(off > SURELY * radius_m + (SURELY - 1.0) * away)
