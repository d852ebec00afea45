"""Scans as plain float32: KITTI's .bin (x, y, z, intensity) and nuScenes' .pcd.bin (and ring)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clearway.base.errors import InputError, naming
from clearway.io.scans.pointcloud import PointCloud

VALUES = {".bin": 4, ".pcd.bin": 5}
"""Values of a point, by how the name ends."""
VALUE_BYTES = 4
MOST_NEGATIVE = 0.05
"""Share of points whose intensity may be below 0; coordinates in its place are in half of them."""


def read_bin(path: Path) -> PointCloud:
    """Points of a scan in metres, sensor frame; values after x, y, z are left to the side.

    Raises InputError when the size is no whole number of points, or when what should be intensities
    are no such. A file without a header cannot tell more of what is missing.
    """
    values = VALUES[".pcd.bin" if path.name.lower().endswith(".pcd.bin") else ".bin"]
    with naming(path, "read"):
        numbers = np.fromfile(path, dtype="<f4")
        size = path.stat().st_size
    if size % (values * VALUE_BYTES):
        raise InputError(
            str(path),
            f"truncated, or of another kind: {size} bytes are no whole number of points of "
            f"{values} float32; valid: x, y, z, intensity (KITTI), and ring in .pcd.bin (nuScenes)",
        )
    rows = numbers.reshape(-1, values)
    with np.errstate(invalid="ignore"):  # signalling NaNs of a damaged file are dropped later
        negative = float(np.mean(rows[:, 3] < 0.0)) if len(rows) else 0.0
        points = rows[:, :3].astype(np.float64)
    if negative > MOST_NEGATIVE:
        raise InputError(
            str(path),
            f"not {values} float32 a point: the fourth value, the intensity, is negative in "
            f"{100.0 * negative:.0f} % of its points; valid: x, y, z, intensity (KITTI), and ring "
            "in .pcd.bin (nuScenes); .npy tells its own shape",
        )
    return PointCloud(points, classes=None, crs=None, unit="metres", source=str(path))
