"""What the samples show: a lane between two walls with a house in the way, and beams into it."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray

RINGS_DEG = np.linspace(-15.0, 15.0, 16)
STEP_DEG = 1.0
FARTHEST_M = 60.0
NOISE_M = 0.02
BOXES_M = np.array(
    [
        [[-60.0, -40.0, -2.8], [80.0, 40.0, -1.8]],  # ground
        [[-20.0, 6.0, -1.8], [50.0, 7.0, 6.0]],
        [[-20.0, -7.0, -1.8], [50.0, -6.0, 6.0]],
        [[14.0, -1.0, -1.8], [16.0, 3.0, 5.0]],  # the house in the way
    ]
)
"""[boxes, 2, 3] low and high corners, world frame."""
LEGS_M = np.array([[0.22, 0.18, -0.25], [0.22, -0.18, -0.25], [-0.2, 0.0, -0.28]])
"""Of the airframe, sensor frame."""
SPEED_MPS = 1.0


def place_at(time_s: float) -> FloatArray:
    """Where the vehicle is: straight ahead, one metre a second."""
    return np.array([SPEED_MPS * time_s, 0.0, 0.0])


def sweep(rng: np.random.Generator, position_m: FloatArray, legs: bool = False) -> FloatArray:
    """[n, 3] returns of one turn of sixteen lasers, sensor frame (x ahead, y left, z up).

    legs: whether the airframe's own legs return too.
    """
    azimuth, elevation = np.meshgrid(
        np.radians(np.arange(-180.0, 180.0, STEP_DEG) + STEP_DEG / 2.0),
        np.radians(RINGS_DEG),
        indexing="ij",
    )
    flat = np.cos(elevation)
    directions = np.stack(
        [flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=-1
    ).reshape(-1, 3)
    ranges = ranges_m(directions, position_m)
    ranges = ranges + NOISE_M * rng.standard_normal(len(ranges))
    points = directions * ranges[:, None]
    points = points[ranges < FARTHEST_M]
    return np.concatenate([points, LEGS_M]) if legs else points


def ranges_m(directions: FloatArray, origin_m: FloatArray) -> FloatArray:
    """[n] to the first box that each ray [n, 3] meets; infinite where it meets none."""
    nearest = np.full(len(directions), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for low, high in BOXES_M:
            at_low, at_high = (low - origin_m) / directions, (high - origin_m) / directions
            enters = np.nanmax(np.minimum(at_low, at_high), axis=1)
            leaves = np.nanmin(np.maximum(at_low, at_high), axis=1)
            met = (enters <= leaves) & (enters > 0.0)
            nearest = np.where(met, np.minimum(nearest, enters), nearest)
    return nearest
