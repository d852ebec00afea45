"""Tables of obstacles (.csv): a place, a top and a height above ground in every row."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from clearway.errors import InputError
from clearway.io.foreign import read_text
from clearway.io.map_features import Disc, Height, MapFeature, ParsedMap

COLUMNS: Mapping[str, tuple[str, ...]] = {
    "latitude": ("lat", "latitude", "latitude_deg", "lat_deg"),
    "longitude": ("lon", "lng", "longitude", "longitude_deg", "lon_deg"),
    "height": ("h", "height", "height_m", "agl", "agl_m"),
    "top": ("z", "top", "top_m", "amsl", "amsl_m", "elevation"),
    "ground": ("gnd_elev", "ground", "ground_m", "ground_elevation"),
    "radius": ("radius", "radius_m"),
    "name": ("name", "lac_name", "obstacle_name"),
    "id": ("id", "identifier", "oas"),
}
"""Names of columns, in small letters, by what they mean; metres and degrees throughout."""


class Row(NamedTuple):
    """The numbers of one row, as far as the table has them."""

    values: dict[str, float]
    name: str


def read_obstacle_table(path: Path, radius_m: float) -> ParsedMap:
    """Upright obstacles of a table with columns for latitude, longitude and height or top.

    radius_m: what is assumed where the table has no radius. Heights above sea level are taken
    where the table has them, else heights above ground. Raises InputError with every bad line.
    """
    text = read_text(path)
    first = text.splitlines()[0]
    delimiter = max(",;\t", key=first.count)
    rows = list(csv.reader(text.splitlines(), delimiter=delimiter))
    columns = _columns(path, [name.strip().lower() for name in rows[0]])
    parsed, problems, no_height = [], [], 0
    for line, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        try:
            one = _row(line, row, columns, len(rows[0]))
        except ValueError as cause:
            problems.append(f"line {line}: {cause}")
            continue
        if one.values.keys() & {"height", "top"}:
            parsed.append(_feature(one, radius_m))
        else:
            no_height += 1
    if problems:
        raise InputError(str(path), problems)
    if not parsed:
        raise InputError(str(path), "no obstacle with a place and a height in it")
    return ParsedMap(
        kind="obstacle table",
        crs="WGS 84 latitude and longitude",
        features=tuple(parsed),
        counts={"no height": no_height} if no_height else {},
        notes=_notes(columns, radius_m),
    )


def _columns(path: Path, header: list[str]) -> dict[str, int]:
    """Where each meaning stands in a row."""
    columns: dict[str, int] = {}
    for meaning, names in COLUMNS.items():
        found = [header.index(name) for name in names if name in header]
        if found:
            columns[meaning] = found[0]
    missing = [name for name in ("latitude", "longitude") if name not in columns]
    if "height" not in columns and "top" not in columns:
        missing.append("height or top")
    if missing:
        wanted = "; ".join(
            " or ".join(" or ".join(COLUMNS[part]) for part in name.split(" or "))
            for name in missing
        )
        raise InputError(
            str(path),
            f"line 1: no column for {', '.join(missing)} among {', '.join(header)[:200]}; "
            f"valid names: {wanted}",
        )
    return columns


def _row(line: int, row: list[str], columns: Mapping[str, int], width: int) -> Row:
    if len(row) < width:
        raise ValueError(f"{len(row)} of {width} columns: truncated?")
    values = {}
    for meaning, index in columns.items():
        cell = row[index].strip()
        if meaning in ("name", "id") or not cell:
            continue
        try:
            values[meaning] = float(cell)
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
    names = [row[columns[key]].strip() for key in ("name", "id") if key in columns]
    return Row(values, next((name for name in names if name), f"line {line}"))


def _feature(row: Row, radius_m: float) -> MapFeature:
    values = row.values
    outline = Disc(values["latitude"], values["longitude"], values.get("radius", radius_m))
    if "top" not in values:
        low, high = Height(0.0, "ground"), Height(values["height"], "ground")
        return MapFeature(row.name, outline, low, high)
    top = Height(values["top"], "sea level")
    if "height" in values:
        return MapFeature(row.name, outline, Height(top.value_m - values["height"], top.above), top)
    if "ground" in values:
        return MapFeature(row.name, outline, Height(values["ground"], "sea level"), top)
    return MapFeature(row.name, outline, Height(0.0, "ground"), top)


def _notes(columns: Mapping[str, int], radius_m: float) -> tuple[str, ...]:
    notes = []
    if "radius" not in columns:
        notes.append(f"no radius in the file: {radius_m:g} m assumed around each point")
    if "top" in columns:
        notes.append("tops are taken as heights above sea level")
    return tuple(notes)
