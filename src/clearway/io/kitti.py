"""Scans as plain float32: KITTI's .bin (x, y, z, intensity) and nuScenes' .pcd.bin (and ring)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clearway.errors import InputError
from clearway.io.pointcloud import PointCloud

VALUES = {".bin": 4, ".pcd.bin": 5}
"""Values of a point, by how the name ends."""
VALUE_BYTES = 4


def read_bin(path: Path) -> PointCloud:
    """Points of a scan in metres, sensor frame; values after x, y, z are left aside.

    Raises InputError when the size is no whole number of points. A file without a header cannot
    tell more of what is missing.
    """
    values = VALUES[".pcd.bin" if path.name.lower().endswith(".pcd.bin") else ".bin"]
    try:
        numbers = np.fromfile(path, dtype="<f4")
        size = path.stat().st_size
    except OSError as cause:
        raise InputError(str(path), f"cannot be read: {cause.strerror or cause}") from cause
    if size % (values * VALUE_BYTES):
        raise InputError(
            str(path),
            f"truncated, or of another kind: {size} bytes are no whole number of points of "
            f"{values} float32; valid: x, y, z, intensity (KITTI), and ring in .pcd.bin (nuScenes)",
        )
    with np.errstate(invalid="ignore"):  # signalling NaNs of a damaged file are dropped later
        points = numbers.reshape(-1, values)[:, :3].astype(np.float64)
    return PointCloud(points, classes=None, crs=None, unit="metres", source=str(path))
