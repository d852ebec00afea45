"""When two that move straight on share a volume: exact times, for cylinders and modified tau."""

from __future__ import annotations

import math

from clearway.base.compiled import compiled

NEVER = math.inf
"""Entry time of what never enters."""


@compiled
def level_interval(
    x: float,
    y: float,
    vx: float,
    vy: float,
    radius: float,
    tau: float,
    growth: float,
) -> tuple[float, float]:
    """(in, out) of the horizontal part on the whole time line, (inf, -inf) for never.

    x, y, vx, vy: one aircraft relative to the other, m and m/s. Inside is nearer than the radius
    grown until then; or, with `tau` above 0, converging, to pass within the radius, and at a
    modified tau (radius^2 - r^2) / (r . v) of at most `tau` s (Munoz et al. 2013, DO-365).
    """
    speed2, along = vx * vx + vy * vy, x * vx + y * vy
    apart2 = x * x + y * y - radius * radius
    square, linear = speed2 - growth * growth, 2.0 * (along - radius * growth)
    if square <= 1e-12:
        # As fast as the volume grows, or slower: once inside, inside for good.
        if apart2 <= 0.0:
            return 0.0, math.inf
        if square > -1e-12:
            return (-apart2 / linear, math.inf) if linear < -1e-12 else (math.inf, -math.inf)
        root = math.sqrt(max(linear * linear - 4.0 * square * apart2, 0.0))
        return (-linear - root) / (2.0 * square), math.inf
    inside = linear * linear - 4.0 * square * apart2
    if inside < 0.0:
        return math.inf, -math.inf
    root = math.sqrt(inside)
    enters, leaves = (-linear - root) / (2.0 * square), (-linear + root) / (2.0 * square)
    if tau > 0.0:
        sooner = linear + tau * speed2
        reach = sooner * sooner - 4.0 * square * (apart2 + tau * along)
        if reach >= 0.0:
            enters = min(enters, (-sooner - math.sqrt(reach)) / (2.0 * square))
    return enters, leaves


@compiled
def height_interval(z: float, vz: float, half_height: float) -> tuple[float, float]:
    """(in, out) of the vertical part on the whole time line, (inf, -inf) for never."""
    if abs(vz) < 1e-9:
        return (-math.inf, math.inf) if abs(z) <= half_height else (math.inf, -math.inf)
    one, other = (-half_height - z) / vz, (half_height - z) / vz
    return min(one, other), max(one, other)


@compiled
def find_shared_interval(
    x: float,
    y: float,
    z: float,
    vx: float,
    vy: float,
    vz: float,
    radius: float,
    half_height: float,
    tau: float,
    growth: float,
    within: float,
) -> tuple[float, float]:
    """(in, out) within the next `within` s, (inf, -inf) for never."""
    enters, leaves = level_interval(x, y, vx, vy, radius, tau, growth)
    low, high = height_interval(z, vz, half_height)
    begins, ends = max(enters, low, 0.0), min(leaves, high, within)
    return (begins, ends) if begins <= ends else (math.inf, -math.inf)
