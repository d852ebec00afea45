"""Movements as curves: polynomials in the share of time flown, in Bernstein form.

The path of a movement is known at as many points as the vehicle is asked for. Between borders of
cells it is needed everywhere, so it is held as one polynomial, or several in a row, that agree with
what the vehicle predicts to FIT of the path's length. In Bernstein form a polynomial lies between
its smallest and its largest coefficient, which is what shows that a border is not crossed.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import comb

import numpy as np

from clearway.base.arrays import Floats, Floats2, StridedFloats
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray

DEGREE = 8
POINTS = 16
"""Points per polynomial that it is fitted to, beside its start: twice what determines it."""
FIT = 1e-11
"""Largest deviation at these points, as a share of the path's length."""
MOST_PARTS = 64
"""Polynomials in a row, where one does not fit: long turns, measured tables with corners."""

PathAt = Callable[[FloatArray], FloatArray]
"""Shares [n] of the time flown, 0 to 1 -> displacements [n, 3] from the start."""


def curve_parts(paths: list[PathAt]) -> FloatArray:
    """[paths, parts, DEGREE + 1, 3] Bernstein coefficients of each path, in as few parts as fit.

    All are cut into equally many parts of equal time. What does not fit in MOST_PARTS, such as a
    path with a jump, is left as near as that comes.
    """
    parts = 1
    while True:
        shares = np.arange(parts * POINTS + 1) / (parts * POINTS)
        points = np.array([path(shares) for path in paths]).reshape(len(paths), -1, 3)
        windows = np.stack(
            [points[:, part * POINTS : (part + 1) * POINTS + 1] for part in range(parts)], axis=1
        )
        curves, off = _fit(windows)
        length = np.linalg.norm(np.diff(points, axis=1), axis=-1).sum(axis=1)
        if np.all(off <= FIT * length[:, None]) or parts >= MOST_PARTS:
            return np.ascontiguousarray(curves)
        parts *= 2


def _fit(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients [..., DEGREE + 1, 3] through points [..., POINTS + 1, 3], and how far off [...].

    Ends are met exactly, so that movements chained have no gap between them.
    """
    values, inverse = _fit_matrices()
    curve = np.empty((*points.shape[:-2], DEGREE + 1, 3))
    curve[..., 0, :], curve[..., -1, :] = points[..., 0, :], points[..., -1, :]
    ends = values[:, [0, -1]] @ curve[..., [0, -1], :]
    curve[..., 1:-1, :] = inverse @ (points - ends)
    off: FloatArray = np.linalg.norm(values @ curve - points, axis=-1).max(axis=-1)
    return curve, off


@cache
def _fit_matrices() -> tuple[FloatArray, FloatArray]:
    """Bernstein polynomials at the points [points, degree + 1], and the fit of the inner ones."""
    share = np.arange(POINTS + 1)[:, None] / POINTS
    power = np.arange(DEGREE + 1)
    values = BINOMIALS * share**power * (1.0 - share) ** (DEGREE - power)
    inverse = np.asarray(np.linalg.pinv(values[:, 1:-1]), dtype=np.float64)
    return values, inverse


def _product_weights(degree: int) -> FloatArray:
    """[degree + 1, degree + 1] what a product of two coefficients adds to theirs of the product."""
    weights = np.empty((degree + 1, degree + 1))
    for i in range(degree + 1):
        for j in range(degree + 1):
            weights[i, j] = comb(degree, i) * comb(degree, j) / comb(2 * degree, i + j)
    return weights


PRODUCT_WEIGHTS = _product_weights(DEGREE)
BINOMIALS = np.array([comb(DEGREE, k) for k in range(DEGREE + 1)], dtype=np.float64)


@compiled
def square(coefficients: Floats, weights: Floats2, squared: Floats) -> None:
    """Add the square of a polynomial [n + 1] to `squared` [2 n + 1]."""
    for i in range(len(coefficients)):
        for j in range(len(coefficients)):
            squared[i + j] += weights[i, j] * coefficients[i] * coefficients[j]


@compiled
def value(scaled: Floats, share: float) -> float:
    """A polynomial at a share of its time, by its coefficients times `BINOMIALS`."""
    rest, power = 1.0 - share, 1.0
    total = scaled[0]
    for k in range(1, len(scaled)):
        power *= share
        total = total * rest + power * scaled[k]
    return float(total)


@compiled
def halve(coefficients: StridedFloats, first: StridedFloats, second: Floats) -> None:
    """Coefficients of the two halves of a polynomial (de Casteljau)."""
    degree = len(coefficients) - 1
    for k in range(degree + 1):
        second[k] = coefficients[k]
    for level in range(degree + 1):
        first[level] = second[0]
        for k in range(degree - level):
            second[k] = 0.5 * (second[k] + second[k + 1])


@compiled
def without_root(coefficients: StridedFloats, noise: float) -> bool:
    """Whether all coefficients beyond exact zeros at the start have one sign, and not by rounding.

    Then the polynomial has no root but at its start.
    """
    first = 0
    while first < len(coefficients) and coefficients[first] == 0.0:
        first += 1
    positive = negative = True
    for k in range(first, len(coefficients)):
        positive &= coefficients[k] > noise
        negative &= coefficients[k] < -noise
    return bool(positive or negative)
