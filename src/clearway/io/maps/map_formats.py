"""The kinds of map files, by suffix, and of maps in JSON by what they say."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from clearway.base.errors import InputError
from clearway.io.foreign import read_json
from clearway.io.maps.cityjson import read_cityjson
from clearway.io.maps.faa_obstacles import read_faa_obstacles
from clearway.io.maps.geojson import read_geojson
from clearway.io.maps.geozones import is_ed318, read_ed318
from clearway.io.maps.geozones_ed269 import is_ed269, read_ed269
from clearway.io.maps.json_sequence import read_sequence
from clearway.io.maps.map_features import ParsedMap
from clearway.io.maps.obstacle_table import read_obstacle_table
from clearway.io.maps.terrain_file import read_terrain

SEQUENCES = (".jsonl", ".geojsonl", ".ndjson")
"""Suffixes of files with one object a line."""


def _read_terrain(path: Path, _radius_m: float) -> ParsedMap:
    return read_terrain(path)


def _read_json(path: Path, radius_m: float) -> ParsedMap:
    """CityJSON, ED-318, ED-269 or GeoJSON, by what the object in the file says."""
    data = read_sequence(path) if path.suffix.lower() in SEQUENCES else read_json(path)
    if data.get("type") == "CityJSON":
        return read_cityjson(path, data)
    if is_ed269(data):
        return read_ed269(path, data)
    if is_ed318(data):
        return read_ed318(path, data)
    if data.get("type") in ("FeatureCollection", "Feature"):
        return read_geojson(path, data, radius_m)
    raise InputError(
        str(path),
        f"JSON of no known map format (type {data.get('type')!r}, keys "
        f"{', '.join(map(str, list(data)[:6]))}); valid: CityJSON, GeoJSON features, "
        "ED-318 or ED-269 zones",
    )


READERS: Mapping[str, Callable[[Path, float], ParsedMap]] = {
    ".csv": read_obstacle_table,
    ".tsv": read_obstacle_table,
    ".dat": read_faa_obstacles,
    ".json": _read_json,
    ".geojson": _read_json,
    **dict.fromkeys(SEQUENCES, _read_json),
    ".tif": _read_terrain,
    ".tiff": _read_terrain,
}
