"""The same place as GIS programs keep it: GeoPackage, Shapefile, OpenStreetMap, HGT and DTED."""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Iterator
from contextlib import closing
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from clearway.io.samples.encounter import LATITUDE, LONGITUDE
from clearway.io.samples.maps import CORNER_M, GROUND_M, MASTS

HOUSES = (("house", 0.0, 0.0, 14.0, 9.0), ("hall", 40.0, 10.0, 25.0, 16.0))
"""Name, metres east and north of the corner, side, height."""
EPSG = 25832
APPLICATION = 0x47504B47
VERSION = 10300
"""What SQLite says of a GeoPackage 1.3."""
TABLES = """
CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER PRIMARY KEY,
 organization TEXT NOT NULL, organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL,
 description TEXT);
CREATE TABLE gpkg_contents (table_name TEXT PRIMARY KEY, data_type TEXT NOT NULL, identifier TEXT,
 description TEXT, last_change DATETIME, min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE,
 srs_id INTEGER);
CREATE TABLE gpkg_geometry_columns (table_name TEXT, column_name TEXT, geometry_type_name TEXT,
 srs_id INTEGER, z TINYINT, m TINYINT);
CREATE TABLE buildings (fid INTEGER PRIMARY KEY, geom BLOB, name TEXT, height DOUBLE,
 ground_m DOUBLE);
"""


def _rings() -> Iterator[tuple[str, list[tuple[float, float]], float]]:
    """Name, closed ring in EPSG:25832, height."""
    for name, east, north, side, height in HOUSES:
        x, y = CORNER_M[0] + east, CORNER_M[1] + north
        ring = [(x, y), (x, y + side), (x + side, y + side), (x + side, y), (x, y)]
        yield name, ring, height


def write_geopackage(path: Path, rng: np.random.Generator) -> None:
    """Two houses with heights above ground and their ground's above sea level."""
    del rng
    head = b"GP\0\1" + struct.pack("<i", EPSG)
    with closing(sqlite3.connect(path)) as base, base:
        base.executescript(f"PRAGMA application_id={APPLICATION};PRAGMA user_version={VERSION};")
        base.executescript(TABLES)
        base.execute(
            "INSERT INTO gpkg_spatial_ref_sys VALUES ('ETRS89 / UTM 32N', ?, 'EPSG', ?, '', '')",
            (EPSG, EPSG),
        )
        base.execute(
            "INSERT INTO gpkg_contents (table_name, data_type, srs_id) "
            "VALUES ('buildings', 'features', ?)", (EPSG,)
        )  # fmt: skip
        base.execute(
            "INSERT INTO gpkg_geometry_columns VALUES ('buildings', 'geom', 'POLYGON', ?, 0, 0)",
            (EPSG,),
        )
        for name, ring, height in _rings():
            wkb = struct.pack("<BIII", 1, 3, 1, len(ring)) + np.array(ring, "<f8").tobytes()
            base.execute(
                "INSERT INTO buildings (geom, name, height, ground_m) VALUES (?, ?, ?, ?)",
                (head + wkb, name, height, GROUND_M),
            )


def write_shapefile(path: Path, rng: np.random.Generator) -> None:
    """The same houses; .dbf, .shx and .prj beside it."""
    del rng
    shapefile: Any = import_module("shapefile")
    crs: Any = import_module("pyproj").CRS
    with shapefile.Writer(str(path), shapeType=shapefile.POLYGON) as writer:
        writer.field("NAME", "C", 20)
        writer.field("HEIGHT", "N", 8, 2)
        writer.field("GROUND_ELE", "N", 8, 2)
        for name, ring, height in _rings():
            writer.poly([ring])
            writer.record(name, height, GROUND_M)
    path.with_suffix(".prj").write_text(crs.from_epsg(EPSG).to_wkt("WKT1_ESRI"))
    _fix_date(path.with_suffix(".dbf"))


