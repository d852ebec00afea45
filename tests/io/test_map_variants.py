"""Maps as other programs write them, and what cannot be meant, which is refused."""

import copy
import json

import numpy as np
import pytest

pytest.importorskip("pyproj")
pytest.importorskip("shapely")
pytest.importorskip("rasterio")

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M, US_SURVEY_FOOT_M
from clearway.io.maps.maps import read_map, read_maps
from maps_for_tests import COLOGNE, collection, feature, saved, square, tops

# Tables


@pytest.mark.parametrize(
    "text",
    [
        "Latitude,Longitude,Height (ft),Radius (ft)\n50.9413,6.9583,100,10\n",
        "# of the survey\n\nlat;long;agl_ft;radius_ft\n50,9413;6,9583;100,0;10\n",
        "lat\tlon\theight [feet]\tradius\n50.9413\t6.9583\t100\t3.048\n",
        f"lat,lon,height_m,radius_m\n50.9413,6.9583,{100 * FOOT_M},{10 * FOOT_M}\n",
    ],
)
def test_units_and_separators_of_tables(tmp_path, text):
    (mast,) = read_map(saved(tmp_path, "a.csv", text), COLOGNE).obstacles
    assert mast.size_m == pytest.approx((20 * FOOT_M, 20 * FOOT_M, 100 * FOOT_M))
    assert mast.position_m[:2] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_a_table_without_units_says_what_is_assumed(tmp_path):
    notes = read_map(saved(tmp_path, "a.csv", "LAT,LON,AGL,AMSL\n50.9,6.9,100,160\n")).notes
    assert "no unit of heights in the file: metres assumed" in notes
    assert not any("cut off?" in note for note in notes)
    cut = read_map(saved(tmp_path, "b.csv", "lat,lon,h\n50,7,100\n50.1,7,10"))
    assert any("cut off?" in note for note in cut.notes)


