"""Point clouds: one sweep in each of the formats of single scans, and a survey to fly in."""

from __future__ import annotations

import datetime
import struct
from pathlib import Path

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.io.samples.made_world import BOXES_M, place_at, sweep

HERE = np.zeros(3)
SCANS = 6
PERIOD_S = 0.5
SURVEY_ORIGIN_M = (500_000.0, 5_500_000.0, 100.0)
CAMERA_FROM_LIDAR = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""A camera looks along z, with x to the right and y down."""


def write_pcd(path: Path, rng: np.random.Generator) -> None:
    """PCD 0.7, binary."""
    _pcd(path, sweep(rng, HERE), "binary")


def write_pcd_text(path: Path, rng: np.random.Generator) -> None:
    """PCD 0.7, as text."""
    _pcd(path, sweep(rng, HERE), "ascii")


def write_pcd_packed(path: Path, rng: np.random.Generator) -> None:
    """PCD 0.7, compressed by LZF, column after column."""
    _pcd(path, sweep(rng, HERE), "binary_compressed")


def _pcd(path: Path, points: FloatArray, data: str) -> None:
    table = points.astype("<f4")
    head = (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\n"
        f"TYPE F F F\nCOUNT 1 1 1\nWIDTH {len(table)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
        f"POINTS {len(table)}\nDATA {data}\n"
    )
    content = table.tobytes()
    if data == "ascii":
        content = "".join(f"{x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in table).encode()
    elif data == "binary_compressed":
        import lzf

        columns = (np.round(64.0 * table.T) / 64.0).astype("<f4").tobytes()
        packed = lzf.compress(columns)
        content = struct.pack("<II", len(packed), len(columns)) + packed
    path.write_bytes(head.encode() + content)


def write_ply(path: Path, rng: np.random.Generator) -> None:
    """PLY, binary, little-endian."""
    table = sweep(rng, HERE).astype("<f4")
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(table)}\n"
        "property float x\nproperty float y\nproperty float z\nend_header\n"
    )
    path.write_bytes(head.encode() + table.tobytes())


def write_table(path: Path, rng: np.random.Generator) -> None:
    """A table of x, y, z in metres."""
    rows = (f"{x:.3f},{y:.3f},{z:.3f}\n" for x, y, z in sweep(rng, HERE))
    path.write_text("x,y,z\n" + "".join(rows))


def write_npy(path: Path, rng: np.random.Generator) -> None:
    """An array [n, 3] of NumPy."""
    np.save(path, sweep(rng, HERE).astype(np.float32))


def write_folder(path: Path, rng: np.random.Generator) -> None:
    """A folder of KITTI scans (.bin: x, y, z, intensity as float32) with times.txt in it."""
    path.mkdir()
    for index in range(SCANS):
        points = sweep(rng, place_at(PERIOD_S * index))
        rows = np.hstack([points, np.full((len(points), 1), 0.5)]).astype("<f4")
        (path / f"{index:06d}.bin").write_bytes(rows.tobytes())
    (path / "times.txt").write_text("".join(f"{PERIOD_S * n:.6f}\n" for n in range(SCANS)))


def write_kitti_poses(path: Path, rng: np.random.Generator) -> None:
    """Poses of KITTI: twelve numbers a scan, of the left camera in its first pose's frame."""
    del rng
    rows = []
    for index in range(SCANS):
        place = CAMERA_FROM_LIDAR @ place_at(PERIOD_S * index)
        pose = np.hstack([np.eye(3), place[:, None]])
        rows.append(" ".join(f"{value:.9g}" for value in pose.ravel()) + "\n")
    path.write_text("".join(rows))


def write_calibration(path: Path, rng: np.random.Generator) -> None:
    """Where the LiDAR of those poses is: `Tr` takes its points to the camera."""
    del rng
    matrix = np.hstack([CAMERA_FROM_LIDAR, np.zeros((3, 1))])
    path.write_text("Tr: " + " ".join(f"{value:.9g}" for value in matrix.ravel()) + "\n")