def _fix_date(table: Path) -> None:
    """A dBASE table with a fixed day of its last change, so that it is the same tomorrow."""
    content = bytearray(table.read_bytes())
    content[1:4] = bytes((126, 1, 1))
    table.write_bytes(content)


def _osm() -> str:
    """Two buildings, one by its storeys, and the masts."""
    lines, number = [], 0
    ways = []
    for name, south, west, half, tags in (
        ("block", 0.0003, -0.0006, 0.0002, {"height": "18 m"}),
        ("flats", -0.0008, 0.0003, 0.0002, {"building:levels": "6"}),
    ):
        corners = ((0, 0), (1, 0), (1, 1), (0, 1))
        first = number + 1
        for dx, dy in corners:
            number += 1
            lat, lon = LATITUDE + south + 2 * half * dy, LONGITUDE + west + 2 * half * dx
            lines.append(f'<node id="{number}" version="1" lat="{lat:.7f}" lon="{lon:.7f}"/>')
        refs = "".join(f'<nd ref="{n}"/>' for n in (*range(first, number + 1), first))
        tags = {"building": "yes", "name": name, **tags}
        ways.append(f'<way id="{first}" version="1">{refs}{_tags(tags)}</way>')
    for name, lat, lon, height in MASTS:
        number += 1
        tags = {"man_made": "mast", "name": name, "height": f"{height:g}"}
        place = f'lat="{lat:.7f}" lon="{lon:.7f}"'
        lines.append(f'<node id="{number}" version="1" {place}>{_tags(tags)}</node>')
    inside = "\n".join((*lines, *ways))
    return f'<?xml version="1.0" encoding="UTF-8"?>\n<osm version="0.6">\n{inside}\n</osm>\n'


def _tags(tags: dict[str, str]) -> str:
    return "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())


def write_osm(path: Path, rng: np.random.Generator) -> None:
    """OpenStreetMap as XML."""
    del rng
    path.write_text(_osm())


def write_osm_packed(path: Path, rng: np.random.Generator) -> None:
    """The same as PBF."""
    del rng
    osmium: Any = import_module("osmium")
    text = osmium.io.FileBuffer(_osm().encode(), "osm")
    with osmium.SimpleWriter(str(path)) as writer:
        for one in osmium.FileProcessor(text):
            writer.add(one)


def _heights(rows: int, columns: int, rng: np.random.Generator) -> Any:
    """[rows, columns] whole metres from north to south: a slope with a range of hills."""
    row, column = np.mgrid[0 : 1 : rows * 1j, 0 : 1 : columns * 1j]
    hills = 150.0 * np.exp(-(((row - 0.4) / 0.1) ** 2)) * (1.0 + np.cos(20.0 * column))
    return np.round(GROUND_M + 80.0 * column + hills + rng.uniform(0.0, 2.0)).astype(np.int16)


def write_hgt(path: Path, rng: np.random.Generator) -> None:
    """A tile of SRTM of three seconds of arc; a corner of it has no data."""
    heights = _heights(1201, 1201, rng).astype(">i2")
    heights[:5, :5] = -32768
    path.write_bytes(heights.tobytes())


def write_dted(path: Path, rng: np.random.Generator) -> None:
    """A tile of DTED of level 0; north of 50 deg it has half as many columns."""
    rasterio: Any = import_module("rasterio")
    copied, memory = import_module("rasterio.shutil").copy, import_module("rasterio.io").MemoryFile
    rows, columns = 121, 61
    across, along = 1.0 / (columns - 1), 1.0 / (rows - 1)
    place = rasterio.transform.from_origin(
        LONGITUDE - 0.5 * across, LATITUDE + 1.0 + 0.5 * along, across, along
    )
    with memory() as file:
        with file.open(
            driver="GTiff", width=columns, height=rows, count=1, dtype="int16", crs="EPSG:4326",
            nodata=-32767, transform=place,
        ) as raster:  # fmt: skip
            raster.write(_heights(rows, columns, rng), 1)
        with file.open() as raster, memory(ext=".dt0") as tile:
            copied(raster, tile.name, driver="DTED")
            path.write_bytes(tile.read())
