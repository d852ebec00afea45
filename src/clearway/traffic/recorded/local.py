"""Recorded traffic in a mission's local frame: reports that the tracker takes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from clearway.base.frames import FloatArray, enu_from_geodetic
from clearway.traffic import Report
from clearway.traffic.recorded.report import TrafficReport

POSITION_STD_M = 15.0
"""Of a GNSS position as reported, in flight."""
VELOCITY_STD_MPS = 1.5


def enu_positions(reports: Sequence[TrafficReport], origin_geodetic: npt.ArrayLike) -> FloatArray:
    """[n, 3] east, north, up in metres of a tangent frame at latitude_deg, longitude_deg, height_m.

    Up is what the reports call altitude: barometric altitudes are taken as heights above the
    ellipsoid, so pass an origin with the pressure altitude of the place to fly among them. NaN
    where the altitude is unknown.
    """
    heights = [np.nan if one.altitude_m is None else one.altitude_m for one in reports]
    places = [
        (one.latitude_deg, one.longitude_deg, height)
        for one, height in zip(reports, heights, strict=True)
    ]
    return enu_from_geodetic(np.array(places).reshape(-1, 3), origin_geodetic)


def local_reports(
    reports: Iterable[TrafficReport],
    origin_geodetic: npt.ArrayLike,
    own_address: str | None = None,
    position_std_m: float = POSITION_STD_M,
    velocity_std_mps: float = VELOCITY_STD_MPS,
    radius_m: float = 0.0,
) -> list[Report]:
    """Reports for the tracker, east-north-up at the origin; without own ones and those on ground.

    Reports of unknown altitude are left out too: they say nothing of where the aircraft is. Times
    stay those of the recording. A report without speed or track has no velocity.
    """
    own = (own_address or "").lower()
    usable = [one for one in reports if one.altitude_m is not None and one.address.lower() != own]
    places = enu_positions(usable, origin_geodetic)
    return [
        Report(
            one.time_s,
            place,
            _velocity_mps(one),
            one.address,
            position_std_m,
            velocity_std_mps,
            radius_m,
        )
        for one, place in zip(usable, places, strict=True)
    ]


def _velocity_mps(report: TrafficReport) -> FloatArray | None:
    """[3] east, north, up; level where the vertical rate is unknown."""
    speed, track = report.ground_speed_mps, report.track_rad
    if speed is None or track is None:
        return None
    up = report.vertical_rate_mps or 0.0
    return np.array([speed * np.sin(track), speed * np.cos(track), up])