def write_tum_poses(path: Path, rng: np.random.Generator) -> None:
    """A trajectory of TUM: seconds, x, y, z, and a quaternion x, y, z, w."""
    del rng
    rows = []
    for index in range(SCANS):
        x, y, z = place_at(PERIOD_S * index)
        rows.append(f"{PERIOD_S * index:.3f} {x:.3f} {y:.3f} {z:.3f} 0 0 0 1\n")
    path.write_text("# timestamp tx ty tz qx qy qz qw\n" + "".join(rows))


def write_table_poses(path: Path, rng: np.random.Generator) -> None:
    """A table of poses: seconds, metres, and roll, pitch (nose down positive), yaw in degrees."""
    del rng
    rows = []
    for index in range(SCANS):
        x, y, z = place_at(PERIOD_S * index)
        rows.append(f"{PERIOD_S * index:.3f},{x:.3f},{y:.3f},{z:.3f},0,0,0\n")
    path.write_text("time,x,y,z,roll,pitch,yaw\n" + "".join(rows))


def write_las(path: Path, rng: np.random.Generator) -> None:
    """A sweep as LAS 1.2 or, by its suffix, LAZ: metres in the sensor's frame."""
    points = sweep(rng, HERE)
    _las(path, points, np.zeros(len(points), dtype=np.int64), np.zeros(3), None)


def write_survey(path: Path, rng: np.random.Generator) -> None:
    """A survey as LAS 1.4 or, by its suffix, LAZ: classes ground and building, ETRS89 / UTM 32N."""
    points, classes = _survey(rng)
    _las(path, points, classes, np.array(SURVEY_ORIGIN_M), 25832)


def _las(
    path: Path, points: FloatArray, classes: IntArray, origin_m: FloatArray, epsg: int | None
) -> None:
    import laspy
    import pyproj

    form, version = (1, "1.2") if epsg is None else (6, "1.4")
    header = laspy.LasHeader(point_format=form, version=version)
    header.scales, header.offsets = np.full(3, 0.001), origin_m
    header.creation_date = datetime.date(2026, 1, 1)
    if epsg is not None:
        header.add_crs(pyproj.CRS.from_epsg(epsg))
    las = laspy.LasData(header)
    las.x, las.y, las.z = (points + origin_m).T
    las.classification = classes.astype(np.uint8)
    las.write(str(path))


def _survey(rng: np.random.Generator) -> tuple[FloatArray, IntArray]:
    """Ground, and roof and walls of what stands on it, four points a square metre."""
    ground = np.column_stack([rng.uniform(-5.0, 30.0, 2500), rng.uniform(-12.0, 12.0, 2500)])
    parts = [np.column_stack([ground, np.zeros(len(ground))])]
    classes = [np.full(len(ground), 2, dtype=np.int64)]
    for low, high in BOXES_M[1:]:
        size = np.minimum(high - low, [35.0, 24.0, 8.0])
        low = np.maximum(low, [-5.0, -12.0, -1.8])
        count = int(4.0 * (size[0] * size[1] + 2.0 * (size[0] + size[1]) * size[2]))
        inside = low + size * rng.random((count, 3))
        # Each point goes to the nearest side, or to the roof.
        gaps = np.stack([inside[:, 0] - low[0], low[0] + size[0] - inside[:, 0],
                         inside[:, 1] - low[1], low[1] + size[1] - inside[:, 1],
                         low[2] + size[2] - inside[:, 2]], axis=1)  # fmt: skip
        side = gaps.argmin(axis=1)
        for number, (axis, value) in enumerate(
            ((0, low[0]), (0, low[0] + size[0]), (1, low[1]), (1, low[1] + size[1]),
             (2, low[2] + size[2]))
        ):  # fmt: skip
            inside[side == number, axis] = value
        parts.append(inside + np.array([0.0, 0.0, 1.8]))
        classes.append(np.full(count, 6, dtype=np.int64))
    return np.concatenate(parts), np.concatenate(classes)
