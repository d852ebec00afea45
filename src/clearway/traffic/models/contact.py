"""When a ball that flies straight on touches a cell (5.13)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats2
from clearway.base.compiled import compiled
from clearway.traffic.models.ball_cell import cell_distance
from clearway.traffic.models.borders import Borders

SAMPLES = 8
"""Steps in which a ball passes near a cell."""

STEPS_BETWEEN = 64
"""Contacts shorter than one of so many parts of a sample's step may be missed."""


class Ball(NamedTuple):
    """A ball on its way, by lengths s from where it is now."""

    x: float
    y: float
    z: float
    ux: float
    uy: float
    uz: float
    radius: float


@compiled
def window(ball: Ball, center: Floats2, cell: int, bound: float) -> tuple[float, float]:
    """Lengths between which the ball may touch a cell, by the ball around that; empty if none."""
    x, y, z = center[cell, 0] - ball.x, center[cell, 1] - ball.y, center[cell, 2] - ball.z
    ahead = x * ball.ux + y * ball.uy + z * ball.uz
    half2 = (bound + ball.radius) ** 2 - (x * x + y * y + z * z - ahead * ahead)
    if half2 <= 0.0:
        return 1.0, 0.0
    half = np.sqrt(half2)
    if ball.ux == 0.0 and ball.uy == 0.0 and ball.uz == 0.0:
        return 0.0, 0.0
    return max(0.0, ahead - half), ahead + half


@compiled
def _gap(ball: Ball, s: float, place: tuple[int, int, int], borders: Borders) -> float:
    """Distance of the ball's surface from a cell after a length; negative if it overlaps it.

    A touch that is shallower than the grid's border tolerance does not count.
    """
    x, y, z = ball.x + s * ball.ux, ball.y + s * ball.uy, ball.z + s * ball.uz
    i, j, k = place
    return cell_distance(x, y, z, i, j, k, borders) - ball.radius + borders.tolerance_m


@compiled
def contact(
    ball: Ball, low: float, high: float, place: tuple[int, int, int], borders: Borders
) -> tuple[float, float, float]:
    """First and last length of contact, and how long it is in all.

    Samples find where the gap changes sign; it changes by no more than the length, so only
    between low samples a closer look is needed.
    """
    if low == high:
        touches = _gap(ball, low, place, borders) < 0.0
        return 0.0, np.inf, np.inf if touches else 0.0
    step = (high - low) / SAMPLES
    first, last, total = np.inf, -np.inf, 0.0
    here = _gap(ball, low, place, borders)
    s = low
    for q in range(1, SAMPLES + 1):
        after_s = low + q * step
        after = _gap(ball, after_s, place, borders)
        begin = end = s
        if here <= 0.0 and after <= 0.0:
            end = after_s
        elif here <= 0.0:
            end = _root(ball, s, here, after_s, after, place, borders)
        elif after <= 0.0:
            begin = _root(ball, s, here, after_s, after, place, borders)
            end = after_s
        elif here + after < step:
            begin, end = _between(ball, s, here, after_s, after, place, borders)
        if end > begin:
            first, last = min(first, begin), max(last, end)
            total += end - begin
        here, s = after, after_s
    return first, last, total


@compiled
def _root(
    ball: Ball,
    a: float,
    gap_a: float,
    b: float,
    gap_b: float,
    place: tuple[int, int, int],
    borders: Borders,
) -> float:
    """Where the gap is 0 between two lengths with opposite signs (false position, Illinois)."""
    for _ in range(60):
        c = b - gap_b * (b - a) / (gap_b - gap_a)
        gap_c = _gap(ball, c, place, borders)
        if (gap_c > 0.0) != (gap_b > 0.0):
            a, gap_a = b, gap_b
        else:
            gap_a *= 0.5
        if abs(c - b) <= borders.tolerance_m:
            return c
        b, gap_b = c, gap_c
    return b


@compiled
def _between(
    ball: Ball,
    a: float,
    gap_a: float,
    b: float,
    gap_b: float,
    place: tuple[int, int, int],
    borders: Borders,
) -> tuple[float, float]:
    """First and last contact between two lengths without one; empty if there is none.

    The gap changes by no more than the length, so it is safe to go on by the gap itself.
    """
    least = (b - a) / STEPS_BETWEEN
    s, gap = a, gap_a
    while gap > 0.0:
        before, gap_before = s, gap
        s += max(gap, least)
        if s >= b:
            return b, b
        gap = _gap(ball, s, place, borders)
    first = _root(ball, before, gap_before, s, gap, place, borders)
    s, gap = b, gap_b
    while gap > 0.0:
        before, gap_before = s, gap
        s -= max(gap, least)
        if s <= first:
            return first, first
        gap = _gap(ball, s, place, borders)
    return first, _root(ball, s, gap, before, gap_before, place, borders)
