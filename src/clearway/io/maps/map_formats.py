"""The kinds of map files, by suffix, and of maps in JSON by what they say."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from clearway.base.errors import InputError
from clearway.base.variants import join_choices
from clearway.io.foreign import read_json
from clearway.io.maps.cityjson import read_cityjson
from clearway.io.maps.faa_obstacles import read_faa_obstacles
from clearway.io.maps.geojson import read_geojson
from clearway.io.maps.geopackage import read_geopackage
from clearway.io.maps.geozones import is_ed318, read_ed318
from clearway.io.maps.geozones_ed269 import is_ed269, read_ed269
from clearway.io.maps.json_sequence import read_sequence
from clearway.io.maps.map_features import ParsedMap
from clearway.io.maps.obstacle_table import read_obstacle_table
from clearway.io.maps.osm import read_osm
from clearway.io.maps.shapefile_map import read_shapefile
from clearway.io.maps.terrain_file import read_terrain

SEQUENCES = (".jsonl", ".geojsonl", ".ndjson")
"""Suffixes of files with one object a line."""


class Assumed(NamedTuple):
    """What is taken where a file says nothing."""

    radius_m: float
    """Of mere points."""
    crs: str | None = None
    """Of a model or a Shapefile that states no reference system, such as EPSG:7415."""


class JsonFormat(NamedTuple):
    """A kind of map in JSON."""

    name: str
    recognises: Callable[[Mapping[str, Any]], bool]
    read: Callable[[Path, dict[str, Any], Assumed], ParsedMap]
    """Path, the object in it, and what is taken where it says nothing."""
    file: str
    """For tables; so the next two."""
    holds: str
    stands: str


ZONES = (
    "zones of the airspace, their limits of height, their times",
    "keep-out volumes: on the map, but not there to be seen",
)
JSON_FORMATS = (
    JsonFormat(
        "CityJSON",
        lambda data: data.get("type") == "CityJSON",
        lambda path, data, assumed: read_cityjson(path, data, assumed.crs),
        "`.json` CityJSON 1.0 to 2.0, `.jsonl` sequences",
        "whatever stands more than 1 m above its lowest point; roads, water and land are left out, "
        "and so are points, lines and instances of templates",
        "solid from the lowest point to its surfaces, in steps of at most 2 m of height",
    ),
    JsonFormat(
        "ED-269 zones",
        is_ed269,
        lambda path, data, _assumed: read_ed269(path, data),
        "`.json` ED-269",
        *ZONES,
    ),
    JsonFormat(
        "ED-318 zones",
        is_ed318,
        lambda path, data, _assumed: read_ed318(path, data),
        "`.json` ED-318",
        *ZONES,
    ),
    JsonFormat(
        "GeoJSON features",
        lambda data: data.get("type") in ("FeatureCollection", "Feature"),
        lambda path, data, assumed: read_geojson(path, data, assumed.radius_m),
        "GeoJSON (`.json`, `.geojson`), features one a line in `.geojsonl`, `.ndjson`",
        "polygons and points with `height` (from `min_height` up, above ground) or `top_m` (above "
        "sea level, from `ground_m` up), in metres or with a unit (`40 ft`, `40'6\"`)",
        "as solids; lines and what has no height are left out",
    ),
)
"""In the order in which they are tried."""


def _read_json(path: Path, assumed: Assumed) -> ParsedMap:
    """A map by what the object in the file says."""
    data = read_sequence(path) if path.suffix.lower() in SEQUENCES else read_json(path)
    for one in JSON_FORMATS:
        if one.recognises(data):
            return one.read(path, data, assumed)
    raise InputError(
        str(path),
        f"JSON of no known map format (type {data.get('type')!r}, keys "
        f"{', '.join(map(str, list(data)[:6]))}); valid: "
        f"{join_choices([one.name for one in JSON_FORMATS])}",
    )


class MapFormat(NamedTuple):
    """A kind of map files, by suffix."""

    name: str
    suffixes: tuple[str, ...]
    read: Callable[[Path, Assumed], ParsedMap]
    file: str = ""
    """For tables; so the next two. Empty where a row tells more than one kind."""
    holds: str = ""
    stands: str = ""


MAP_FORMATS = (
    MapFormat(
        "tables of obstacles, of the FAA too",
        (".csv", ".tsv"),
        lambda path, assumed: read_obstacle_table(path, assumed.radius_m),
        "`.csv`, `.tsv`",
        "columns `lat`, `lon`, and `h` or `height` (above ground) or `z` or `top` (above sea "
        "level); `gnd_elev`, `radius`, `name` if there; metres, or feet where a column's name says "
        "so (`agl_ft`, `Height (ft)`); between semicolons or tabs commas may be decimal signs",
        "a square pillar around every point, 20 m to each side where no radius is given "
        "(`--radius`, `point_radius_m`)",
    ),
    MapFormat(
        "digital obstacle file of the FAA",
        (".dat",),
        lambda path, assumed: read_faa_obstacles(path, assumed.radius_m),
        "`.dat`, `.csv`",
        "digital obstacle file of the FAA, 128 columns a record, or its table with `LATDEC` and "
        "`AMSL`",
        "as above, grown by the horizontal and vertical accuracy that the record states; "
        "dismantled obstacles are left out",
    ),
    MapFormat(
        join_choices([one.name for one in JSON_FORMATS]),
        (".json", ".geojson", *SEQUENCES),
        _read_json,
    ),
    MapFormat(
        "GeoPackage",
        (".gpkg",),
        lambda path, assumed: read_geopackage(path, assumed.radius_m),
        "`.gpkg`",
        "polygons and points of all its tables of features, with columns as the properties of "
        "GeoJSON, in any reference system; z of their corners is not read",
        "as solids; lines and what has no height are left out",
    ),
    MapFormat(
        "Shapefile",
        (".shp",),
        lambda path, assumed: read_shapefile(path, assumed.radius_m, assumed.crs),
        "`.shp` with `.dbf` and `.prj` beside it (without `.prj`: `--crs`)",
        "polygons and points; names of columns cut to ten letters are known too",
        "as solids; lines and what has no height are left out",
    ),
    MapFormat(
        "OpenStreetMap (XML, PBF)",
        (".osm", ".pbf"),
        lambda path, assumed: read_osm(path, assumed.radius_m),
        "`.osm`, `.osm.pbf`",
        "areas and nodes with `height` (from `min_height` up, above ground) or storeys "
        "(`building:levels`, `roof:levels`), 4 m each, which a note states",
        "as solids; buildings, masts and towers without height are left out and counted by kind",
    ),
    MapFormat(
        "terrain of SRTM (HGT)",
        (".hgt",),
        lambda path, _assumed: read_terrain(path),
        "`.hgt`",
        "a tile of SRTM of 1 or 3 seconds of arc, which lies where its name says (`N50E008.hgt`); "
        "metres above sea level (EGM96)",
        "as a GeoTIFF",
    ),
    MapFormat(
        "terrain of DTED",
        (".dt0", ".dt1", ".dt2"),
        lambda path, _assumed: read_terrain(path),
        "`.dt0`, `.dt1`, `.dt2`",
        "a tile of DTED of level 0 to 2; metres above sea level (EGM96)",
        "as a GeoTIFF",
    ),
    MapFormat(
        "terrain (GeoTIFF)",
        (".tif", ".tiff"),
        lambda path, _assumed: read_terrain(path),
        "`.tif`, `.tiff`",
        "a terrain raster of one band with a reference system; heights in the unit that the band "
        "or the vertical system states; what lies outside -500 to 9000 m is no data",
        "a floor of at most 4,000 blocks that is never below the terrain",
    ),
)
"""Add a format here: help, messages and the table of docs/maps.md are made from it."""
READERS: Mapping[str, Callable[[Path, Assumed], ParsedMap]] = {
    suffix: one.read for one in MAP_FORMATS for suffix in one.suffixes
}
