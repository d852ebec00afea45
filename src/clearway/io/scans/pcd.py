"""PCD files (Point Cloud Library) of all versions: ascii, binary and binary_compressed."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from clearway.base.errors import InputError, MissingExtraError, naming
from clearway.base.frames import FloatArray
from clearway.io.scans.pcd_header import PcdHeader, read_pcd_header
from clearway.io.scans.pointcloud import PointCloud

LEVEL_VIEWPOINT = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
LARGEST_RATIO = 100
"""LZF packs no more than 264 bytes into 3."""
MOST_BYTES = 64_000_000
MOST_OF_PACKED = 6
"""Unpacked, of a small file and for each byte of a larger one: real returns pack to a half or so,
and points take several times as much memory."""
TOLD_LINES = 5


def read_pcd(path: Path) -> PointCloud:
    """Points of a PCD file in metres, sensor frame, as they stand; other fields are left to the
    side.

    Raises InputError for a damaged header, missing x, y, z, or fewer points than it promises;
    MissingExtraError where binary_compressed is to be unpacked without [lidar].
    """
    with naming(path, "read"):
        content = path.read_bytes()
    header = read_pcd_header(str(path), content)
    read = {"ascii": _ascii, "binary": _binary, "binary_compressed": _read_compressed}[header.data]
    points_m, notes = read(str(path), header, content[header.start :])
    return PointCloud(
        points_m=points_m,
        classes=None,
        crs=None,
        unit="metres",
        source=str(path),
        notes=(*notes, *_viewpoint_note(header.viewpoint)),
    )


Read = tuple[FloatArray, tuple[str, ...]]
"""Points [n, 3], and notes."""


def _ascii(source: str, header: PcdHeader, content: bytes) -> Read:
    text = content.decode("ascii", "replace").splitlines()
    lines = [(number, line) for number, line in enumerate(text, header.lines + 1) if line.strip()]
    _check_count(source, header, len(lines))
    if not lines:
        return np.zeros((0, 3)), ()
    used = lines[: header.points]
    if len(used[-1][1].split()) < header.values:
        raise InputError(
            source,
            f"truncated: line {used[-1][0]} has {len(used[-1][1].split())} of "
            f"{header.values} values",
        )
    try:
        points = np.loadtxt(
            [line for _, line in used], usecols=header.columns, ndmin=2, comments=None
        )
    except ValueError as cause:
        raise InputError(source, _bad_lines(used, header) or str(cause)) from cause
    return points, _surplus(header, len(lines))


def _bad_lines(lines: list[tuple[int, str]], header: PcdHeader) -> list[str]:
    """The first lines that do not hold x, y and z."""
    problems = []
    for number, line in lines:
        words = line.split()
        if len(words) < header.values:
            problems.append(f"line {number}: {len(words)} of {header.values} values")
        else:
            try:
                _ = [float(words[column]) for column in header.columns]
            except ValueError as cause:
                problems.append(f"line {number}: {cause}")
        if len(problems) == TOLD_LINES:
            break
    return problems


def _binary(source: str, header: PcdHeader, content: bytes) -> Read:
    held = len(content) // header.point_bytes
    _check_count(source, header, held)
    records = np.frombuffer(content, header.dtype, header.points)
    with np.errstate(invalid="ignore"):  # signalling NaNs of a damaged file are dropped later
        points = np.column_stack([records[axis].astype(np.float64) for axis in "xyz"])
    return points, _surplus(header, held)


def _read_compressed(source: str, header: PcdHeader, content: bytes) -> Read:
    """Packed by LZF, all values of one field together."""
    if not header.points:
        return np.zeros((0, 3)), ()
    try:
        import lzf
    except ImportError as cause:
        raise MissingExtraError(f"reading {source}", "lidar") from cause
    if len(content) < 8:
        raise InputError(source, "truncated: it ends before its packed data")
    packed, unpacked = struct.unpack_from("<II", content)
    if len(content) - 8 < packed:
        raise InputError(
            source, f"truncated: {packed} packed bytes promised, the file holds {len(content) - 8}"
        )
    needed = header.points * header.point_bytes
    if unpacked < needed or unpacked > LARGEST_RATIO * max(packed, 1):
        raise InputError(
            source,
            f"damaged: {header.points} points of {header.point_bytes} bytes need {needed} bytes, "
            f"the data are to unpack {packed} to {unpacked}",
        )
    most = max(MOST_BYTES, MOST_OF_PACKED * packed)
    if unpacked > most:
        raise InputError(
            source, f"{packed} bytes are to unpack to {unpacked}; at most {most:,} are taken"
        )
    try:
        planes = lzf.decompress(content[8 : 8 + packed], unpacked)
    except ValueError as cause:
        raise InputError(source, f"damaged: the packed data cannot be unpacked ({cause})") from None
    if planes is None or len(planes) < needed:
        raise InputError(
            source, f"damaged: {len(planes or b'')} of {needed} bytes come out of the packed data"
        )
    columns = [
        np.frombuffer(
            planes, header.dtype[axis], header.points, header.offsets[axis] * header.points
        )
        for axis in "xyz"
    ]
    with np.errstate(invalid="ignore"):
        return np.column_stack([column.astype(np.float64) for column in columns]), ()


def _check_count(source: str, header: PcdHeader, held: int) -> None:
    if held < header.points:
        raise InputError(
            source,
            f"truncated: the header promises {header.points} points, the data hold {held}",
        )


def _surplus(header: PcdHeader, held: int) -> tuple[str, ...]:
    """A note where there are more points than promised."""
    if held == header.points:
        return ()
    return (
        f"the header promises {header.points} points, the data hold {held}: the rest is left out",
    )


def _viewpoint_note(viewpoint: tuple[float, ...]) -> tuple[str, ...]:
    if viewpoint == LEVEL_VIEWPOINT:
        return ()
    pose = " ".join(f"{value:g}" for value in viewpoint)
    return (f"VIEWPOINT {pose} is not applied: points are taken in the sensor's frame",)
