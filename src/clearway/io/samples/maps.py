"""Maps of the same made-up place: a block of houses, masts, zones of the airspace, terrain.

Files of GIS programs stand in `gis.py`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clearway.io.samples.encounter import LATITUDE, LONGITUDE

GROUND_M = 100.0
FOOT_M = 0.3048
MASTS = (
    ("mast west", LATITUDE + 0.0004, LONGITUDE - 0.0012, 60.0),
    ("mast east", LATITUDE - 0.0003, LONGITUDE + 0.0011, 45.0),
    ("crane", LATITUDE + 0.0010, LONGITUDE + 0.0002, 80.0),
)
"""Name, degrees, metres above ground."""
CORNER_M = (428_330.0, 5_538_910.0)
"""That place in UTM 32N (EPSG:25832): east, north."""


def _square(north: float, east: float, half: float = 0.0002) -> list[list[float]]:
    """A closed ring of longitude and latitude about a point off the middle, in degrees."""
    south, west = LATITUDE + north - half, LONGITUDE + east - half
    corners = ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))
    return [[round(west + 2.0 * half * x, 7), round(south + 2.0 * half * y, 7)] for x, y in corners]


def write_obstacle_table(path: Path, rng: np.random.Generator) -> None:
    """A table of masts: degrees, metres above ground, radius."""
    del rng
    rows = [f"{name},{lat:.6f},{lon:.6f},{height:g},2\n" for name, lat, lon, height in MASTS]
    path.write_text("name,latitude,longitude,height_m,radius_m\n" + "".join(rows))


def write_faa(path: Path, rng: np.random.Generator) -> None:
    """Records of the FAA's digital obstacle file: 128 columns, feet."""
    del rng
    lines = []
    for number, (name, lat, lon, height) in enumerate(MASTS, start=1):
        feet = round(height / FOOT_M)
        cells = {
            0: f"99-{number:06d}", 10: "O", 12: "ZZ", 18: "NOWHERE", 35: _dms(lat, 2, "NS"),
            48: _dms(lon, 3, "EW"), 62: name.upper()[:18], 81: "1", 83: f"{feet:05d}",
            89: f"{feet + round(GROUND_M / FOOT_M):05d}", 95: "R", 97: "1", 99: "A", 101: "N",
            103: "2026001", 110: "A", 120: "2026001",
        }  # fmt: skip
        record = [" "] * 128
        for column, text in cells.items():
            record[column : column + len(text)] = text
        lines.append("".join(record[:128]) + "\n")
    path.write_text("".join(lines))


def _dms(angle: float, digits: int, signs: str) -> str:
    """Degrees, minutes, seconds and hemisphere, as records have them."""
    seconds = round(abs(angle) * 3600.0, 2)
    degrees, rest = divmod(seconds, 3600.0)
    minutes, left = divmod(rest, 60.0)
    return f"{int(degrees):0{digits}d} {int(minutes):02d} {left:05.2f}{signs[angle < 0.0]}"


def _features() -> list[dict[str, Any]]:
    blocks = [("block", 0.0005, -0.0004, 18.0), ("tower", -0.0006, 0.0005, 42.0)]
    made: list[dict[str, Any]] = [
        {
            "type": "Feature",
            "properties": {"name": name, "height": height},
            "geometry": {"type": "Polygon", "coordinates": [_square(north, east)]},
        }
        for name, north, east, height in blocks
    ]
    for name, lat, lon, height in MASTS:
        made.append(
            {
                "type": "Feature",
                "properties": {"name": name, "height": height},
                "geometry": {"type": "Point", "coordinates": [round(lon, 6), round(lat, 6)]},
            }
        )
    return made


def write_geojson(path: Path, rng: np.random.Generator) -> None:
    """Outlines and masts with `height` in metres above ground."""
    del rng
    path.write_text(json.dumps({"type": "FeatureCollection", "features": _features()}, indent=1))


def write_geojson_lines(path: Path, rng: np.random.Generator) -> None:
    """The same, one feature a line."""
    del rng
    path.write_text("".join(json.dumps(one) + "\n" for one in _features()))


def _city() -> dict[str, Any]:
    """Two houses of six sides each, EPSG:25832 with heights of the German net."""
    vertices: list[list[int]] = []
    objects: dict[str, Any] = {}
    for name, x, y, side, height in (("house", 0, 0, 14, 9), ("hall", 40, 10, 25, 16)):
        first = len(vertices)
        for z in (0, height):
            for dx, dy in ((0, 0), (side, 0), (side, side), (0, side)):
                vertices.append([1000 * (x + dx), 1000 * (y + dy), 1000 * z])
        rings: Sequence[Sequence[int]] = (
            (3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)
        )  # fmt: skip
        shell = [[[first + n for n in ring]] for ring in rings]
        objects[name] = {
            "type": "Building",
            "geometry": [{"type": "Solid", "lod": "1.2", "boundaries": [shell]}],
        }
    return {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [0.001] * 3, "translate": [*CORNER_M, GROUND_M]},
        "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/25832"},
        "CityObjects": objects,
        "vertices": vertices,
    }


