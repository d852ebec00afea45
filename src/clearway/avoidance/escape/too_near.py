"""Cells about the vehicle in which no place keeps clear of returns: a search that goes on for long
looks loops up in them, instead of among the returns themselves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.escape.legs import EscapeTerms
from clearway.avoidance.escape.places import NEARLY
from clearway.base.arrays import Floats, Floats2, Ints, UInt8s3
from clearway.base.compiled import compiled

ACROSS = 128
UPWARDS = 64
"""Cells along both level axes, and along the vertical one."""
WIDTH = 0.4
"""Of a cell, in margins."""
STEPS = 64.0
"""Distances are kept in so many steps of a margin, rounded up."""
LONG = 6_000_000
"""So many returns are gone by at one decision before the cells are worth filling in."""
ASKED = 4_000
"""A look at places counts as so many returns more: what it costs where there are none."""
FILLED = -1
TOLD = 32
"""So many steps more or less say as much: a return that tells no more of its own cell is passed
over, of most walls all but a few."""
FAR = 255
"""In place of a distance of which nothing is known."""


class TooNear(NamedTuple):
    """How near a return lies at most, to all places of a cell; level frame of a decision."""

    steps: UInt8s3
    """[across, across, upwards] FAR where nothing is known."""
    margin_m: float
    """Which they are measured in."""
    looked: Ints
    """[1] all returns there are and ASKED, as often as places were looked up among them; FILLED
    once the cells are."""


def too_near(margin_m: float) -> TooNear:
    """Room for them: nobody has touched it."""
    steps = np.empty((ACROSS, ACROSS, UPWARDS), dtype=np.uint8)
    return TooNear(steps, margin_m, np.zeros(1, dtype=np.int64))


@compiled
def fill_in(near: TooNear, terms: EscapeTerms) -> None:
    """Note all returns that lie within the cells.

    Of returns close to each other one is enough: what a cell does not tell, the returns do.
    """
    near.looked[0] = FILLED
    steps, margin = near.steps, near.margin_m
    for i in range(ACROSS):
        for j in range(ACROSS):
            for k in range(UPWARDS):
                steps[i, j, k] = FAR
    width, bins, g = WIDTH * margin, terms.bins, terms.grid_from_level
    corner = 0.5 * np.sqrt(3.0) * width
    for n in range(len(bins.radius_m)):
        p0, p1, p2 = bins.position_m[n, 0], bins.position_m[n, 1], bins.position_m[n, 2]
        x = (g[0, 0] * p0 + g[1, 0] * p1 + g[2, 0] * p2) / width + ACROSS // 2
        y = (g[0, 1] * p0 + g[1, 1] * p1 + g[2, 1] * p2) / width + ACROSS // 2
        z = (g[0, 2] * p0 + g[1, 2] * p1 + g[2, 2] * p2) / width + UPWARDS // 2
        more = corner - bins.radius_m[n]
        about = int((NEARLY * margin - more) / width + 0.5)
        if min(x, y, z) <= about or max(x, y, z + ACROSS - UPWARDS) >= ACROSS - about - 1:
            continue
        a, b, c = int(x), int(y), int(z)
        if steps[a, b, c] <= TOLD + _steps(x, y, z, a, b, c, width, more, margin):
            continue
        for i in range(a - about, a + about + 1):
            for j in range(b - about, b + about + 1):
                for k in range(c - about, c + about + 1):
                    at_most = _steps(x, y, z, i, j, k, width, more, margin)
                    if at_most < steps[i, j, k]:
                        steps[i, j, k] = at_most


@compiled
def _steps(
    x: float,
    y: float,
    z: float,
    i: int,
    j: int,
    k: int,
    width: float,
    more: float,
    margin: float,
) -> int:
    """Distance of a cell's farthest place from a point, both in cells, and so much more."""
    dx, dy, dz = x - i - 0.5, y - j - 0.5, z - k - 0.5
    farthest = width * np.sqrt(dx * dx + dy * dy + dz * dz) + more
    return int(min(max(np.ceil(STEPS * farthest / margin), 0.0), float(FAR)))


@compiled
def are_near(
    places: Floats2,
    first: int,
    last: int,
    pose: Floats,
    start_s: float,
    within_m: float,
    wind: Floats,
    near: TooNear,
) -> bool:
    """Whether one of the places first to last of a loop that begins at a pose [4] and a time is
    known to lie that near to a return."""
    cosine, sine = np.cos(pose[3]), np.sin(pose[3])
    per_m = 1.0 / (WIDTH * near.margin_m)
    most = min(within_m * STEPS / near.margin_m, FAR - 1.0)
    for n in range(first, last):
        ahead, left, when = places[n, 0], places[n, 1], start_s + places[n, 3]
        x = (pose[0] + cosine * ahead - sine * left + wind[0] * when) * per_m + ACROSS // 2
        y = (pose[1] + sine * ahead + cosine * left + wind[1] * when) * per_m + ACROSS // 2
        z = (pose[2] + places[n, 2] + wind[2] * when) * per_m + UPWARDS // 2
        is_within = min(x, y, z) >= 0.0 and max(x, y, z + ACROSS - UPWARDS) < ACROSS
        if is_within and near.steps[int(x), int(y), int(z)] <= most:
            return True
    return False
