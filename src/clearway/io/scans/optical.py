"""Axes of cameras (z ahead, x right, y down) made into those of vehicles, both of ROS's REP 103."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Literal, TypeAlias, get_args

import numpy as np

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.io.scans.pointcloud import PointCloud
from clearway.io.scans.timed_scans import ScanSequence, TimedScan

Axes: TypeAlias = Literal["auto", "body", "optical"]
"""Of points: as their frame is called; x ahead, y left, z up; or z ahead, x right, y down."""
AHEAD_FROM_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""[3, 3] of REP 103: `AHEAD_FROM_OPTICAL @ p_optical` has x ahead, y left, z up."""
TURNED = "points turned from optical axes (z ahead, x right, y down) to x ahead, y left, z up"


def is_optical(frame: str) -> bool:
    """Whether a frame id is that of a camera's optical axes, by the suffix of REP 103."""
    name = frame.lower()
    return name.endswith("_optical") or "optical_frame" in name


def turn_points(points_m: FloatArray) -> FloatArray:
    """Return points [n, 3] of optical axes with x ahead, y left, z up; no number is rounded."""
    turned: FloatArray = np.ascontiguousarray(points_m[:, [2, 0, 1]])
    np.negative(turned[:, 1:], out=turned[:, 1:])
    return turned


def turn_scans(sequence: ScanSequence, axes: Axes) -> ScanSequence:
    """Return the sequence with x ahead in all its clouds.

    axes: of the points; "auto" turns those of a frame that is called an optical one. Packets of a
    sensor have x ahead whatever their frame is called. Raises InputError for other axes.
    """
    if axes not in get_args(Axes):
        valid = ", ".join(get_args(Axes))
        raise InputError(sequence.source, f"frame {axes!r}: valid: {valid}")
    by_name = axes == "auto" and is_optical(sequence.frame)
    if axes != "optical" and not by_name:
        return sequence
    why = f", as the frame {sequence.frame} is called; --frame body leaves them" if by_name else ""

    def scans() -> Iterator[TimedScan]:
        for scan in sequence:
            yield replace(scan, read=_turning(scan.read, TURNED + why))

    return replace(sequence, scans=scans)


def turn_cloud(cloud: PointCloud, note: str = TURNED) -> PointCloud:
    """Return a cloud of optical axes with x ahead; packets of a sensor have it so already."""
    if cloud.pattern is not None:
        return cloud
    points_m = turn_points(cloud.points_m)
    return replace(cloud, points_m=points_m, notes=(*cloud.notes, note))


def _turning(read: Callable[[], PointCloud], note: str) -> Callable[[], PointCloud]:
    return lambda: turn_cloud(read(), note)
