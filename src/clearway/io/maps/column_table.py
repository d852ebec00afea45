"""Tables of upright columns (.csv) in metres of the world: the obstacle fields of benchmarks."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.io.foreign import read_text

COLUMN_NAMES: Mapping[str, tuple[str, ...]] = {
    "x": ("x", "x_m"),
    "y": ("y", "y_m"),
    "radius": ("radius", "radius_m", "circumscribed_radius_m", "r"),
    "top": ("height", "height_m", "z_max", "z_max_m", "top_m"),
}
"""Names of columns, in small letters, by what they mean; others are not read."""
MOST_COLUMNS = 100_000


def read_column_table(path: Path) -> FloatArray:
    """Read upright columns of a table with a header line.

    Returns
    -------
    array [n, 5]
        x, y, radius, lowest and highest height of each, in metres. Each stands on height 0.

    Raises
    ------
    InputError
        With every bad line, and for a table without one of the columns needed.
    """
    lines = list(csv.reader(read_text(path, western=True).splitlines()))
    header = [name.strip().lower() for name in lines[0]] if lines else []
    places = [
        next((header.index(name) for name in names if name in header), -1)
        for names in COLUMN_NAMES.values()
    ]
    missing = [
        " or ".join(names)
        for names, place in zip(COLUMN_NAMES.values(), places, strict=True)
        if place < 0
    ]
    if missing:
        raise InputError(str(path), [f"line 1: no column {each}" for each in missing])
    rows, problems = [], []
    for line, cells in enumerate(lines[1:], start=2):
        if not any(cell.strip() for cell in cells):
            continue
        try:
            x, y, radius, top = (float(cells[place]) for place in places)
        except (ValueError, IndexError):
            problems.append(f"line {line}: four numbers are needed, got {','.join(cells)[:80]!r}")
            continue
        if not (np.all(np.abs([x, y, radius, top]) < 1e6) and radius > 0.0 and top > 0.0):
            problems.append(f"line {line}: radius and height must be above 0, all below 1e6")
        rows.append((x, y, radius, 0.0, top))
    if problems or not rows or len(rows) > MOST_COLUMNS:
        raise InputError(str(path), problems or f"{len(rows)} columns; 1 to {MOST_COLUMNS:,}")
    return np.array(rows)
