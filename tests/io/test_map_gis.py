"""Files of GIS programs: the same houses and the same ground, whichever way they are kept."""

from __future__ import annotations

import sqlite3
import struct
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.io.maps.map_features import Geodetic
from clearway.io.maps.maps import MapFile, read_map, read_maps
from clearway.io.maps.osm import STOREY_M
from clearway.io.samples import gis
from clearway.io.samples.encounter import LATITUDE, LONGITUDE

ORIGIN = Geodetic(LATITUDE, LONGITUDE, 100.0)
NOBODY = np.random.default_rng(0)


def boxes(one: MapFile) -> list[tuple[str, list[float], list[float]]]:
    return [
        (o.name, np.round(o.position_m, 2).tolist(), np.round(o.size_m, 1).tolist())
        for o in one.obstacles
    ]


def test_the_same_houses_in_a_geopackage_and_a_shapefile(tmp_path):
    gis.write_geopackage(tmp_path / "a.gpkg", NOBODY)
    gis.write_shapefile(tmp_path / "b.shp", NOBODY)
    package, shape = (read_map(tmp_path / name, ORIGIN) for name in ("a.gpkg", "b.shp"))
    assert boxes(package) == boxes(shape)
    assert [(name, size) for name, _, size in boxes(package)] == [
        ("house", [14.0, 14.0, 9.0]),
        ("hall", [25.0, 25.0, 16.0]),
    ]
    # GROUND_ELE, cut to ten letters, is the ground above sea level: feet stand on the origin's.
    assert package.obstacles[0].position_m[2] == pytest.approx(4.5, abs=0.02)
    assert "ETRS89" in package.crs


def test_a_shapefile_without_its_system_is_placed_by_a_stated_one(tmp_path):
    gis.write_shapefile(tmp_path / "a.shp", NOBODY)
    whole = boxes(read_map(tmp_path / "a.shp", ORIGIN))
    (tmp_path / "a.prj").unlink()
    with pytest.raises(InputError, match=r"no a\.prj beside it.*--crs"):
        read_map(tmp_path / "a.shp", ORIGIN)
    stated = read_maps([tmp_path / "a.shp"], ORIGIN, crs="EPSG:25832")[0]
    assert boxes(stated) == whole
    (tmp_path / "a.dbf").unlink()
    with pytest.raises(InputError, match=r"no a\.dbf beside it"):
        read_maps([tmp_path / "a.shp"], ORIGIN, crs="EPSG:25832")


def changed(path: Path, *statements: str) -> Path:
    gis.write_geopackage(path, NOBODY)
    with closing(sqlite3.connect(path)) as base, base:
        for one in statements:
            base.execute(one)
    return path


def test_of_a_geopackage_every_row_is_a_feature_or_counted(tmp_path):
    line = b"GP\0\1" + struct.pack("<i", 25832) + struct.pack("<BII4d", 1, 2, 2, *range(4))
    path = changed(
        tmp_path / "a.gpkg",
        "INSERT INTO buildings (name) VALUES ('nowhere')",
        f"INSERT INTO buildings (geom, height) VALUES (x'{line.hex()}', 5)",
        "INSERT INTO buildings (geom, height) VALUES (x'4750', 5)",
        "UPDATE buildings SET height = NULL, ground_m = NULL WHERE name = 'hall'",
    )
    read = read_map(path, ORIGIN)
    assert len(read.obstacles) == 1
    assert read.counts == {
        "no geometry": 1,
        "LineString: no outline": 1,
        "geometry that cannot be read": 1,
        "no height": 1,
    }


@pytest.mark.parametrize(
    ("statement", "cause"),
    [
        ("DROP TABLE gpkg_geometry_columns", "no GeoPackage with features"),
        ("DELETE FROM gpkg_geometry_columns", "no table of features"),
        ("UPDATE gpkg_geometry_columns SET column_name = 'x'", "no column 'x'"),
        ("UPDATE gpkg_geometry_columns SET srs_id = 7", "no reference system"),
        ("UPDATE buildings SET height = 'tall'", "buildings row 1: height: 'tall' is no length"),
        ("UPDATE buildings SET height = NULL", "valid columns: height_m"),
    ],
)
def test_what_a_geopackage_lacks_is_named(statement, cause, tmp_path):
    with pytest.raises(InputError) as told:
        read_map(changed(tmp_path / "a.gpkg", statement), ORIGIN)
    assert cause in str(told.value)
    assert "a.gpkg" in str(told.value)


