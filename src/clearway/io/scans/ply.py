"""PLY files (Stanford polygon files): points in ascii, or binary of either byte order."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from clearway.base.errors import InputError, naming
from clearway.base.frames import FloatArray
from clearway.io.foreign import whole_number
from clearway.io.scans.pointcloud import PointCloud

TYPES: Mapping[str, str] = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
ORDERS: Mapping[str, str] = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
AXES = ("x", "y", "z")
MOST_LINES = 1_000


class PlyHeader(NamedTuple):
    """What a header says of its vertices."""

    form: str
    points: int
    names: tuple[str, ...]
    """Properties of a vertex, in small letters."""
    types: tuple[str, ...]
    start: int
    """Where the data begin, in bytes."""
    lines: int


def read_ply(path: Path) -> PointCloud:
    """Vertices of a PLY file in metres, sensor frame; faces and other properties are left to the
    side.

    Raises InputError for a damaged header, missing x, y, z, or fewer vertices than it promises.
    """
    with naming(path, "read"):
        content = path.read_bytes()
    header = _header(str(path), content)
    read = _ascii if header.form == "ascii" else _binary
    points = read(str(path), header, content[header.start :])
    return PointCloud(points, classes=None, crs=None, unit="metres", source=str(path))


def _header(source: str, content: bytes) -> PlyHeader:
    end = content.find(b"end_header")
    stop = content.find(b"\n", end)
    if not content.startswith(b"ply") or end < 0 or stop < 0:
        raise InputError(source, "no PLY header, or a truncated one: no end_header line")
    lines = content[:end].decode("ascii", "replace").splitlines()
    words = [line.split() for line in lines[:MOST_LINES]]
    form = next((row[1] for row in words if row[:1] == ["format"] and len(row) > 1), "")
    elements = [n for n, row in enumerate(words) if row[:1] == ["element"] and len(row) > 2]
    problems = []
    if form not in ORDERS:
        problems.append(f"header format {form!r}; valid: {', '.join(ORDERS)}")
    if (
        not elements
        or words[elements[0]][1] != "vertex"
        or whole_number(words[elements[0]][2]) is None
    ):
        problems.append("header: its first element must be vertex, with how many there are")
        raise InputError(source, problems)
    until = elements[1] if len(elements) > 1 else len(words)
    rows = [row for row in words[elements[0] : until] if row[:1] == ["property"]]
    names = tuple(row[-1].lower() for row in rows)
    types = tuple(TYPES.get(row[1], "") if len(row) == 3 else "" for row in rows)
    missing = [axis for axis in AXES if axis not in names]
    if missing:
        problems.append(f"header: no property {', '.join(missing)} of vertex; it has {names}")
    if "" in types:
        problems.append(f"header: property {rows[types.index('')][1:]}; valid: {', '.join(TYPES)}")
    if problems:
        raise InputError(source, problems)
    count = int(words[elements[0]][2])
    return PlyHeader(form, count, names, types, stop + 1, len(lines) + 1)


def _ascii(source: str, header: PlyHeader, content: bytes) -> FloatArray:
    text = content.decode("ascii", "replace").splitlines()
    rows = [(n, line) for n, line in enumerate(text, header.lines + 1) if line.strip()]
    _check_count(source, header, len(rows))
    rows = rows[: header.points]
    if not rows:
        return np.zeros((0, 3))
    short = next((n for n, line in rows if len(line.split()) < len(header.names)), None)
    if short is not None:
        raise InputError(
            source, f"truncated: line {short} has less than {len(header.names)} values"
        )
    columns = [header.names.index(axis) for axis in AXES]
    try:
        return np.loadtxt([line for _, line in rows], usecols=columns, ndmin=2, comments=None)
    except ValueError as cause:
        raise InputError(source, f"damaged vertices after line {header.lines}: {cause}") from cause


def _binary(source: str, header: PlyHeader, content: bytes) -> FloatArray:
    formats = [ORDERS[header.form] + kind for kind in header.types]
    ends = np.cumsum([np.dtype(kind).itemsize for kind in formats])
    starts = [0, *ends[:-1].tolist()]
    at = [header.names.index(axis) for axis in AXES]
    layout = np.dtype(
        {
            "names": AXES,
            "formats": [formats[n] for n in at],
            "offsets": [starts[n] for n in at],
            "itemsize": int(ends[-1]),
        }
    )
    _check_count(source, header, len(content) // layout.itemsize)
    records = np.frombuffer(content, layout, header.points)
    with np.errstate(invalid="ignore"):  # signalling NaNs of a damaged file are dropped later
        return np.column_stack([records[axis].astype(np.float64) for axis in AXES])


def _check_count(source: str, header: PlyHeader, held: int) -> None:
    if held < header.points:
        raise InputError(
            source,
            f"truncated: the header promises {header.points} vertices, the data hold {held}",
        )
