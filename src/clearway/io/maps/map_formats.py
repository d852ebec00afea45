"""The kinds of map files, by suffix, and of maps in JSON by what they say."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from clearway.base.errors import InputError
from clearway.base.variants import in_words
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


class JsonFormat(NamedTuple):
    """A kind of map in JSON."""

    name: str
    recognises: Callable[[Mapping[str, Any]], bool]
    read: Callable[[Path, dict[str, Any], float], ParsedMap]
    """Path, the object in it, and the radius of mere points."""


JSON_FORMATS = (
    JsonFormat(
        "CityJSON",
        lambda data: data.get("type") == "CityJSON",
        lambda path, data, _radius_m: read_cityjson(path, data),
    ),
    JsonFormat("ED-269 zones", is_ed269, lambda path, data, _radius_m: read_ed269(path, data)),
    JsonFormat("ED-318 zones", is_ed318, lambda path, data, _radius_m: read_ed318(path, data)),
    JsonFormat(
        "GeoJSON features",
        lambda data: data.get("type") in ("FeatureCollection", "Feature"),
        read_geojson,
    ),
)
"""In the order in which they are tried."""


def _read_terrain(path: Path, _radius_m: float) -> ParsedMap:
    return read_terrain(path)


def _read_json(path: Path, radius_m: float) -> ParsedMap:
    """A map by what the object in the file says."""
    data = read_sequence(path) if path.suffix.lower() in SEQUENCES else read_json(path)
    for one in JSON_FORMATS:
        if one.recognises(data):
            return one.read(path, data, radius_m)
    raise InputError(
        str(path),
        f"JSON of no known map format (type {data.get('type')!r}, keys "
        f"{', '.join(map(str, list(data)[:6]))}); valid: "
        f"{in_words([one.name for one in JSON_FORMATS])}",
    )


class MapFormat(NamedTuple):
    """A kind of map files, by suffix."""

    name: str
    suffixes: tuple[str, ...]
    read: Callable[[Path, float], ParsedMap]


FORMATS = (
    MapFormat("tables of obstacles, of the FAA too", (".csv", ".tsv"), read_obstacle_table),
    MapFormat("digital obstacle file of the FAA", (".dat",), read_faa_obstacles),
    MapFormat(
        in_words([one.name for one in JSON_FORMATS]),
        (".json", ".geojson", *SEQUENCES),
        _read_json,
    ),
    MapFormat("terrain (GeoTIFF)", (".tif", ".tiff"), _read_terrain),
)
"""Add a format here; docs/maps.md tells more of each."""
READERS: Mapping[str, Callable[[Path, float], ParsedMap]] = {
    suffix: one.read for one in FORMATS for suffix in one.suffixes
}
