"""Point clouds written for tests."""

from __future__ import annotations

from pathlib import Path

import numpy as np

POINTS = np.array([[1.0, 2.0, 3.0], [-4.5, 0.25, 0.0], [10.0, -2.0, 1.5]])
PCD_HEAD = (
    "# .PCD v.7 - Point Cloud Data file format\nVERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n"
    "COUNT 1 1 1\nWIDTH 3\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA ascii\n"
)


def write_pcd(path: Path, points: np.ndarray, encoding: str) -> Path:
    from pypcd4.pypcd4 import Encoding, PointCloud

    cloud = PointCloud.from_points(points, ("x", "y", "z"), (np.float64,) * 3)
    cloud.save(path, Encoding(encoding))
    return path
