"""Cells that a movement passes (4.25): where its curve crosses borders, and what lies between.

Spheres, half-planes and cones bound the cells. Along a curve given by polynomials each of them is
the root of a polynomial, and intervals of time are halved until the coefficients show that there is
none, or that there is one. Between neighbouring roots lies one cell. A root too many does no
harm, so the other half of a plane and the mirror image of a cone need no care.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, StridedFloats
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.grid import GridEdges, angle_borders, cell_of_point, range_borders
from clearway.reach.expand.curves import (
    BINOMIALS,
    DEGREE,
    PRODUCT_WEIGHTS,
    halve,
    square,
    value,
    without_root,
)

ROUNDING = 1e-14
"""What rounding may make of a coefficient, as a share of the largest term in it."""
NARROWEST = 1e-9
"""Share of a movement's time below which intervals are not halved."""
MOST_LOOKED_AT = 2000
"""Intervals looked at for one border, after which those that rounding hides are not halved."""
TOUCH = 1e-12
"""A curve that comes as near as that to a border, as a share of its distance, touches it."""
CLOSE = 1e-12
"""Share of a movement's time to which crossings are found; the last step squares what is left."""
FLAT = 1e-8
"""Sine of the elevation below which a cone is taken for a plane."""
ROOTS_PER_BORDER = 32
DEEPEST = 64
"""Intervals that wait at most: two for each halving down to the narrowest."""

RANGE = 0
AZIMUTH = 1
ELEVATION = 2


class CellBorders(NamedTuple):
    """The borders between cells, moved by the tolerance with which points belong to them."""

    range_m: Floats
    azimuth: Floats2
    """[columns + 1, 2] sine and cosine."""
    elevation: Floats2
    """[rows + 1, 2] sine and cosine."""


class CrossingSearch(NamedTuple):
    """Arrays that the search for crossings works in, made once for all movements."""

    crossings: Floats
    """Shares of time found."""
    weights: Floats2
    """For squares of polynomials."""
    axes: Floats2
    """[3, degree + 1] coefficients of x, y and z."""
    scaled: Floats2
    """The same times `binomials`, as `value` takes them."""
    binomials: Floats
    level2: Floats
    height2: Floats
    of_border: Floats
    waiting: Floats2
    low: Floats
    high: Floats
    second: Floats


def list_cell_borders(edges: GridEdges) -> CellBorders:
    """The borders of a grid, for `crossings`."""
    return CellBorders(
        range_borders(edges.range_m),
        _sine_and_cosine(angle_borders(edges.azimuth_rad)),
        _sine_and_cosine(angle_borders(edges.elevation_rad)),
    )


def _sine_and_cosine(angles: FloatArray) -> FloatArray:
    return np.ascontiguousarray(np.stack([np.sin(angles), np.cos(angles)], axis=1))


def crossing_search(borders: CellBorders) -> CrossingSearch:
    """Room for the crossings of any movement with these borders."""
    number = sum(len(each) for each in borders)
    order = 2 * DEGREE + 1
    return CrossingSearch(
        crossings=np.empty(ROOTS_PER_BORDER * number),
        weights=PRODUCT_WEIGHTS,
        axes=np.empty((3, DEGREE + 1)),
        scaled=np.empty((3, DEGREE + 1)),
        binomials=BINOMIALS,
        level2=np.empty(order),
        height2=np.empty(order),
        of_border=np.empty(order),
        waiting=np.empty((DEEPEST, order)),
        low=np.empty(DEEPEST),
        high=np.empty(DEEPEST),
        second=np.empty(order),
    )


@compiled
def crossings(curve: Floats2, borders: CellBorders, search: CrossingSearch) -> int:
    """Shares of time, ascending in `search.crossings`, at which a curve [degree + 1, 3] crosses.

    Returns how many there are. The curve is in the grid frame.
    """
    axes, level2, height2 = search.axes, search.level2, search.height2
    level2[:] = 0.0
    height2[:] = 0.0
    for k in range(len(curve)):
        for axis in range(3):
            axes[axis, k] = curve[k, axis]
            search.scaled[axis, k] = search.binomials[k] * curve[k, axis]
    square(axes[0], search.weights, level2)
    square(axes[1], search.weights, level2)
    square(axes[2], search.weights, height2)
    near2, far2 = np.inf, 0.0
    for k in range(len(level2)):
        near2 = min(near2, level2[k] + height2[k])
        far2 = max(far2, level2[k] + height2[k])
    noise = ROUNDING * max(far2, -near2)
    count = 0
    for radius in borders.range_m:
        square_m = radius * radius
        if near2 - square_m <= noise and far2 - square_m >= -noise:
            for k in range(len(level2)):
                search.of_border[k] = level2[k] + height2[k] - square_m
            count = _roots(len(level2), noise, RANGE, (square_m, 0.0), search, count)
    for n in range(len(borders.azimuth)):
        border = (borders.azimuth[n, 0], borders.azimuth[n, 1])
        noise, clear = _difference(border[1], axes[1], border[0], axes[0], search.of_border)
        if not clear:
            count = _roots(len(curve), noise, AZIMUTH, border, search, count)
    for n in range(len(borders.elevation)):
        border = (borders.elevation[n, 0], borders.elevation[n, 1])
        order = len(level2)
        if abs(border[0]) < FLAT:
            # Squares would hide the sign, and a cone as flat as that is a plane.
            order = len(curve)
            noise, clear = _difference(border[1], axes[2], border[0], axes[0], search.of_border)
        else:
            noise, clear = _difference(
                border[1] ** 2, height2, border[0] ** 2, level2, search.of_border
            )
        if not clear:
            count = _roots(order, noise, ELEVATION, border, search, count)
    search.crossings[:count].sort()
    return count