def test_a_view_without_end_is_ended(tmp_path):
    path = changed(
        tmp_path / "a.gpkg",
        "ALTER TABLE buildings RENAME TO old",
        "CREATE VIEW buildings AS WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) "
        "SELECT count(*) AS geom FROM n",
    )
    with pytest.raises(InputError, match="reading it does not come to an end"):
        read_map(path, ORIGIN)


def test_openstreetmap_as_xml_and_packed(tmp_path):
    gis.write_osm(tmp_path / "a.osm", NOBODY)
    gis.write_osm_packed(tmp_path / "a.osm.pbf", NOBODY)
    read = read_map(tmp_path / "a.osm", ORIGIN)
    assert boxes(read) == boxes(read_map(tmp_path / "a.osm.pbf", ORIGIN))
    heights = {name: size[2] for name, _, size in boxes(read)}
    assert heights == {
        "mast west": 60.0, "mast east": 45.0, "crane": 80.0, "block": 18.0,
        "flats": 6.0 * STOREY_M,
    }  # fmt: skip
    assert any("1 buildings tell storeys alone: 4 m each" in note for note in read.notes)


def test_of_openstreetmap_what_stands_without_a_height_is_counted(tmp_path):
    gis.write_osm(tmp_path / "whole.osm", NOBODY)
    text = (tmp_path / "whole.osm").read_text()
    more = (
        '<node id="90" version="1" lat="50" lon="8"><tag k="power" v="tower"/></node>'
        '<node id="91" version="1" lat="50" lon="8"><tag k="man_made" v="mast"/>'
        '<tag k="height" v="tall"/></node>'
        '<way id="92" version="1"><nd ref="90"/><nd ref="777"/><nd ref="778"/><nd ref="90"/>'
        '<tag k="building" v="yes"/><tag k="height" v="9"/></way>'
        '<way id="93" version="1"><nd ref="90"/><nd ref="91"/><tag k="height" v="9"/></way>'
    )
    (tmp_path / "a.osm").write_text(
        text.replace("</osm>", f"{more}</osm>").replace('v="18 m"', 'v="59\'1&quot;"')
    )
    read = read_map(tmp_path / "a.osm", ORIGIN)
    assert read.counts == {
        "power tower: no height": 1,
        "height that is no length": 1,
        "outline that is not whole in the file": 1,
        "line: no outline": 1,
    }
    assert any("node 91: 'tall'" in note for note in read.notes)
    block = next(one for one in read.obstacles if one.name == "block")
    assert block.size_m[2] == pytest.approx(18.0, abs=0.02)


@pytest.mark.parametrize(
    ("name", "write"), [("N50E008.hgt", gis.write_hgt), ("n50.dt0", gis.write_dted)]
)
def test_tiles_of_terrain_lie_at_their_degree(name, write, tmp_path):
    write(tmp_path / name, NOBODY)
    area = (np.array([-500.0, -500.0]), np.array([500.0, 500.0]))
    read = read_maps([tmp_path / name], Geodetic(50.5, 8.5, 0.0), bounds_m=area)[0]
    assert "above sea level (EGM96)" in read.crs
    rows = 1201 if name.endswith("hgt") else 121
    heights = gis._heights(rows, 1201 if rows == 1201 else 61, np.random.default_rng(0))
    row, column = rows // 2, heights.shape[1] // 2
    there = float(np.nanmax(read.ground.height_m)) if read.ground is not None else np.nan
    around = heights[row - 12 : row + 13, column - 12 : column + 13]
    assert heights[row, column] - 0.1 <= there <= around.max()


def test_a_tile_with_another_name_or_size_is_refused(tmp_path):
    gis.write_hgt(tmp_path / "ground.hgt", NOBODY)
    with pytest.raises(InputError, match=r"valid: one such as N50E008\.hgt"):
        read_map(tmp_path / "ground.hgt")
    (tmp_path / "N50E008.hgt").write_bytes((tmp_path / "ground.hgt").read_bytes()[:-7])
    with pytest.raises(InputError, match="2,884,795 bytes: truncated"):
        read_map(tmp_path / "N50E008.hgt")
