"""When and where in an elliptic cone the corners of all cells lie, the one cone after the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.traffic.models.borders import (
    AZIMUTH_COS,
    AZIMUTH_SIN,
    ELEVATION_COS,
    ELEVATION_SIN,
    RANGE,
    Borders,
)

INSIDE = 16
"""Beside four bits for the planes about the cone."""


class Corners(NamedTuple):
    """Corners of all cells in the order of their edges, [layer][column][row], and scratch."""

    place_m: Floats2
    """[3, corners]"""
    arrival_s: Floats2
    """[3, corners] time of arrival there, and deviations, as `arrival_at`."""
    side: Ints
    """[corners] in bits: inside the cone, or beyond which of four planes about it."""


@compiled
def cone_of(apex: Floats, along: Floats, level: Floats, across: Floats) -> Floats2:
    """A cone [3, 4]: rows that give time of arrival, level and across deviation of (x, y, z, 1).

    along: unit vector over the speed; level, across: unit vectors over the growth of the semi-axes
    per second. All three results are in seconds: inside, the deviations are less than the time.
    """
    cone = np.empty((3, 4))
    cone[0, :3], cone[1, :3], cone[2, :3] = along, level, across
    for row in range(3):
        cone[row, 3] = -np.sum(cone[row, :3] * apex)
    return cone


@compiled
def arrival_at(x: float, y: float, z: float, cone: Floats2) -> tuple[float, float, float]:
    """Time of arrival at a point and its deviations, level and across, all in seconds."""
    return (
        x * cone[0, 0] + y * cone[0, 1] + z * cone[0, 2] + cone[0, 3],
        x * cone[1, 0] + y * cone[1, 1] + z * cone[1, 2] + cone[1, 3],
        x * cone[2, 0] + y * cone[2, 1] + z * cone[2, 2] + cone[2, 3],
    )


@compiled
def is_inside(time: float, level: float, across: float) -> bool:
    return time >= 0.0 and level * level + across * across <= time * time


@compiled
def corners_of(borders: Borders) -> Corners:
    """A grid's corners, and room for what one cone after the other makes of them."""
    table = borders.table
    count = (borders.layers + 1) * (borders.columns + 1) * (borders.rows + 1)
    place, at = np.empty((3, count)), 0
    for i in range(borders.layers + 1):
        r = table[RANGE, i]
        for j in range(borders.columns + 1):
            for k in range(borders.rows + 1):
                level = table[ELEVATION_COS, k]
                place[0, at] = r * (level * table[AZIMUTH_COS, j])
                place[1, at] = r * (level * table[AZIMUTH_SIN, j])
                place[2, at] = r * table[ELEVATION_SIN, k]
                at += 1
    return Corners(place, np.empty((3, count)), np.empty(count, dtype=np.int64))


@compiled
def arrive(cone: Floats2, corners: Corners) -> None:
    """Fill in when a cone arrives at each corner and on which side of it that lies; no branch
    asks, so that the machine takes several at a time."""
    place, arrival, side = corners
    for at in range(len(side)):
        time, u, w = arrival_at(place[0, at], place[1, at], place[2, at], cone)
        arrival[0, at], arrival[1, at], arrival[2, at] = time, u, w
        beyond = 1 * (u > time) + 2 * (u < -time) + 4 * (w > time) + 8 * (w < -time)
        side[at] = INSIDE if (time >= 0.0) & (u * u + w * w <= time * time) else beyond
