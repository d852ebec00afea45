"""The beam pattern behind a measured scan, estimated where nobody states it.

Spinning sensors leave rings of one elevation each; what has none gets an even raster as dense as
its returns. The pattern's name says which, and what was assumed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from clearway.base.checks import check_points
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, spherical_from_cartesian
from clearway.sensors.beams.named_patterns import NAMED_PATTERNS
from clearway.sensors.beams.pattern import BeamPattern

RING_GAP_RAD = np.radians(0.02)
"""Elevations closer than this belong to one ring."""
RETURNS_PER_RING = 8
"""Fewer returns make no ring."""
RING_SHARE = 0.95
"""Share of the returns that must lie in rings."""
MATCH_RAD = np.radians(0.05)
"""How near every ring must be to a laser of a known sensor."""
MATCH_SHARE = 0.6
"""Share of a known sensor's lasers that must be seen."""
OPEN_GAP_RAD = np.pi / 2
"""A wider sector without any return counts as outside the field of view."""
ROUNDED_UP = 1.0 + 1e-9
"""So that the farthest return is not beyond its own range by a rounding."""
NEIGHBOURS = 8
MAX_BEAMS = 500_000


RECOGNISED = " recognised by "
"""In the name of a pattern whose sensor is known: its field of view is known too."""


def estimate_pattern(points_m: FloatArray) -> BeamPattern:
    """Pattern of a scan [n, 3] in the sensor frame: a known sensor's, rings, or an even raster.

    Azimuths beyond a sector of 90 deg without returns are left out; elevations outside the lowest
    and highest returns are not looked at unless the sensor is recognised. A guess drops no return:
    where some are nearer than the recognised sensor's blind range, there is none. Raises
    ClearwayError if no point is finite and away from the origin.
    """
    points = check_points("beam pattern: points", points_m)
    spherical = spherical_from_cartesian(points[np.all(np.isfinite(points), axis=1)])
    spherical = spherical[spherical[:, 0] > 0.0]
    if not len(spherical):
        raise ClearwayError("beam pattern: cannot be estimated, no point is finite and not at zero")
    farthest = ROUNDED_UP * float(spherical[:, 0].max())
    azimuth, elevation = spherical[:, 1], spherical[:, 2]
    rings = _rings(elevation)
    if rings is None:
        return _raster(azimuth, elevation, farthest)
    ring_of = np.searchsorted(0.5 * (rings[1:] + rings[:-1]), elevation)
    step = _azimuth_step(azimuth, ring_of)
    azimuths, sector = _azimuths(azimuth, step)
    known = _find_known_sensor(rings)
    if known is None:
        name = f"estimated: {len(rings)} rings, azimuth step {np.degrees(step):.3g} deg, {sector}"
        return BeamPattern.from_angles(azimuths, rings, name=name, max_range_m=farthest)
    lasers = np.unique(known.elevation_rad)
    near = int(np.count_nonzero(spherical[:, 0] < known.min_range_m))
    name = (
        f"estimated: {known.name}{RECOGNISED}{len(rings)} of {len(lasers)} rings, "
        f"azimuth step {np.degrees(step):.3g} deg measured, {sector}"
    )
    if near:
        blind = f"its blind range of {known.min_range_m:g} m"
        name += f"; {near} returns are nearer than {blind}: none assumed"
    pattern = BeamPattern.from_angles(azimuths, lasers, name=name)
    # What measures nearer than the sensor it was taken for is another one with the same rings.
    least = 0.0 if near else known.min_range_m
    return replace(pattern, min_range_m=least, max_range_m=max(known.max_range_m, farthest))


def _rings(elevation: FloatArray) -> FloatArray | None:
    """Elevations of rings, ascending; None where the returns lie in none."""
    ordered = np.sort(elevation)
    starts = np.flatnonzero(np.diff(ordered, prepend=-np.inf) > RING_GAP_RAD)
    counts = np.diff(starts, append=len(ordered))
    widths = ordered[starts + counts - 1] - ordered[starts]
    is_ring = (counts >= RETURNS_PER_RING) & (widths <= 2.0 * RING_GAP_RAD)
    if counts[is_ring].sum() < RING_SHARE * len(ordered):
        return None
    means = np.add.reduceat(ordered, starts) / counts
    return np.asarray(means[is_ring])


