"""Clouds and laser scans into points of the sensor, x ahead, with their times where told."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.io.scans.cloud_message import FIELD_TYPES, returns_of_cloud2
from clearway.io.scans.optical import Axes, is_optical, turn_points

MOST_POINTS = 2_000_000
"""No sensor has more; a larger cloud is refused."""
TIMES = {"t": 1e-9, "time": 1.0, "time_offset": 1.0, "offset_time": 1e-9, "timestamp": 1.0}
"""Names of fields that tell a point's time, and seconds of their unit where they are no floats:
Ouster's t in nanoseconds, Velodyne's time in seconds, Livox's offset_time, Hesai's timestamp."""
LONGEST_SWEEP_S = 1.0


class TimedPoints(NamedTuple):
    points_m: FloatArray
    """[n, 3] sensor frame, x ahead, y left, z up; no missing returns."""
    later_s: FloatArray | None
    """[n] after the stamp; None where no times are reported."""


def read_cloud_points(message: Any, kind: str, axes: Axes = "auto") -> TimedPoints:
    """Return the points of a PointCloud2 or a LaserScan; ValueError says what is wrong with it.

    axes: of the message; "auto" turns those of a frame that is called an optical one.
    """
    with np.errstate(all="ignore"):  # signalling NaNs of a damaged message
        found = _of_laser(message) if kind == "LaserScan" else _of_cloud(message)
    if axes == "optical" or (axes == "auto" and is_optical(message.header.frame_id)):
        return found._replace(points_m=turn_points(found.points_m))
    return found


def _of_cloud(message: Any) -> TimedPoints:
    count = int(message.width) * int(message.height)
    if count > MOST_POINTS:
        raise ValueError(f"{count} points, more than {MOST_POINTS}")
    points, returned = returns_of_cloud2(message)
    times = _times(message)
    if times is not None and returned is not None:
        times = times[returned]
    return TimedPoints(points, times)


def _times(message: Any) -> FloatArray | None:
    fields = {field.name.lower(): field for field in message.fields}
    name = next((name for name in TIMES if name in fields), None)
    if name is None or fields[name].datatype not in FIELD_TYPES:
        return None
    field = fields[name]
    form = np.dtype((">" if message.is_bigendian else "<") + FIELD_TYPES[field.datatype])
    if int(field.offset) + form.itemsize > message.point_step:
        raise ValueError(f"field {name} ends beyond point_step {message.point_step}")
    wide = int(message.width) * int(message.point_step)
    row = int(message.row_step) if message.height > 1 and message.row_step >= wide else wide
    view = np.ndarray(
        (message.height, message.width),
        form,
        np.ascontiguousarray(message.data, dtype=np.uint8).data,
        offset=int(field.offset),
        strides=(row, message.point_step),
    )
    unit = 1.0 if form.kind == "f" else TIMES[name]
    told = view.ravel().astype(np.float64) * unit
    stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
    if len(told) and np.nanmedian(told) > 1e6:  # Since 1970, not since the stamp.
        told = told - stamp
    if not len(told) or not np.all(np.abs(told) <= LONGEST_SWEEP_S):
        return None
    return told


def _of_laser(message: Any) -> TimedPoints:
    ranges = np.asarray(message.ranges, dtype=np.float64)
    if len(ranges) > MOST_POINTS:
        raise ValueError(f"{len(ranges)} ranges, more than {MOST_POINTS}")
    angle = message.angle_min + np.arange(len(ranges)) * message.angle_increment
    with np.errstate(invalid="ignore"):
        good = (ranges >= message.range_min) & (ranges <= message.range_max) & (ranges > 0.0)
    good &= np.isfinite(ranges) & np.isfinite(angle)
    if not np.isfinite(message.angle_min + message.angle_increment):
        raise ValueError("angles that are not finite")
    level = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(ranges))], axis=1)
    step = float(message.time_increment)
    later = np.arange(len(ranges)) * step if 0.0 < step * len(ranges) <= LONGEST_SWEEP_S else None
    return TimedPoints(ranges[good, None] * level[good], None if later is None else later[good])