def write_cityjson(path: Path, rng: np.random.Generator) -> None:
    """CityJSON 2.0: solids of buildings."""
    del rng
    path.write_text(json.dumps(_city()))


def write_cityjson_lines(path: Path, rng: np.random.Generator) -> None:
    """The same as a sequence: a head, then one building a line."""
    del rng
    city = _city()
    head = {**city, "CityObjects": {}, "vertices": []}
    lines = [json.dumps(head)]
    for number, (name, one) in enumerate(city["CityObjects"].items()):
        first = 8 * number
        shell = [
            [[n - first for n in ring] for ring in part]
            for part in one["geometry"][0]["boundaries"][0]
        ]
        geometry = [{**one["geometry"][0], "boundaries": [shell]}]
        lines.append(
            json.dumps(
                {
                    "type": "CityJSONFeature",
                    "id": name,
                    "CityObjects": {name: {**one, "geometry": geometry}},
                    "vertices": city["vertices"][first : first + 8],
                }
            )
        )
    path.write_text("\n".join(lines) + "\n")


def write_ed269(path: Path, rng: np.random.Generator) -> None:
    """Two zones of ED-269: a polygon on weekdays, a circle always."""
    del rng
    weekdays = [{"day": [day], "startTime": "08:00Z", "endTime": "17:00Z"} for day in
                ("MON", "TUE", "WED", "THU", "FRI")]  # fmt: skip
    zones = [
        {
            "identifier": "ZZZ001", "country": "ZZZ", "name": "school", "type": "COMMON",
            "restriction": "PROHIBITED", "reason": ["SENSITIVE"],
            "applicability": [{"permanent": "NO", "startDateTime": "2026-01-01T00:00:00Z",
                               "endDateTime": "2030-01-01T00:00:00Z", "schedule": weekdays}],
            "zoneAuthority": [{"name": "nobody", "purpose": "INFORMATION"}],
            "geometry": [{"uomDimensions": "M", "lowerLimit": 0, "lowerVerticalReference": "AGL",
                          "upperLimit": 120, "upperVerticalReference": "AGL",
                          "horizontalProjection": {"type": "Polygon",
                                                   "coordinates": [_square(0.001, 0.001)]}}],
        },
        {
            "identifier": "ZZZ002", "country": "ZZZ", "name": "helipad", "type": "COMMON",
            "restriction": "REQ_AUTHORISATION", "reason": ["AIR_TRAFFIC"],
            "applicability": [{"permanent": "YES"}],
            "zoneAuthority": [{"name": "nobody", "purpose": "AUTHORIZATION"}],
            "geometry": [{"uomDimensions": "M", "lowerLimit": 0, "lowerVerticalReference": "AGL",
                          "upperLimit": 300, "upperVerticalReference": "AMSL",
                          "horizontalProjection": {"type": "Circle", "radius": 60.0, "center":
                                                   [LONGITUDE - 0.002, LATITUDE]}}],
        },
    ]  # fmt: skip
    path.write_text(json.dumps({"title": "made up", "features": zones}, indent=1))


def write_ed318(path: Path, rng: np.random.Generator) -> None:
    """One zone of ED-318, in force for ever."""
    del rng
    zone = {
        "type": "Feature",
        "geometry": {
            "type": "GeometryCollection",
            "geometries": [
                {
                    "type": "Polygon",
                    "coordinates": [_square(-0.0012, -0.0008)],
                    "layer": {"upper": 150, "upperReference": "AGL", "lower": 0,
                              "lowerReference": "AGL", "uom": "m"},
                }
            ],
        },
        "properties": {
            "identifier": "ZZZ003", "country": "ZZZ", "type": "PROHIBITED",
            "name": [{"text": "prison", "lang": "en-GB"}],
            "limitedApplicability": [{"permanent": "YES"}],
        },
    }  # fmt: skip
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [zone]}, indent=1))


def write_terrain(path: Path, rng: np.random.Generator) -> None:
    """A GeoTIFF of 10 m: a slope with a hill, EPSG:25832."""
    import rasterio
    from rasterio.transform import from_origin

    rows, columns = np.mgrid[0:40, 0:48]
    hill = 25.0 * np.exp(-((rows - 12.0) ** 2 + (columns - 30.0) ** 2) / 60.0)
    heights = GROUND_M - 5.0 + 0.2 * columns + hill + rng.uniform(0.0, 0.3, rows.shape)
    with rasterio.open(
        path, "w", driver="GTiff", width=48, height=40, count=1, dtype="float32",
        crs="EPSG:25832", nodata=-9999.0,
        transform=from_origin(CORNER_M[0] - 240.0, CORNER_M[1] + 400.0, 10.0, 10.0),
    ) as raster:  # fmt: skip
        raster.write(heights.astype("float32"), 1)
