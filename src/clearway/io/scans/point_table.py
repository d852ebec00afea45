"""Point clouds as plain tables: text (.csv, .xyz, .txt) and NumPy arrays (.npy), metres."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from pathlib import Path
from tokenize import TokenError
from typing import NamedTuple

import numpy as np

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.io.foreign import is_number, note_unended
from clearway.io.foreign_errors import damage_told
from clearway.io.scans.pointcloud import PointCloud

LONGEST_NAME = 80
"""Of a column."""
MOST_COLUMNS = 32
"""Of an array; what is wider lies on its side."""


class Layout(NamedTuple):
    """How a text table is laid out."""

    delimiter: str | None
    header_lines: int
    columns: tuple[int, int, int]


def read_point_table(path: Path) -> PointCloud:
    """Points of a text table: a header naming x, y and z, or else its first three columns.

    Columns are separated by semicolons, tabs, commas or blanks; between semicolons and tabs a comma
    may be the decimal sign. `#` starts a comment.
    Raises InputError with the line where a value is no number or missing.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as cause:
        raise InputError(
            str(path), f"no text: byte {cause.start} is not UTF-8; valid: a table of x, y, z"
        ) from cause
    lines = text.splitlines()
    layout = _layout(path, lines)
    numbered = [
        (number, row)
        for number, line in enumerate(lines[layout.header_lines :], layout.header_lines + 1)
        if (row := line.split("#")[0].replace('"', "").strip())
    ]
    if layout.delimiter in (";", "\t") and not any("." in row for _, row in numbered):
        numbered = [(number, row.replace(",", ".")) for number, row in numbered]
    if not numbered:
        raise InputError(str(path), "no points in it; valid: one point a line, x, y, z in metres")
    try:
        points = np.loadtxt(
            [row for _, row in numbered],
            delimiter=layout.delimiter,
            usecols=layout.columns,
            ndmin=2,
        )
    except ValueError as cause:
        raise InputError(str(path), _first_bad_lines(numbered, layout) or str(cause)) from cause
    return replace(_cloud(path, points), notes=note_unended(text))


def read_npy(path: Path) -> PointCloud:
    """Points of a NumPy array [n, 3 or more] of numbers, or of records with x, y and z.

    Columns after the third, and other fields, are left to the side.
    """
    with damage_told(path, ".npy file", (TokenError, SyntaxError)), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # Written by Python 2: read all the same.
        array = np.load(path, allow_pickle=False)
    if array.dtype.names is not None and {"x", "y", "z"} <= set(array.dtype.names):
        array = np.stack([array[axis].ravel() for axis in "xyz"], axis=-1)
    if array.dtype.kind not in "fiu" or array.ndim != 2 or not 3 <= array.shape[1] <= MOST_COLUMNS:
        raise InputError(
            str(path),
            f"an array of {array.dtype} with shape {list(array.shape)}; "
            f"valid: numbers with shape [points, 3], up to {MOST_COLUMNS} columns, or records "
            "with x, y, z",
        )
    return _cloud(path, array[:, :3])


def _cloud(path: Path, points: FloatArray) -> PointCloud:
    return PointCloud(
        points_m=np.array(points, dtype=np.float64, order="C"),
        classes=None,
        crs=None,
        unit="metres",
        source=str(path),
    )


def _layout(path: Path, lines: list[str]) -> Layout:
    """Separator and columns, from the first line that is neither blank nor a comment."""
    first = next((n for n, line in enumerate(lines) if line.split("#")[0].strip()), None)
    if first is None:
        raise InputError(str(path), "no points in it; valid: one point a line, x, y, z in metres")
    text = lines[first].split("#")[0].strip().removeprefix("//")
    delimiter = next((sign for sign in ";\t," if sign in text), None)
    words = [word.strip().strip('"').lower() for word in text.split(delimiter)] or [""]
    if is_number(words[0].replace(",", ".")):
        if len(words) < 3:
            raise InputError(
                str(path), f"line {first + 1}: {len(words)} columns, three are needed: x, y, z"
            )
        return Layout(delimiter, first, (0, 1, 2))
    unit = r"[\s_(\[]*(m|metres|meters)?[)\]]*$"
    names = [re.sub(unit, "", word[:LONGEST_NAME]) for word in words]
    missing = [axis for axis in ("x", "y", "z") if axis not in names]
    if missing:
        raise InputError(
            str(path),
            f"line {first + 1}: header without {', '.join(missing)}: {', '.join(words)[:120]}; "
            "valid: columns named x, y, z, or no header and x, y, z first",
        )
    return Layout(delimiter, first + 1, (names.index("x"), names.index("y"), names.index("z")))


def _first_bad_lines(numbered: list[tuple[int, str]], layout: Layout) -> list[str]:
    """The first few lines that hold no three numbers."""
    problems = []
    for number, text in numbered:
        words = [word.strip() for word in text.split(layout.delimiter)]
        chosen = [words[column] for column in layout.columns if column < len(words)]
        if len(chosen) < 3:
            problems.append(f"line {number}: {len(words)} columns, no x, y, z: {text[:60]!r}")
        elif bad := [word for word in chosen if not is_number(word)]:
            problems.append(f"line {number}: {bad[0]!r} is no number")
        if len(problems) == 5:
            problems.append("(only the first five such lines are listed)")
            break
    return problems
