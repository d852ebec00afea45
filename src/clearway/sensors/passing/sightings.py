"""Small bodies as one scan shows them, and what other scans' beams prove about their places."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.compiled import read_only
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.sensors.beams.lidar import Lidar, Scan
from clearway.sensors.beams.raster import BeamRaster, beam_raster, nearest_returns
from clearway.sensors.passing.clusters import cluster_returns
from clearway.sensors.passing.passed_points import (
    REACH_OF_BEAM,
    Sensor,
    find_passed_through,
    returns_in_world,
    sensor_at,
)

DEPTH_OF_CENTER = 2.0 / 3.0
"""How far behind the mean of its returns the centre of a ball lies, in radii."""
PRECISION = 1.35
"""Standard deviation of a cluster's mean, in half beam spacings by the root of its returns."""
SHAPELESS = 0.05
"""The same of the centre, in half widths: no body is quite a ball, nor seen from afar."""


class BeamFrame(NamedTuple):
    """A scan as its beams prove things."""

    time_s: float
    sensor: Sensor
    raster: BeamRaster
    nearest_m: FloatArray
    """[columns, rows] of the raster: range of the nearest return."""


class Sighting(NamedTuple):
    """A body in one scan, world frame."""

    frame: BeamFrame
    points_m: FloatArray
    """[n, 3] its returns."""
    mean_m: FloatArray
    """[3] of them: on its near side."""
    away: FloatArray
    """[3] unit vector from the sensor to there."""
    half_width_m: float
    """Farthest return from the mean across the line of sight: its radius, if all is in view."""
    half_thickness_m: float
    half_spacing_m: float
    """Half the beam spacing there."""
    std_m: float
    """Of the centre on each axis, if all of the near side is in view."""

    @property
    def time_s(self) -> float:
        return self.frame.time_s

    def center_m(self, radius_m: float) -> FloatArray:
        """[3] centre of a ball of that radius."""
        return self.mean_m + DEPTH_OF_CENTER * radius_m * self.away


def place_beams(lidar: Lidar, scan: Scan, state: State, sigmas: float) -> BeamFrame:
    """The beams of a scan taken at `state`, which pass what they go on beyond for certain.

    sigmas: standard deviations of range and own position that certainty takes.
    """
    tolerance = sigmas * (lidar.sigma_m + state.position_std_m)
    raster = beam_raster(lidar.pattern)
    return BeamFrame(
        scan.time_s,
        sensor_at(lidar, state, tolerance),
        raster,
        nearest_returns(scan.points_m, raster),
    )


def sight_bodies(
    frame: BeamFrame,
    lidar: Lidar,
    scan: Scan,
    state: State,
    *,
    gap_m: float,
    largest_m: float,
    returns: int,
    ground_m: float = -np.inf,
) -> list[Sighting]:
    """Clusters of at least so many returns that are neither too large nor too thin to follow.

    largest_m: greatest half width. What is thinner than the beam spacing is hit in turn here and
    there along it, as if it moved: wires are left to memory.
    """
    sensor = frame.sensor
    points, spacing = returns_in_world(scan.points_m, sensor, sensor.max_range, float(ground_m))
    clusters = cluster_returns(points, spacing, sensor.origin, gap_m)
    count = np.diff(clusters.start)
    fits = (
        (count >= returns)
        & (clusters.half_width_m <= largest_m)
        & (clusters.depth_m <= 2.0 * largest_m)
        & (clusters.half_thickness_m > REACH_OF_BEAM * clusters.half_spacing_m)
    )
    return [
        Sighting(
            frame,
            clusters.points_m[clusters.start[c] : clusters.start[c + 1]],
            clusters.mean_m[c],
            clusters.away[c],
            float(clusters.half_width_m[c]),
            float(clusters.half_thickness_m[c]),
            float(clusters.half_spacing_m[c]),
            float(
                np.linalg.norm(
                    (
                        state.position_std_m,
                        lidar.sigma_m / np.sqrt(count[c]),
                        PRECISION * clusters.half_spacing_m[c] / np.sqrt(count[c]),
                        SHAPELESS * clusters.half_width_m[c],
                    )
                )
            ),
        )
        for c in np.flatnonzero(fits)
    ]


def share_passed(frame: BeamFrame, sighting: Sighting) -> float:
    """Share of a sighting's returns where the beams of another scan went on: where it was not."""
    count = len(sighting.points_m)
    passed = find_passed_through(
        read_only(sighting.points_m),
        read_only(np.full(count, sighting.half_thickness_m)),
        frame.nearest_m,
        frame.sensor,
        frame.raster,
    )
    return float(passed.mean())


def is_passed(frame: BeamFrame, place_m: FloatArray, radius_m: float) -> bool:
    """Whether the beams of a scan go on beyond a ball there: it is gone."""
    sensor = frame.sensor._replace(tolerance=frame.sensor.tolerance + radius_m)
    passed = find_passed_through(
        read_only(place_m[None, :]),
        read_only(np.full(1, radius_m)),
        frame.nearest_m,
        sensor,
        frame.raster,
    )
    return bool(passed[0])
