"""What share of a small box an obstacle fills: the step under both volume rules of the map.

Smooth surfaces count as planes, moved by their curvature; what is smaller than the box is
counted by its volume, so that a wire between two sample points does not vanish.
"""

from __future__ import annotations

from clearway.base.compiled import compiled
from clearway.obstacles.rounded_box import box_distance, offset_volume


@compiled
def half_space_share(b1: float, b2: float, b3: float, distance: float) -> float:
    """Share of a box on the inner side of a plane.

    b1, b2, b3: box widths times the plane normal's components, without sign; distance: of the
    box's centre outside the plane. Exact (the plane cut of interface reconstruction).
    """
    total = b1 + b2 + b3
    depth = 0.5 - distance / total
    if depth <= 0.0:
        return 0.0
    if depth >= 1.0:
        return 1.0
    low = max(min(b1, min(b2, b3)) / total, 1e-6)
    high = max(b1, max(b2, b3)) / total
    middle = max(1.0 - low - high, 1e-6)
    a = min(depth, 1.0 - depth)
    lower = low + middle
    if a < low:
        share = a * a * a / (6.0 * low * middle * high)
    elif a < middle:
        share = (a * (a - low) + low * low / 3.0) / (2.0 * middle * high)
    elif lower <= high and a >= lower:
        share = (a - 0.5 * lower) / high
    else:
        cubes = low * low * (low - 3.0 * a) + middle * middle * (middle - 3.0 * a)
        if a < high:
            share = (a * a * (3.0 * lower - a) + cubes) / (6.0 * low * middle * high)
        else:
            cubes += high * high * (high - 3.0 * a)
            share = (a * a * (3.0 - 2.0 * a) + cubes) / (6.0 * low * middle * high)
    share = min(max(share, 0.0), 0.5)
    return share if depth <= 0.5 else 1.0 - share


@compiled
def interval_share(offset: float, half: float, width: float) -> float:
    """Share of [offset - width/2, offset + width/2] that lies within [-half, half]."""
    low = max(offset - 0.5 * width, -half)
    high = min(offset + 0.5 * width, half)
    return max(high - low, 0.0) / width


@compiled
def blur_share(
    x: float, y: float, z: float, hx: float, hy: float, hz: float, radius: float, width: float
) -> float:
    """Share of a cube around a local point that a rounded box fills, keeping its volume.

    Averaged over all places of the cube this is exact; in one place it is good to a few hundredths.
    """
    if radius < 0.5 * width:
        share = (
            interval_share(x, hx + radius, width)
            * interval_share(y, hy + radius, width)
            * interval_share(z, hz + radius, width)
        )
        if radius > 0.0 and min(hx, min(hy, hz)) + radius < 0.5 * width:
            bounding = 8.0 * (hx + radius) * (hy + radius) * (hz + radius)
            share *= offset_volume(hx, hy, hz, radius) / bounding
        return share
    distance = box_distance(x, y, z, hx, hy, hz) - radius
    if distance <= -0.5 * width:
        return 1.0
    if distance >= 0.5 * width:
        return 0.0
    return (0.5 - distance / width) * _shell_factor(hx, hy, hz, radius, width)


@compiled
def _shell_factor(hx: float, hy: float, hz: float, radius: float, width: float) -> float:
    """By what a linear shell of one width around the surface must shrink to keep the volume."""
    # Mean of Steiner's cubic over offsets within half a width, from its moments.
    second = width * width / 12.0
    curved = 2.0 * 3.141592653589793 * (hx + hy + hz) + 4.0 * 3.141592653589793 * radius
    volume = offset_volume(hx, hy, hz, radius)
    core = offset_volume(hx, hy, hz, radius - 0.5 * width)
    return (volume - core) / (volume + curved * second - core)
