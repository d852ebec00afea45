"""Tables of obstacles (.csv): a place, a top and a height above ground in every row."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from clearway.base.errors import InputError
from clearway.base.suggest import suggest_nearest
from clearway.base.units import FOOT_M
from clearway.io.foreign import note_unended, read_text
from clearway.io.maps.faa_table import is_faa_table, read_faa_table
from clearway.io.maps.map_features import Disc, Height, MapFeature, ParsedMap
from clearway.io.maps.plausible import MOST_NAMED_FEATURES, feature_problem

COLUMNS: Mapping[str, tuple[str, ...]] = {
    "latitude": ("lat", "latitude"),
    "longitude": ("lon", "lng", "long", "longitude"),
    "height": ("h", "height", "agl", "height_agl", "agl_height"),
    "top": ("z", "top", "amsl", "elevation", "height_amsl", "amsl_height", "top_elevation"),
    "ground": ("gnd_elev", "ground", "ground_elevation"),
    "radius": ("radius",),
    "name": ("name", "lac_name", "obstacle_name"),
    "id": ("id", "identifier", "oas"),
}
"""Names of columns, in small letters and without a unit, by what they mean."""
LENGTHS = ("height", "top", "ground", "radius")
UNITS: Mapping[str, float] = {
    "m": 1.0, "metres": 1.0, "meters": 1.0, "deg": 1.0, "degrees": 1.0,
    "ft": FOOT_M, "feet": FOOT_M,
}  # fmt: skip
CONTRADICTS_M = 5.0
"""By which ground and height may come to another top than is reported."""
LONGEST_NAME = 80
"""Of a column."""
UNIT = re.compile(rf"[\s_]*(?:[(\[]\s*|[\s_])({'|'.join(UNITS)})\s*[)\]]?$")
"""At the end of a name: `height_ft`, `Height (ft)`, `height [m]`."""


DECIMAL_COMMA = re.compile(r"^(\s*[+-]?\d+),(\d+\s*)$")


class Column(NamedTuple):
    """Where a column stands, and what its numbers are in."""

    place: int
    metres: float
    """Of its unit; 1 for degrees."""
    stated: bool
    """Whether its name says the unit."""


class ObstacleRow(NamedTuple):
    """The numbers of one row, as far as the table has them."""

    values: dict[str, float]
    name: str


def read_obstacle_table(path: Path, radius_m: float) -> ParsedMap:
    """Upright obstacles of a table with columns for latitude, longitude and height or top.

    Degrees, and metres unless the name of a column says feet. radius_m: what is assumed where the
    table has no radius. Heights above sea level are taken where the table has them, else heights
    above ground. Raises InputError with every bad line.
    """
    text = read_text(path, western=True)
    first, rows = _rows(text)
    names = [name.strip().lower() for name in rows[0]]
    if is_faa_table(names):
        return read_faa_table(path, rows, radius_m)
    columns = _columns(path, first, names)
    parsed, problems, contradict, no_height = [], [], [], 0
    for line, row in enumerate(rows[1:], start=first + 1):
        if not any(cell.strip() for cell in row):
            continue
        try:
            one = _row(line, row, columns, len(rows[0]))
        except ValueError as cause:
            problems.append(f"line {line}: {cause}")
            continue
        if not one.values.keys() & {"height", "top"}:
            no_height += 1
            continue
        feature = _feature(one, radius_m)
        problem = feature_problem(feature)
        if problem is None:
            parsed.append(feature)
            if _contradict(one.values):
                contradict.append(line)
        else:
            problems.append(f"line {line}: {problem}")
    if problems:
        raise InputError(str(path), problems)
    if not parsed:
        raise InputError(str(path), "no obstacle with a place and a height in it")
    return ParsedMap(
        kind="obstacle table",
        crs="WGS 84 latitude and longitude",
        features=tuple(parsed),
        counts={"no height": no_height} if no_height else {},
        notes=(*_notes(columns, radius_m), *_contradictions(contradict), *note_unended(text)),
    )


def _rows(text: str) -> tuple[int, list[list[str]]]:
    """Line of the header, and cells of it and of the rows below; commas may be decimal signs."""
    lines = text.splitlines()
    first = next((n for n, line in enumerate(lines) if _begins(line)), 0)
    delimiter = max(",;\t", key=lines[first].count)
    rows = list(csv.reader(lines[first:], delimiter=delimiter))
    if delimiter != ",":
        rows[1:] = [[DECIMAL_COMMA.sub(r"\1.\2", cell) for cell in row] for row in rows[1:]]
    return first + 1, rows


def _begins(line: str) -> bool:
    """Whether a table can begin here: neither blank nor a comment."""
    return bool(line.strip(" \t,;")) and not line.startswith("#")


def _columns(path: Path, line: int, header: list[str]) -> dict[str, Column]:
    """Where each meaning stands in a row, and in what unit."""
    header = [name[:LONGEST_NAME] for name in header]
    plain = [UNIT.sub("", name).replace(" ", "_") for name in header]
    columns: dict[str, Column] = {}
    for meaning, names in COLUMNS.items():
        found = [plain.index(name) for name in names if name in plain]
        if found:
            unit = UNIT.search(header[found[0]])
            metres = UNITS[unit[1]] if unit is not None else 1.0
            columns[meaning] = Column(found[0], metres, unit is not None)
    missing = [name for name in ("latitude", "longitude") if name not in columns]
    if "height" not in columns and "top" not in columns:
        missing.append("height or top")
    if missing:
        wanted = "; ".join(
            " or ".join(" or ".join(COLUMNS[part]) for part in name.split(" or "))
            for name in missing
        )
        called = [one for name in missing for part in name.split(" or ") for one in COLUMNS[part]]
        near = [(name, suggest_nearest(name, called)) for name in plain]
        hint = "".join(f" ({name!r}: did you mean {one!r}?)" for name, one in near if one)
        raise InputError(
            str(path),
            f"line {line}: no column for {', '.join(missing)} among {', '.join(header)[:200]}"
            f"{hint}; valid names: {wanted}, with a unit (m, ft) after it or not",
        )
    return columns


def _row(line: int, row: list[str], columns: Mapping[str, Column], width: int) -> ObstacleRow:
    if len(row) < width:
        raise ValueError(f"{len(row)} of {width} columns: truncated?")
    values = {}
    for meaning, column in columns.items():
        cell = row[column.place].strip()
        if meaning in ("name", "id") or not cell:
            continue
        try:
            values[meaning] = float(cell) * column.metres
        except ValueError:
            raise ValueError(f"{meaning} is no number: {cell!r}") from None
        if not abs(values[meaning]) < 1e6:
            raise ValueError(f"{meaning} is out of range: {cell}")
    for meaning, limit in (("latitude", 90.0), ("longitude", 180.0)):
        if meaning not in values:
            raise ValueError(f"{meaning} is missing")
        if abs(values[meaning]) > limit:
            raise ValueError(f"{meaning} {values[meaning]:g} is not within +-{limit:g} degrees")
    if values.get("height", 1.0) <= 0.0:
        raise ValueError(f"height {values['height']:g} is not above 0")
    if values.get("radius", 1.0) <= 0.0:
        raise ValueError(f"radius {values['radius']:g} is not above 0")
    names = [row[columns[key].place].strip() for key in ("name", "id") if key in columns]
    return ObstacleRow(values, next((name for name in names if name), f"line {line}"))


def _feature(row: ObstacleRow, radius_m: float) -> MapFeature:
    values = row.values
    outline = Disc(values["latitude"], values["longitude"], values.get("radius", radius_m))
    if "top" not in values:
        low, high = Height(0.0, "ground"), Height(values["height"], "ground")
        return MapFeature(row.name, outline, low, high)
    top = Height(values["top"], "sea level")
    if "height" in values:
        foot_m, top_m = _stretch(values)
        return MapFeature(row.name, outline, Height(foot_m, top.above), Height(top_m, top.above))
    if "ground" in values:
        return MapFeature(row.name, outline, Height(values["ground"], "sea level"), top)
    return MapFeature(row.name, outline, Height(0.0, "ground"), top)


def _stretch(values: Mapping[str, float]) -> tuple[float, float]:
    """Foot and top; where ground, height and top contradict each other, all that any of them says
    is taken: a wrong digit must not lift an obstacle off its place."""
    foot_m, top_m = values["top"] - values["height"], values["top"]
    if _contradict(values):
        return min(foot_m, values["ground"]), max(top_m, values["ground"] + values["height"])
    return foot_m, top_m


def _contradict(values: Mapping[str, float]) -> bool:
    if not values.keys() >= {"height", "top", "ground"}:
        return False
    return abs(values["top"] - values["height"] - values["ground"]) > CONTRADICTS_M


def _contradictions(lines: Sequence[int]) -> Iterator[str]:
    if lines:
        more = (
            f" and {len(lines) - MOST_NAMED_FEATURES} more"
            if len(lines) > MOST_NAMED_FEATURES
            else ""
        )
        yield (
            f"lines {', '.join(map(str, lines[:MOST_NAMED_FEATURES]))}{more}: top, height and "
            "ground contradict each other; all that any of them says is taken"
        )


def _notes(columns: Mapping[str, Column], radius_m: float) -> tuple[str, ...]:
    notes = []
    if not any(columns[name].stated for name in LENGTHS if name in columns):
        notes.append("no unit of heights in the file: metres assumed")
    if "radius" not in columns:
        notes.append(f"no radius in the file: {radius_m:g} m assumed around each point")
    if "top" in columns:
        notes.append("tops are taken as heights above sea level")
    return tuple(notes)
