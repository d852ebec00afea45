"""PCD files (Point Cloud Library): ascii, binary and binary_compressed, through pypcd4."""

from __future__ import annotations

import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import InputError, MissingExtraError
from clearway.io.pointcloud import PointCloud

LEVEL_VIEWPOINT = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
HEADER_KEYS = ("FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "POINTS", "DATA")


def read_pcd(path: Path) -> PointCloud:
    """Points of a PCD file in metres, sensor frame, as they stand; other fields are left aside.

    Raises InputError for a damaged header, missing x, y, z, or fewer points than it promises.
    """
    cloud = _parsed(path)
    missing = [name for name in ("x", "y", "z") if name not in cloud.fields]
    if missing:
        raise InputError(
            str(path),
            f"header FIELDS: no {', '.join(missing)} among {' '.join(cloud.fields)}; "
            "fields x, y and z are needed",
        )
    promised = int(cloud.metadata.points)
    columns = [np.atleast_1d(cloud.pc_data[name]) for name in ("x", "y", "z")]
    if len(columns[0]) != promised:
        raise InputError(
            str(path),
            f"truncated: the header promises {promised} points, the data hold {len(columns[0])}",
        )
    with np.errstate(invalid="ignore"):  # signalling NaNs of a damaged file are dropped later
        points_m = np.column_stack([column.astype(np.float64) for column in columns])
    return PointCloud(
        points_m=points_m,
        classes=None,
        crs=None,
        unit="metres",
        source=str(path),
        notes=_viewpoint_note(tuple(cloud.metadata.viewpoint)),
    )


def _parsed(path: Path) -> Any:
    """What pypcd4 makes of the file, its many kinds of complaint as one."""
    try:
        from pypcd4.pypcd4 import PointCloud as PcdFile
    except ImportError as cause:
        raise MissingExtraError(f"reading {path}", "lidar") from cause
    try:
        with warnings.catch_warnings():  # of an empty table; the count below tells
            warnings.simplefilter("ignore", UserWarning)
            return PcdFile.from_path(path)
    except MemoryError as cause:
        raise InputError(
            str(path), "the header promises more points than memory can hold: damaged?"
        ) from cause
    except (ValueError, RuntimeError, TypeError, KeyError, IndexError, struct.error) as cause:
        raise InputError(str(path), _cause(path, cause)) from cause


def _viewpoint_note(viewpoint: tuple[float, ...]) -> tuple[str, ...]:
    if viewpoint == LEVEL_VIEWPOINT:
        return ()
    pose = " ".join(f"{value:g}" for value in viewpoint)
    return (f"VIEWPOINT {pose} is not applied: points are taken in the sensor's frame",)


def _cause(path: Path, error: Exception) -> str:
    """Where a PCD file goes wrong: an incomplete header, or data shorter than it promises."""
    header = _header(path)
    missing = [key for key in HEADER_KEYS if key not in header]
    if missing:
        return (
            f"no PCD header, or a truncated one: no {', '.join(missing)} line; "
            "valid: a PCD 0.7 file with DATA ascii, binary or binary_compressed"
        )
    if header["DATA"] == ["binary"] and header["POINTS"][0].isdigit():
        promised, room = int(header["POINTS"][0]), _room(path, header)
        if room is not None and room < promised:
            return f"truncated: the header promises {promised} points, the file holds {room}"
    reason = " ".join(str(error).split())
    return (
        "damaged or truncated PCD: the data are shorter or other than the header says "
        f"({type(error).__name__}: {reason[:160]})"
    )


def _header(path: Path) -> dict[str, list[str]]:
    """Header words by key, as far as they can be read."""
    header = {}
    with path.open("rb") as file:
        for line in file.read(4096).split(b"\n"):
            words = line.decode("ascii", "replace").split()
            if words and words[0] in HEADER_KEYS:
                header[words[0]] = words[1:]
            if words[:1] == ["DATA"]:
                break
    return header


def _room(path: Path, header: dict[str, list[str]]) -> int | None:
    """Binary points that the file's data have room for; None if the header does not tell."""
    try:
        point_bytes = sum(
            int(size) * int(count)
            for size, count in zip(header["SIZE"], header["COUNT"], strict=True)
        )
    except ValueError:
        return None
    start = path.read_bytes().find(b"DATA binary\n") + len(b"DATA binary\n")
    return (path.stat().st_size - start) // point_bytes if point_bytes > 0 else None
