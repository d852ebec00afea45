"""Ouster packets (.pcap) with the sensor's metadata (.json) as sweeps with their beams."""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from clearway.base.errors import InputError, MissingExtraError
from clearway.base.frames import spherical_from_cartesian
from clearway.base.state import BoolArray
from clearway.io.apart import items_apart
from clearway.io.foreign_errors import damage_told
from clearway.io.scans.ouster_packets import Frame, Ouster, read_recorded
from clearway.io.scans.pointcloud import PointCloud, clean_cloud
from clearway.io.scans.timed_scans import ScanSequence, TimedScan
from clearway.sensors import BeamPattern
from clearway.sensors.beams.estimate import ROUNDED_UP

RANGES_M = {"OS-0": (0.3, 75.0), "OS-1": (0.5, 200.0), "OS-2": (1.0, 400.0), "OS-D": (0.3, 75.0)}
"""Nearest and farthest by product line, after the maker's data sheets."""
PCAP_HEAD = 24
RECORD_HEAD = 16
LITTLE_MAGIC = (b"\xd4\xc3\xb2\xa1", b"\x4d\x3c\xb2\xa1")


def ouster_scans(path: Path) -> ScanSequence:
    """Sweeps of an Ouster recording: sensor frame, metres, seconds of the sensor's clock.

    Its metadata lies beside it (`metadata_beside`). Raises InputError where either is damaged or
    absent, MissingExtraError without [ouster].
    """
    if find_spec("ouster") is None:
        raise MissingExtraError(f"reading {path}", "ouster")
    beside = metadata_beside(path)
    kind = f"packet capture, or its metadata {beside.name}"
    started = [items_apart(path, kind, read_recorded, path, beside)]
    sensor = next(started[0])
    assert isinstance(sensor, Ouster)

    def scans() -> Iterator[TimedScan]:
        if started:
            frames = started.pop()
        else:
            frames = items_apart(path, kind, read_recorded, path, beside)
            next(frames)
        with closing(frames):
            for index, frame in enumerate(frames):
                assert isinstance(frame, Frame)
                yield _scan(f"{path} scan {index}", index, frame, sensor)

    notes = [f"{path}: metadata of {beside.name}"]
    cut = index_of_cut(path)
    if cut is not None:
        notes.append(f"{path}: cut off inside packet {cut}; what is before it was read")
    return ScanSequence(str(path), f"Ouster packets, {sensor.line}", scans, notes=tuple(notes))


def metadata_beside(path: Path) -> Path:
    """The .json whose name the recording's begins with, the longest one; else NAME_0.json, as
    Ouster's tools write it beside NAME.pcap. Raises InputError if there is none."""
    if not path.is_file():
        raise InputError(str(path), "cannot be read: No such file")
    found = [one for one in path.parent.glob("*.json") if path.stem.startswith(one.stem)]
    first = path.with_name(f"{path.stem}_0.json")
    if not found and first.is_file():
        return first
    if not found:
        there = ", ".join(sorted(one.name for one in path.parent.glob("*.json"))) or "none"
        raise InputError(
            str(path),
            f"no metadata beside it: an Ouster recording needs {path.stem}.json, "
            f"{first.name}, or one whose name it begins with; there are: {there}",
        )
    return max(found, key=lambda one: len(one.stem))


def _pattern(sensor: Ouster, came: BoolArray, farthest_m: float) -> BeamPattern:
    """Beams of those columns that came, out to the farthest return if that is beyond the sheet."""
    nearest, farthest = RANGES_M.get(sensor.line[:4], (0.0, farthest_m))
    spherical = spherical_from_cartesian(sensor.far_m[:, came].reshape(-1, 3))
    rows, columns = sensor.far_m.shape[:2]
    steps = np.abs(np.diff(np.radians(sensor.altitude_deg)))
    return BeamPattern(
        f"{sensor.line} of its metadata, {rows} x {columns}"
        + ("" if came.all() else f", {np.count_nonzero(came)} columns came"),
        spherical[:, 1],
        elevation_rad=spherical[:, 2],
        min_range_m=nearest,
        max_range_m=max(farthest, ROUNDED_UP * farthest_m),
        spacing_rad=max(2.0 * np.pi / columns, float(np.median(steps)) if len(steps) else 0.0),
    )


def _scan(source: str, index: int, frame: Frame, sensor: Ouster) -> TimedScan:
    came = frame.came
    times = frame.stamp_ns[came & (frame.stamp_ns > 0)]

    def read() -> PointCloud:
        if not came.any():
            raise InputError(source, "no column of it came")
        points = frame.points_m
        farthest = float(np.sqrt(np.einsum("ij,ij->i", points, points).max(initial=0.0)))
        first, last = sensor.column_window
        expected = (last - first) % len(came) + 1
        missing = expected - int(np.count_nonzero(came))
        with damage_told(source, "Ouster metadata"):
            pattern = _pattern(sensor, came, farthest)
        return clean_cloud(
            PointCloud(
                points,
                classes=None,
                crs=None,
                unit="metres",
                source=source,
                pattern=pattern,
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