def test_names_in_another_code_page(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes("lat,lon,h,name\n50.9,6.9,100,Köln\n".encode("cp1252"))
    assert read_map(path).obstacles[0].name == "Köln"


@pytest.mark.parametrize("radius", ["0", "-5"])
def test_a_radius_that_is_none(tmp_path, radius):
    path = saved(tmp_path, "a.csv", f"lat,lon,h,radius\n50,7,10,{radius}\n")
    with pytest.raises(InputError, match=r"a\.csv: line 2: radius .* is not above 0"):
        read_map(path)


DOF = (
    "OAS,VERIFIED STATUS,COUNTRY,STATE,CITY,LATDEC,LONDEC,TYPE,AGL,AMSL,ACCURACY,ACTION,JDATE\n"
    "01-001307,O,US,AL,ABBEVILLE,31.5,-85.25,TOWER,00299,00776,1A,C,2008158\n"
    "01-001308,O,US,AL,ABBEVILLE,31.6,-85.25,TOWER,00499,00976,9I,C,2008158\n"
    "01-001309,O,US,AL,ABBEVILLE,31.6,-85.25,TOWER,00499,00976,1A,D,2008158\n"
)


def test_the_faa_s_table_is_in_feet_and_grown_by_its_accuracy(tmp_path):
    read = read_map(saved(tmp_path, "DOF.CSV", DOF), point_radius_m=2.0)
    assert read.kind == "FAA digital obstacle file"
    assert read.counts == {"dismantled": 1}
    grown, other = read.obstacles
    assert grown.name == "01-001307 TOWER, ABBEVILLE"
    assert grown.size_m == pytest.approx((*[2 * (2 + 20 * FOOT_M)] * 2, 302 * FOOT_M))
    assert other.size_m == pytest.approx((4.0, 4.0, 499 * FOOT_M))
    assert any("1 records state no accuracy" in note for note in read.notes)
    for old, new, cause in (
        (",31.5,", ",91.5,", "line 2: latdec 91.5 is not within"),
        ("00299", "tall", "line 2: agl is no number: 'tall'"),
        (",1A,D,2008158\n", ",1A", "line 4: 11 of 13 columns: truncated"),
    ):
        with pytest.raises(InputError, match=cause):
            read_map(saved(tmp_path, "bad.csv", DOF.replace(old, new)))


def test_faa_records_of_other_countries_and_files_put_together(data_dir, tmp_path):
    path = data_dir / "maps/obstacles/faa_dof_5records_ASSEMBLED.dat"
    if not path.is_file():
        pytest.skip(f"needs data: {path.name}")
    lines = path.read_text().splitlines()
    head, records = lines[:4], lines[4:]
    abroad = [f"CA-{record[3:]}" for record in records]
    whole = "\n".join([*head, *records, *head, *abroad])
    assert len(read_map(path).obstacles) > 0
    read = read_map(saved(tmp_path, "two.dat", whole))
    assert {one.name[:2] for one in read.obstacles} > {"CA"}
    gone = records[0][:118] + "D" + records[0][119:]
    with pytest.raises(
        InputError, match=r"nothing to keep clear of in it \(left out: 1 dismantled"
    ):
        read_map(saved(tmp_path, "gone.dat", gone))


# CityJSON


def model(**changes):
    """A block of 10 x 20 x 6 m in the Dutch grid, in version 1.0: no transform."""
    corners = [[85_000.0 + x, 446_000.0 + y] for x, y in ((0, 0), (10, 0), (10, 20), (0, 20))]
    vertices = [[*one, 1.0] for one in corners] + [[*one, 7.0] for one in corners]
    faces = [[[0, 1, 2, 3]], [[4, 5, 6, 7]]]
    return {
        "type": "CityJSON",
        "version": "1.0",
        "metadata": {"referenceSystem": "urn:ogc:def:crs:EPSG::7415"},
        "CityObjects": {
            "house": {
                "type": "Building",
                "geometry": [{"type": "MultiSurface", "lod": 1, "boundaries": faces}],
            }
        },
        "vertices": vertices,
        **changes,
    }


def test_cityjson_of_version_1_0_and_of_2_0(tmp_path):
    old, new = (
        model(),
        model(version="2.0", transform={"scale": [0.001] * 3, "translate": [0.0] * 3}),
    )
    new["vertices"] = [[round(1000 * x) for x in one] for one in new["vertices"]]
    new["metadata"]["referenceSystem"] = "https://www.opengis.net/def/crs/EPSG/0/7415"
    read = [read_map(saved(tmp_path, "a.city.json", city)) for city in (old, new)]
    for one in read:
        assert one.obstacles[0].size_m == pytest.approx((20.0, 10.0, 6.0), rel=2e-3)
        assert one.origin.height_m == pytest.approx(1.0)


def test_heights_of_cityjson_in_feet(tmp_path):
    city = model(metadata={"referenceSystem": "EPSG:26918+6360"})
    (house,) = read_map(saved(tmp_path, "a.json", city)).obstacles
    assert house.size_m[2] == pytest.approx(6 * US_SURVEY_FOOT_M)


def test_cityjson_in_feet_across(tmp_path):
    """Of the same block in feet: the New York state plane, near its middle."""
    city = model(metadata={"referenceSystem": "EPSG:2263+6360"})
    city["vertices"] = [[x + 900_000.0, y - 250_000.0, z] for x, y, z in city["vertices"]]
    (house,) = read_map(saved(tmp_path, "a.json", city)).obstacles
    expected = np.array([20.0, 10.0, 6.0]) * US_SURVEY_FOOT_M
    assert house.size_m == pytest.approx(tuple(expected), rel=2e-3)
    city["metadata"]["referenceSystem"] = "EPSG:2263"
    read = read_map(saved(tmp_path, "a.json", city))
    assert any("US survey foot assumed" in note for note in read.notes)
    assert read.obstacles[0].size_m == pytest.approx(house.size_m)


@pytest.mark.parametrize("system", ["EPSG:4978", "EPSG:4979"])
def test_cityjson_of_no_plane(tmp_path, system):
    city = model(metadata={"referenceSystem": system})
    with pytest.raises(InputError, match=r"of no plane .*valid: a projected reference system"):
        read_map(saved(tmp_path, "a.json", city))


def test_points_lines_and_templates_are_counted(tmp_path):
    city = model()
    for name, kind, geometry, boundaries in (
        ("tree", "SolitaryVegetationObject", "GeometryInstance", [0]),
        ("rail", "Bridge", "MultiLineString", [[0, 1, 2]]),
        ("lamp", "CityFurniture", "MultiPoint", [0, 1]),
    ):
        part = {"type": geometry, "lod": 1, "boundaries": boundaries}
        city["CityObjects"][name] = {"type": kind, "geometry": [part]}
    read = read_map(saved(tmp_path, "a.json", city))
    assert len(read.obstacles) == 1
    assert read.counts == {
        "SolitaryVegetationObject: GeometryInstance instead of surfaces": 1,
        "Bridge: MultiLineString instead of surfaces": 1,
        "CityFurniture: MultiPoint instead of surfaces": 1,
    }


def test_a_sequence_is_the_model_that_it_comes_down_to(tmp_path):
    import json

    whole = model()
    whole["CityObjects"]["shed"] = copy.deepcopy(whole["CityObjects"]["house"])
    features = [
        {
            "type": "CityJSONFeature",
            "id": name,
            "CityObjects": {name: whole["CityObjects"][name]},
            "vertices": [[x + 30.0 * n, y, z] for x, y, z in whole["vertices"]],
        }
        for n, name in enumerate(("house", "shed"))
    ]
    lines = [json.dumps(one) for one in ({**whole, "CityObjects": {}, "vertices": []}, *features)]
    read = read_map(saved(tmp_path, "a.city.jsonl", "\n".join(lines) + "\n"))
    house, shed = read.obstacles
    assert np.linalg.norm(shed.position_m - house.position_m) == pytest.approx(30.0, rel=1e-3)
    with pytest.raises(InputError, match="line 3: no JSON object, truncated"):
        read_map(saved(tmp_path, "a.jsonl", "\n".join(lines)[:-20]))
    with pytest.raises(InputError, match=r"line 2: an object of type CityJSONFeature.*'Feature'"):
        read_map(saved(tmp_path, "a.jsonl", lines[0] + '\n{"type": "Feature"}\n'))
    features[1]["CityObjects"]["shed"]["geometry"][0]["boundaries"] = [[[0, 1, 8]]]
    lines[2] = json.dumps(features[1])
    with pytest.raises(InputError, match=r"shed: boundaries: vertex"):
        read_map(saved(tmp_path, "a.jsonl", "\n".join(lines) + "\n"))


# GeoJSON


def polygon(**properties):
    return feature({"type": "Polygon", "coordinates": square(50.9413, 6.9583)}, **properties)


@pytest.mark.parametrize(
    ("height", "metres"),
    [("40 ft", 40 * FOOT_M), ("40'6\"", 40.5 * FOOT_M), ("12.5m", 12.5), ("1e1", 10.0), (12, 12.0)],
)
def test_heights_of_geojson_with_a_unit(tmp_path, height, metres):
    read = read_map(saved(tmp_path, "a.geojson", polygon(height=height)), COLOGNE)
    assert tops(read.obstacles) == pytest.approx([metres], abs=0.002)


def test_features_one_a_line(tmp_path):
    import json

    lines = [json.dumps(polygon(height=height)) for height in (10, 20, -1, None)]
    read = read_map(saved(tmp_path, "a.geojsonl", "\n".join(lines) + "\n"), COLOGNE)
    assert tops(read.obstacles) == pytest.approx([10.0, 20.0], abs=0.002)
    assert read.counts == {"height not above its base": 1, "no height": 1}


def test_an_outline_across_the_date_line(tmp_path):
    ring = [[179.999, 10.0], [-179.999, 10.0], [-179.999, 10.001], [179.999, 10.001]]
    part = feature({"type": "Polygon", "coordinates": [[*ring, ring[0]]]}, height=5)
    read = read_map(saved(tmp_path, "a.geojson", part))
    assert abs(read.origin.longitude_deg) == pytest.approx(180.0)
    (box,) = read.obstacles
    assert sorted(box.size_m) == pytest.approx([5.0, 110.6, 219.2], rel=1e-3)


@pytest.mark.parametrize(
    ("changes", "properties", "cause"),
    [
        ({"crs": {"properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}}, {"height": 5},
         r"coordinates in urn:.*25832; valid: longitude and latitude of WGS 84"),
        ({}, {"height": "tall"}, r"properties\.height: 'tall' is no length; valid: a number"),
        ({}, {"height": "nan"}, r"'nan' is no length"),
        ({}, {"height": 1e12}, r"properties\.height: 1000000000000\.0 is out of range"),
        ({}, {"height": 5, "radius": -4}, r"features\[0\]: radius -4 m is below 0"),
    ],
)  # fmt: skip
def test_geojson_that_cannot_be_meant(tmp_path, changes, properties, cause):
    with pytest.raises(InputError, match=cause):
        read_map(saved(tmp_path, "a.geojson", collection(polygon(**properties)) | changes))


def test_geojson_that_names_the_system_it_has(tmp_path):
    for name in ("urn:ogc:def:crs:OGC:1.3:CRS84", "EPSG:4326"):
        crs = {"crs": {"type": "name", "properties": {"name": name}}}
        content = collection(polygon(height=5)) | crs
        assert read_map(saved(tmp_path, "a.geojson", content)).obstacles


# Zones


def test_ed269_as_the_swiss_publish_it_and_ed318_of_several_parts(tmp_path):
    across = {"type": "Circle", "center": [6.9583, 50.9413], "radius": 50}
    volume = {"uomDimensions": "FT", "lowerLimit": 0, "lowerVerticalReference": "AGL",
              "upperLimit": 400, "upperVerticalReference": "AGL",
              "horizontalProjection": across}  # fmt: skip
    zone = {"identifier": "X1", "name": None, "restriction": "PROHIBITED", "geometry": [volume]}
    old = read_map(saved(tmp_path, "a.json", {"title": "Zones", "features": [zone]}), COLOGNE)
    assert old.keep_out[0].limits == ("0 m above ground to 121.92 m above ground",)
    assert old.keep_out[0].name == "X1"
    assert any("radii are taken in metres" in note for note in old.notes)
    parts = {"type": "MultiPolygon", "coordinates": [square(50.94, 6.95), square(50.95, 6.95)],
             "layer": {"upper": 100, "lower": 0, "uom": "m"}}  # fmt: skip
    new = read_map(
        saved(tmp_path, "b.json", collection(feature(parts, type="PROHIBITED"))), COLOGNE
    )
    assert len(new.keep_out[0].obstacles) == 2


def test_a_map_with_nothing_in_it_needs_an_origin_or_another_map(tmp_path):
    parts = {"type": "Polygon", "coordinates": square(50.94, 6.95), "layer": {"upper": 100}}
    free = saved(tmp_path, "a.json", collection(feature(parts, type="NO_RESTRICTION")))
    with pytest.raises(InputError, match=r"left out: 1 zone without restriction.*valid: an origin"):
        read_map(free)
    assert read_map(free, COLOGNE).counts == {"zone without restriction": 1}
    city = saved(tmp_path, "b.geojson", polygon(height=5))
    assert read_maps([free, city])[0].origin.latitude_deg == pytest.approx(50.9413)


# Terrain


def raster(path, heights, *, crs="EPSG:25832", dtype="float32", count=1, units=None, scale=None):
    import rasterio

    profile = {"driver": "GTiff", "width": heights.shape[1], "height": heights.shape[0],
               "dtype": dtype, "crs": crs, "count": count,
               "transform": rasterio.Affine(25, 0, 350_000, 0, -25, 5_640_000)}  # fmt: skip
    with rasterio.open(path, "w", **profile) as file:
        for band in range(1, count + 1):
            file.write(heights.astype(dtype), band)
        if units is not None:
            file.units = [units]
        if scale is not None:
            file.scales, file.offsets = [scale[0]], [scale[1]]
    return path


HILL = np.add.outer(np.arange(8.0), np.arange(9.0)) + 100.0


@pytest.mark.parametrize(
    ("options", "metres"),
    [
        ({}, 1.0),
        ({"units": "ft"}, FOOT_M),
        ({"units": "US survey foot"}, US_SURVEY_FOOT_M),
        ({"crs": "EPSG:26918+6360"}, US_SURVEY_FOOT_M),
        ({"crs": "EPSG:2263"}, US_SURVEY_FOOT_M),
        ({"crs": "EPSG:2263", "units": "m"}, 1.0),
        ({"scale": (0.1, 50.0), "dtype": "int16"}, 1.0),
    ],
)
def test_terrain_in_any_unit_is_in_metres(tmp_path, options, metres):
    stored = (HILL - 50.0) * 10.0 if "scale" in options else HILL
    read = read_map(raster(tmp_path / "a.tif", stored, **options))
    assert read.origin.height_m == pytest.approx(100.0 * metres)
    assumed = any("no unit of heights" in note for note in read.notes)
    assert assumed == (options == {"crs": "EPSG:2263"})


@pytest.mark.parametrize("void", [-9999.0, -32768.0, 3.4e38, np.nan])
def test_terrain_whose_gaps_are_not_declared(tmp_path, void):
    read = read_map(raster(tmp_path / "a.tif", np.where(HILL < 102.0, void, HILL)))
    assert sum(read.counts.values()) == 3
    assert read.origin.height_m == pytest.approx(102.0)
    assert tops(read.floor).max() < 20.0


@pytest.mark.parametrize(
    ("options", "cause"),
    [
        ({"count": 3, "dtype": "uint8"}, "3 bands: a picture"),
        ({"units": "fathom"}, "unit of heights 'fathom'; valid: m, metre"),
    ],
)
def test_rasters_that_are_no_terrain(tmp_path, options, cause):
    with pytest.raises(InputError, match=cause):
        read_map(raster(tmp_path / "a.tif", HILL, **options))


@pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")
def test_a_raster_with_a_system_but_no_place_in_it(tmp_path):
    import rasterio

    profile = {"driver": "GTiff", "width": 9, "height": 8, "dtype": "float32",
               "crs": "EPSG:25832", "count": 1}  # fmt: skip
    with rasterio.open(tmp_path / "a.tif", "w", **profile) as file:
        file.write(HILL.astype("float32"), 1)
    with pytest.raises(InputError, match=r"transform \(1\.0, 0\.0, 0\.0"):
        read_map(tmp_path / "a.tif")


def test_a_raster_larger_than_memory_is_refused_unread(tmp_path):
    import rasterio

    profile = {"driver": "GTiff", "width": 100_000, "height": 100_000, "dtype": "float32",
               "crs": "EPSG:25832", "count": 1, "transform": rasterio.Affine(2, 0, 9, 0, -2, 9),
               "sparse_ok": True, "tiled": True, "BIGTIFF": "YES"}  # fmt: skip
    with rasterio.open(tmp_path / "a.tif", "w", **profile):
        pass
    with pytest.raises(InputError, match=r"100000 x 100000 samples; at most 20,000,000"):
        read_map(tmp_path / "a.tif")


def test_a_reference_system_that_no_file_needs_is_said_not_to_be_used(tmp_path):
    path = tmp_path / "mast.geojson"
    feature = {
        "type": "Feature",
        "properties": {"height": 20},
        "geometry": {"type": "Point", "coordinates": [8, 50]},
    }
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    (plain,) = read_maps([path])
    (given,) = read_maps([path], crs="EPSG:25832")
    assert [note for note in given.notes if note not in plain.notes] == [
        "EPSG:25832 is not used: the file, or its format, states a reference system itself"
    ]
