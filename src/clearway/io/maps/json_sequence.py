"""Maps with one JSON object a line: CityJSON sequences, and GeoJSON features."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from clearway.base.errors import InputError
from clearway.io.foreign import NoJsonError, parse_json, read_text


def read_sequence(path: Path) -> dict[str, Any]:
    """The one object that the lines come down to: a CityJSON model, or a FeatureCollection.

    Raises InputError with every line that is none of its kind.
    """
    rows: list[dict[str, Any]] = []
    problems = []
    for number, line in enumerate(read_text(path).split("\n"), start=1):
        if not line.strip():
            continue
        try:
            row = parse_json(path, line, f"line {number}")
        except NoJsonError as cause:
            problems.append(f"line {number}: no JSON object, truncated? ({cause})")
            continue
        wanted = "CityJSONFeature" if rows and _type(rows[0]) == "CityJSON" else "Feature"
        if (rows or _type(row) != "CityJSON") and _type(row) != wanted:
            problems.append(
                f"line {number}: an object of type {wanted} is needed, got {_type(row)!r}"
            )
        else:
            rows.append(row)
    if problems:
        raise InputError(str(path), problems[:10])
    if _type(rows[0]) == "CityJSON":
        return _model(path, rows)
    return {"type": "FeatureCollection", "features": rows}


def _type(row: object) -> object:
    return row.get("type") if isinstance(row, dict) else None


def _model(path: Path, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """All objects of a sequence in one model; each feature has vertices of its own."""
    head = rows[0]
    vertices = list(head.get("vertices") or [])
    objects = dict(head.get("CityObjects") or {})
    for number, row in enumerate(rows[1:], start=1):
        own, parts = row.get("vertices"), row.get("CityObjects")
        if not isinstance(own, list) or not isinstance(parts, dict):
            raise InputError(str(path), f"feature {number}: no CityObjects and vertices")
        for name, part in parts.items():
            objects[name] = _raise_vertices(part, len(vertices), len(own))
        vertices.extend(own)
    return {**head, "CityObjects": objects, "vertices": vertices}


def _raise_vertices(part: object, by: int, count: int) -> object:
    """An object with the numbers of its vertices raised; those that do not exist stay so."""
    if not isinstance(part, dict) or not isinstance(part.get("geometry"), list):
        return part
    geometry = [
        {**one, "boundaries": _raise_numbers(one.get("boundaries", []), by, count)}
        if isinstance(one, dict)
        else one
        for one in part["geometry"]
    ]
    return {**part, "geometry": geometry}


def _raise_numbers(boundaries: object, by: int, count: int) -> object:
    if isinstance(boundaries, list):
        return [_raise_numbers(part, by, count) for part in boundaries]
    if isinstance(boundaries, int) and 0 <= boundaries < count:
        return boundaries + by
    return -1 if isinstance(boundaries, int) else boundaries
