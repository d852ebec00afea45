"""Beam patterns of sensors on sale, after their makers' public data sheets and manuals."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.suggest import did_you_mean
from clearway.sensors.beams.pattern import BeamPattern


def vlp16() -> BeamPattern:
    """Velodyne VLP-16 (Puck): 16 lasers from -15 to 15 deg, 0.2 deg steps at 600 rpm, 100 m.

    Source: VLP-16 user manual 63-9243.
    """
    return BeamPattern.rotating(
        np.linspace(-15.0, 15.0, 16), 0.2, name="vlp16", min_range_m=0.5, max_range_m=100.0
    )


def vls128_elevations_deg() -> FloatArray:
    """[128] the VLS-128's laser elevations: 0.11 deg apart about the horizon, wider outside.

    Source: VLS-128 (Alpha Prime) user manual 63-9483, table of laser angles.
    """
    below = [-25.0, -19.582, -16.042, -13.565, -11.742, -10.346]
    below += [-9.244, -8.352, -7.65, -7.15, -6.85, -6.65]
    above = [4.98, 5.18, 5.43, 5.73, 6.08, 6.48, 6.98, 7.58, 8.43, 9.7, 11.75, 15.0]
    return np.concatenate([below, -6.5 + 0.11 * np.arange(104), above])


def vls128() -> BeamPattern:
    """Velodyne VLS-128 (Alpha Prime): 128 lasers, 0.2 deg steps at 600 rpm, 245 m."""
    return BeamPattern.rotating(
        vls128_elevations_deg(), 0.2, name="vls128", min_range_m=0.5, max_range_m=245.0
    )


def os1_128() -> BeamPattern:
    """Ouster OS1-128 in 1024-column mode: 45 deg field of view, uniform, 200 m.

    Source: OS1 data sheet (128 channels, vertical field of view 45 deg, +-22.5 deg).
    """
    return BeamPattern.rotating(
        np.linspace(-22.5, 22.5, 128),
        360.0 / 1024,
        name="os1-128",
        min_range_m=0.5,
        max_range_m=200.0,
    )


def os0_128() -> BeamPattern:
    """Ouster OS0-128 in 1024-column mode: 90 deg field of view, uniform, 75 m.

    Source: OS0 data sheet (128 channels, vertical field of view 90 deg, +-45 deg).
    """
    return BeamPattern.rotating(
        np.linspace(-45.0, 45.0, 128),
        360.0 / 1024,
        name="os0-128",
        min_range_m=0.3,
        max_range_m=75.0,
    )


NAMED_PATTERNS: dict[str, Callable[[], BeamPattern]] = {
    "vlp16": vlp16,
    "vls128": vls128,
    "os1-128": os1_128,
    "os0-128": os0_128,
}


def find_pattern(name: str) -> BeamPattern:
    """The pattern of a known sensor; ClearwayError listing the names where there is none."""
    if name not in NAMED_PATTERNS:
        known, near = ", ".join(NAMED_PATTERNS), did_you_mean(name, NAMED_PATTERNS)
        raise ClearwayError(f"beam pattern: no sensor is called {name!r}{near}; known are {known}")
    return NAMED_PATTERNS[name]()
