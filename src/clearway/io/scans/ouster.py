"""Ouster packets (.pcap) with the sensor's metadata (.json), through ouster-sdk."""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.base.errors import InputError, MissingExtraError
from clearway.base.frames import spherical_from_cartesian
from clearway.base.state import BoolArray
from clearway.io.foreign_errors import damage_told
from clearway.io.scans.pointcloud import PointCloud, cleaned
from clearway.io.scans.timed_scans import ScanSequence, TimedScan
from clearway.sensors import BeamPattern
from clearway.sensors.estimate import ROUNDED_UP

RANGES_M = {"OS-0": (0.3, 75.0), "OS-1": (0.5, 200.0), "OS-2": (1.0, 400.0), "OS-D": (0.3, 75.0)}
"""Nearest and farthest by product line, after the maker's data sheets."""
FAR_MM = 100_000
"""Where beams are taken to point; their origins, centimetres apart, do not count there."""
PCAP_HEAD, RECORD_HEAD = 24, 16
LITTLE_MAGIC = (b"\xd4\xc3\xb2\xa1", b"\x4d\x3c\xb2\xa1")


class Ouster(NamedTuple):
    """What the metadata say."""

    info: Any
    points_of: Any
    """ouster-sdk's table from ranges to points."""
    azimuth_rad: Any
    """[rows, columns]"""
    elevation_rad: Any


def ouster_scans(path: Path) -> ScanSequence:
    """Sweeps of an Ouster recording: sensor frame, metres, seconds of the sensor's clock.

    Its metadata is the .json beside it whose name its own begins with. Raises InputError where
    either is damaged or absent, MissingExtraError without [ouster].
    """
    try:
        library: Any = import_module("ouster.sdk")
        core: Any = import_module("ouster.sdk.core")
    except ImportError as cause:
        raise MissingExtraError(f"reading {path}", "ouster") from cause
    beside = metadata_beside(path)
    with damage_told(beside, "Ouster metadata"):
        info = core.SensorInfo(beside.read_text())
        sensor = _sensor(info, core.XYZLut(info))

    def scans() -> Iterator[TimedScan]:
        found = 0
        with damage_told(path, "packet capture", (Exception,)):
            source = library.open_source(str(path), meta=[str(beside)])
            for index, frames in enumerate(source):
                found += 1
                yield _scan(f"{path} scan {index}", index, frames[0], sensor)
        if not found:
            raise InputError(
                str(path),
                f"no packet in it of the sensor of {beside.name} ({info.prod_line}): truncated, or "
                "the metadata of another recording?",
            )

    notes = [f"{path}: metadata of {beside.name}"]
    cut = index_of_cut(path)
    if cut is not None:
        notes.append(f"{path}: cut off inside packet {cut}; what is before it was read")
    return ScanSequence(str(path), f"Ouster packets, {info.prod_line}", scans, notes=tuple(notes))


def metadata_beside(path: Path) -> Path:
    """The .json whose name the recording's begins with, the longest one; InputError if none is."""
    if not path.is_file():
        raise InputError(str(path), "cannot be read: No such file")
    found = [one for one in path.parent.glob("*.json") if path.stem.startswith(one.stem)]
    if not found:
        there = ", ".join(sorted(one.name for one in path.parent.glob("*.json"))) or "none"
        raise InputError(
            str(path),
            f"no metadata beside it: an Ouster recording needs {path.stem}.json, or one whose name "
            f"it begins with; there are: {there}",
        )
    return max(found, key=lambda one: len(one.stem))


def _sensor(info: Any, points_of: Any) -> Ouster:
    rows, columns = info.format.pixels_per_column, info.format.columns_per_frame
    far = points_of(np.full((rows, columns), FAR_MM, dtype=np.uint32)).reshape(rows, columns, 3)
    spherical = spherical_from_cartesian(far)
    return Ouster(info, points_of, spherical[..., 1], spherical[..., 2])


def _pattern(sensor: Ouster, came: BoolArray, farthest_m: float) -> BeamPattern:
    """Beams of those columns that came, out to the farthest return if that is beyond the sheet."""
    line = sensor.info.prod_line
    nearest, farthest = RANGES_M.get(line[:4], (0.0, farthest_m))
    rows, columns = sensor.azimuth_rad.shape
    steps = np.abs(np.diff(np.radians(sensor.info.beam_altitude_angles)))
    return BeamPattern(
        f"{line} of its metadata, {rows} x {columns}"
        + ("" if came.all() else f", {np.count_nonzero(came)} columns came"),
        sensor.azimuth_rad[:, came].ravel(),
        sensor.elevation_rad[:, came].ravel(),
        min_range_m=nearest,
        max_range_m=max(farthest, ROUNDED_UP * farthest_m),
        spacing_rad=max(2.0 * np.pi / columns, float(np.median(steps))),
    )


def _scan(source: str, index: int, frame: Any, sensor: Ouster) -> TimedScan:
    stamps = np.asarray(frame.timestamp)
    came = (np.asarray(frame.status) & 1).astype(bool)
    times = stamps[came & (stamps > 0)]
    ranges = np.array(frame.field("RANGE"))

    def read() -> PointCloud:
        if not came.any():
            raise InputError(source, "no column of it came")
        answered = (ranges > 0) & came
        points = sensor.points_of(ranges).reshape(*ranges.shape, 3)[answered]
        farthest = float(np.sqrt(np.einsum("ij,ij->i", points, points).max(initial=0.0)))
        first, last = sensor.info.format.column_window
        expected = (last - first) % len(came) + 1
        missing = expected - int(np.count_nonzero(came))
        return cleaned(
            PointCloud(
                np.ascontiguousarray(points, dtype=np.float64),
                classes=None,
                crs=None,
                unit="metres",
                source=source,
                pattern=_pattern(sensor, came, farthest),
                notes=(f"{missing} of {expected} columns are missing",) if missing > 0 else (),
                complete=missing <= 0,
            )
        )

    return TimedScan(index, float(times.min()) * 1e-9 if len(times) else 0.0, None, read)


def index_of_cut(path: Path) -> int | None:
    """The packet in whose middle a capture ends; None where it is whole, or of another kind."""
    if path.stat().st_size < PCAP_HEAD:
        return 0
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        if data[:4] in LITTLE_MAGIC:
            order = "<"
        elif data[:4][::-1] in LITTLE_MAGIC:
            order = ">"
        else:
            return None
        at, number = PCAP_HEAD, 0
        while at + RECORD_HEAD <= len(data):
            (length,) = struct.unpack_from(f"{order}I", data, at + 8)
            if at + RECORD_HEAD + length > len(data):
                break
            at += RECORD_HEAD + length
            number += 1
        return None if at == len(data) else number
