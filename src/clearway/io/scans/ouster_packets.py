"""What ouster-sdk makes of packets, to be run in a process of its own: it ends on some damage."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.base.arrays import BoolArray, FloatArray, IntArray
from clearway.base.errors import InputError
from clearway.io.foreign_errors import damage_told

FAR_MM = 100_000
"""Where beams are taken to point; their origins, centimetres apart, do not count there."""
MOST_BEAMS = 1_000_000
"""Rows by columns: four times those of the largest sensor."""


class Ouster(NamedTuple):
    """What the metadata say."""

    line: str
    """Of products, such as OS-1-128."""
    far_m: FloatArray
    """[rows, columns, 3] where each beam is far away."""
    altitude_deg: FloatArray
    """[rows] of the beams."""
    column_window: tuple[int, int]


class Frame(NamedTuple):
    """One sweep."""

    stamp_ns: IntArray
    """[columns]"""
    came: BoolArray
    """[columns]"""
    points_m: FloatArray
    """[n, 3] of the beams that were answered."""


def read_recorded(path: Path, beside: Path) -> Iterator[Ouster | Frame]:
    """The sensor by its metadata, then the sweeps of a recording."""
    library: Any = import_module("ouster.sdk")
    core: Any = import_module("ouster.sdk.core")
    with damage_told(beside, "Ouster metadata", (Exception,)):
        info = core.SensorInfo(beside.read_text())
        rows, columns = info.format.pixels_per_column, info.format.columns_per_frame
        if not 0 < rows * columns <= MOST_BEAMS:
            raise ValueError(f"{rows} x {columns} beams")
        points_of = core.XYZLut(info)
        far = points_of(np.full((rows, columns), FAR_MM, dtype=np.uint32))
        first, last = info.format.column_window
        altitudes = np.array(info.beam_altitude_angles, dtype=np.float64)
        yield Ouster(
            str(info.prod_line),
            np.ascontiguousarray(far, dtype=np.float64).reshape(rows, columns, 3),
            altitudes,
            (int(first), int(last)),
        )
    found = 0
    with damage_told(path, "packet capture", (Exception,)):
        for frames in library.open_source(str(path), meta=[str(beside)]):
            found += 1
            yield _frame(frames[0], points_of)
    if not found:
        raise InputError(
            str(path),
            f"no packet in it of the sensor of {beside.name} ({info.prod_line}): truncated, or "
            "the metadata of another recording?",
        )


def _frame(frame: Any, points_of: Any) -> Frame:
    came = (np.asarray(frame.status) & 1).astype(bool)
    ranges = np.array(frame.field("RANGE"))
    points = points_of(ranges).reshape(*ranges.shape, 3)[(ranges > 0) & came]
    stamps = np.asarray(frame.timestamp).astype(np.int64)
    return Frame(stamps, came, np.ascontiguousarray(points, dtype=np.float64))