@compiled
def _difference(
    cosine: float, upward: Floats, sine: float, across: Floats, of_border: Floats
) -> tuple[float, bool]:
    """Enter cosine * upward - sine * across; what rounding may make of it, and whether it has none.

    "Has none" is of roots: see `without_root`.
    """
    largest = 0.0
    for k in range(len(upward)):
        up, along = cosine * upward[k], sine * across[k]
        largest = max(largest, abs(up), abs(along))
        of_border[k] = up - along
    noise = ROUNDING * largest
    return noise, without_root(of_border[: len(upward)], noise)


@compiled
def cell_at(share: float, search: CrossingSearch, edges: GridEdges) -> int:
    """The cell at a share of time of the curve that `search` was last used for; -1 outside."""
    scaled = search.scaled
    return cell_of_point(
        value(scaled[0], share), value(scaled[1], share), value(scaled[2], share), edges
    )


@compiled
def _roots(
    order: int,
    noise: float,
    kind: int,
    border: tuple[float, float],
    search: CrossingSearch,
    count: int,
) -> int:
    """Add to `count` crossings where a curve crosses one border; how many there are then.

    order: of the coefficients in `search.of_border`, whose roots they are.
    """
    waiting, low, high = search.waiting[:, :order], search.low, search.high
    second, scaled = search.second[:order], search.scaled
    waiting[0], low[0], high[0] = search.of_border[:order], 0.0, 1.0
    depth, looked_at = 1, 0
    while depth > 0:
        depth -= 1
        a, b = low[depth], high[depth]
        if count >= len(search.crossings) or without_root(waiting[depth], noise):
            continue
        looked_at += 1
        single = _changes_of_sign(waiting[depth], noise) == 1
        narrow = b - a <= NARROWEST
        if looked_at > MOST_LOOKED_AT and not narrow:
            # It runs along the border, or leaves it slowly: rounding tells no more of this part.
            narrow = np.max(np.abs(waiting[depth])) <= noise
        if single or narrow:
            before, after = _beyond(a, kind, border, scaled), _beyond(b, kind, border, scaled)
            if before * after < 0.0:
                search.crossings[count] = _bracket(a, b, before, after, kind, border, scaled)
                count += 1
                continue
            if single and before != 0.0 and after != 0.0:
                continue  # The other half of a plane, or the mirror image of a cone.
        middle = 0.5 * (a + b)
        if narrow:
            if _touches(middle, kind, border, scaled):
                search.crossings[count] = middle
                count += 1
            continue
        halve(waiting[depth], waiting[depth + 1], second)
        waiting[depth] = second
        low[depth], high[depth] = middle, b
        low[depth + 1], high[depth + 1] = a, middle
        depth += 2
    return count


@compiled
def _changes_of_sign(coefficients: StridedFloats, noise: float) -> int:
    """Changes of sign from one coefficient to the next; -1 where rounding may have made a sign.

    One change means one root, none means none (Descartes' rule in Bernstein form).
    """
    changes, last = 0, 0.0
    for coefficient in coefficients:
        if abs(coefficient) <= noise:
            return -1
        if coefficient * last < 0.0:
            changes += 1
        last = coefficient
    return changes


@compiled
def _beyond(
    share: float,
    kind: int,
    border: tuple[float, float],
    scaled: Floats2,
) -> float:
    """Positive on one side of a border and negative on the other."""
    across, left = value(scaled[0], share), value(scaled[1], share)
    if kind == RANGE:
        return float(across * across + left * left + value(scaled[2], share) ** 2 - border[0])
    if kind == AZIMUTH:
        return border[1] * left - border[0] * across
    level = np.sqrt(across * across + left * left)
    return float(border[1] * value(scaled[2], share) - border[0] * level)


@compiled
def _touches(
    share: float,
    kind: int,
    border: tuple[float, float],
    scaled: Floats2,
) -> bool:
    """Whether the curve comes to a border, for all that rounding tells."""
    distance2 = 0.0
    for axis in range(3):
        distance2 += value(scaled[axis], share) ** 2
    scale = distance2 if kind == RANGE else np.sqrt(distance2)
    return bool(abs(_beyond(share, kind, border, scaled)) <= TOUCH * scale)


@compiled
def _bracket(
    low: float,
    high: float,
    before: float,
    after: float,
    kind: int,
    border: tuple[float, float],
    scaled: Floats2,
) -> float:
    """The crossing between two shares of time on different sides of a border (Ridders' method)."""
    best = 0.5 * (low + high)
    for _ in range(60):
        middle = 0.5 * (low + high)
        at = _beyond(middle, kind, border, scaled)
        slope = np.sqrt(at * at - before * after)
        if at == 0.0 or slope == 0.0:
            return float(middle)
        guess = middle + (middle - low) * (at if before > after else -at) / slope
        step = abs(guess - best)
        best = guess
        there = _beyond(guess, kind, border, scaled)
        if there == 0.0 or step <= CLOSE:
            return float(guess)
        if at * there < 0.0:
            low, before, high, after = middle, at, guess, there
            if low > high:
                low, before, high, after = high, after, low, before
        elif before * there < 0.0:
            high, after = guess, there
        else:
            low, before = guess, there
        if high - low <= CLOSE:
            break
    return float(best)