def _azimuth_step(azimuth: FloatArray, ring_of: npt.NDArray[np.intp]) -> float:
    """Typical angle between neighbouring returns of a ring."""
    order = np.lexsort((azimuth, ring_of))
    steps = np.diff(azimuth[order])[np.diff(ring_of[order]) == 0]
    steps = steps[steps > 1e-4]  # several returns of one beam
    if not len(steps):
        return float(np.radians(1.0))
    return float(np.median(steps))


def _azimuths(azimuth: FloatArray, step: float) -> tuple[FloatArray, str]:
    """Azimuths of the beams, and the sector in words."""
    start, span = _sector(azimuth)
    if span == 2.0 * np.pi:
        count = round(span / step)
        azimuths = start + (np.arange(count) + 0.5) * (span / count)
        return np.asarray(azimuths, dtype=np.float64), "full turn assumed"
    azimuths = start + np.arange(round(span / step) + 1) * step
    low, high = np.degrees([start, start + span])
    return np.asarray(azimuths, dtype=np.float64), f"azimuth {low:z.0f} to {high:z.0f} deg"


def _sector(azimuth: FloatArray) -> tuple[float, float]:
    """Start and span of the azimuths with returns; the full turn unless a wide sector is empty."""
    ordered = np.sort(azimuth)
    gaps = np.diff(ordered, append=ordered[0] + 2.0 * np.pi)
    widest = int(gaps.argmax())
    if gaps[widest] <= OPEN_GAP_RAD:
        return -np.pi, 2.0 * np.pi
    return float(ordered[(widest + 1) % len(ordered)]), float(2.0 * np.pi - gaps[widest])


def _find_known_sensor(rings: FloatArray) -> BeamPattern | None:
    """The named pattern with the fewest lasers that has one at every ring."""
    matches = []
    for make in NAMED_PATTERNS.values():
        pattern = make()
        lasers = np.unique(pattern.elevation_rad)
        misses = np.abs(rings[:, None] - lasers).min(axis=1)
        if np.all(misses < MATCH_RAD) and len(rings) >= MATCH_SHARE * len(lasers):
            matches.append((len(lasers), pattern))
    return min(matches, key=lambda match: match[0])[1] if matches else None


def _raster(azimuth: FloatArray, elevation: FloatArray, farthest: float) -> BeamPattern:
    """Equal steps of azimuth and elevation, as dense as the returns, where there are returns."""
    low, high = float(elevation.min()), float(elevation.max())
    span = _sector(azimuth)[1]
    step = max(_density_step(azimuth, elevation), float(np.sqrt(span * (high - low) / MAX_BEAMS)))
    azimuths, sector = _azimuths(azimuth, step)
    elevations = np.linspace(low, high, max(1, round((high - low) / step) + 1))
    name = (
        f"estimated: no rings found, raster of {np.degrees(step):.3g} deg, {sector}, "
        f"elevation {np.degrees(low):z.0f} to {np.degrees(high):z.0f} deg"
    )
    return BeamPattern.from_angles(
        azimuths, elevations, name=name, max_range_m=farthest, spacing_rad=step
    )


def _density_step(azimuth: FloatArray, elevation: FloatArray) -> float:
    """Spacing of a raster as dense as the returns typically are, 0.05 to 5 deg."""
    from scipy.spatial import cKDTree

    cosine = np.cos(elevation)
    directions = np.stack(
        [cosine * np.cos(azimuth), cosine * np.sin(azimuth), np.sin(elevation)], axis=-1
    )
    neighbours = min(NEIGHBOURS, len(directions) - 1)
    if neighbours < 1:
        return float(np.radians(1.0))
    samples = directions[:: max(1, len(directions) // 2000)]
    reach = cKDTree(directions).query(samples, k=[neighbours + 1])[0]
    # k neighbours within a cap of radius r: one return per pi r^2 / k.
    step = float(np.median(reach)) * np.sqrt(np.pi / neighbours)
    return float(np.clip(step, np.radians(0.05), np.radians(5.0)))
