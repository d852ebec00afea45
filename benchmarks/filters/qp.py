"""The command nearest to a wished one that keeps linear constraints."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray

FEASIBLE = 1e-8
"""Residual below which constraints contradict each other."""
DIRECTIONS = 16
"""Level directions in which an acceleration is limited."""


def nearest_kept(wished: FloatArray, rows: FloatArray, least: FloatArray) -> FloatArray | None:
    """Return the x [n] nearest to a wished one with rows [m, n] x >= least [m]; None without one.

    Notes
    -----
    Least distance programming by non-negative least squares (Lawson and Hanson, 1974, ch. 23).
    """
    from scipy.optimize import nnls

    lacks = least - rows @ wished
    if not len(rows) or float(lacks.max()) <= 0.0:
        return wished
    both = np.vstack([rows.T, lacks])
    target = np.zeros(len(both))
    target[-1] = 1.0
    weights, _ = nnls(both, target)
    residual = both @ weights - target
    if -residual[-1] <= FEASIBLE:
        return None
    nearest: FloatArray = wished - residual[:-1] / residual[-1]
    return nearest


def acceleration_limits(most_mps2: float) -> tuple[FloatArray, FloatArray]:
    """Return rows and least values that keep an acceleration [3] within a limit."""
    angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    level = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(DIRECTIONS)])
    rows = np.vstack([level, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
    return rows, np.full(len(rows), -most_mps2)
