"""Half-lines by the bunch: what of each does not depend on a grid's inner borders.

Loops over a bunch ask no questions on the way, so that the machine takes several half-lines at a
time: they work out what may turn out not to be needed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats2
from clearway.base.compiled import compiled
from clearway.traffic.models.borders import RANGE, Borders

BUNCH = 64
"""So many fit the fastest memory."""

# Rows of `HalfLines.told`, [rows, BUNCH]. As given: place (m) and velocity (m/s) at time 0, and
# when it ends (s).
X = 0
Y = 1
Z = 2
SPEED_X = 3
SPEED_Y = 4
SPEED_Z = 5
END_S = 6
# As worked out. Lengths (m) run from the point closest to the origin, which keeps every crossing
# well scaled: how far before it the place is, that point, its distance squared, a unit vector along
# the line, and where it enters the grid's ball and leaves it; the latter is -inf where it does not.
LINE_SPEED = 7
PASSED = 8
NEAR_X = 9
NEAR_Y = 10
NEAR_Z = 11
NEAR2 = 12
ALONG_X = 13
ALONG_Y = 14
ALONG_Z = 15
START = 16
END = 17
# For columns: twice the area that is swept about the z axis for each m, positive leftwards; where
# it enters and leaves the ball, both mirrored if it turns right; tolerances there.
MOMENT = 18
FROM_X = 19
FROM_Y = 20
TO_X = 21
TO_Y = 22
FROM_SLACK = 23
TO_SLACK = 24
# For rows: distance of the nearest point, the sine of its elevation; sines of the elevation from
# where to where it goes before it turns, and after; likewise in the middle, and the row of that,
# from -1 below all of them: far below where it may be another's for all that rounding tells.
NEAR_AT = 25
NEAR_SINE = 26
FIRST_FROM = 27
FIRST_TO = 28
THEN_FROM = 29
THEN_TO = 30
MIDDLE_SINE = 31
MIDDLE_ROW_AT = 32


class HalfLines(NamedTuple):
    """Room for a bunch, and where its lines cross the borders between cells."""

    told: Floats2
    """[33, BUNCH] as above."""
    planes: Floats2
    """[columns + 1, BUNCH] length at which each azimuth is crossed; inf where it is not."""
    first: Floats2
    """[rows + 1, BUNCH] likewise each elevation, before the line's own turns."""
    then: Floats2
    """[rows + 1, BUNCH] after that."""
    spheres: Floats2
    """[layers, BUNCH] half the chord inside each range but the last; inf where it is not truly
    entered."""


@compiled
def room_for_lines(borders: Borders) -> HalfLines:
    """For a bunch that is yet to be reported."""
    return HalfLines(
        np.empty((33, BUNCH)),
        np.empty((borders.columns + 1, BUNCH)),
        np.empty((borders.rows + 1, BUNCH)),
        np.empty((borders.rows + 1, BUNCH)),
        np.empty((borders.layers, BUNCH)),
    )


@compiled
def measure_half_lines(lines: HalfLines, many: int, borders: Borders) -> None:
    """Work out of the first so many what only the grid's range bounds."""
    told, outer = lines.told, borders.table[RANGE, borders.layers]
    shallow = 2.0 * outer * borders.tolerance_m
    for n in range(many):
        px, py, pz = told[X, n], told[Y, n], told[Z, n]
        vx, vy, vz = told[SPEED_X, n], told[SPEED_Y, n], told[SPEED_Z, n]
        speed = np.sqrt(vx * vx + vy * vy + vz * vz)
        ux, uy, uz = vx / speed, vy / speed, vz / speed
        passed = -(px * ux + py * uy + pz * uz)
        cx, cy, cz = px + passed * ux, py + passed * uy, pz + passed * uz
        near2 = cx * cx + cy * cy + cz * cz
        inside2 = outer * outer - near2
        half_chord = np.sqrt(inside2)
        end = min(told[END_S, n] * speed - passed, half_chord)
        told[LINE_SPEED, n], told[PASSED, n], told[NEAR2, n] = speed, passed, near2
        told[NEAR_X, n], told[NEAR_Y, n], told[NEAR_Z, n] = cx, cy, cz
        told[ALONG_X, n], told[ALONG_Y, n], told[ALONG_Z, n] = ux, uy, uz
        told[START, n] = max(-passed, -half_chord)
        told[END, n] = end if (speed > 0.0) & (inside2 > shallow) else -np.inf


@compiled
def tell(
    lines: HalfLines,
    n: int,
    position: tuple[float, float, float],
    velocity: tuple[float, float, float],
    end_s: float,
) -> None:
    """Write down one of a bunch."""
    told = lines.told
    told[X, n], told[Y, n], told[Z, n] = position
    told[SPEED_X, n], told[SPEED_Y, n], told[SPEED_Z, n] = velocity
    told[END_S, n] = end_s
