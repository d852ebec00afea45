"""Map files: real ones against what is known of them, made ones against what was put in."""

from collections import Counter

import numpy as np
import pytest

pytest.importorskip("pyproj")
pytest.importorskip("shapely")
pytest.importorskip("rasterio")

from clearway.base.errors import InputError
from clearway.base.frames import enu_from_geodetic
from clearway.io.maps.map_features import Geodetic
from clearway.io.maps.maps import read_map, read_maps
from clearway.obstacles.obstacle_map import ObstacleMap
from maps_for_tests import COLOGNE, collection, feature, real, saved, square, tops

# Obstacle table


def test_the_masts_of_cologne_stand_where_the_table_has_them(data_dir):
    read = read_map(real(data_dir, "obstacles/LAC_obstacles_v1.csv"), COLOGNE)
    assert len(read.obstacles) == 73
    heights = np.array([one.size_m[2] for one in read.obstacles])
    assert (heights.min(), heights.max()) == pytest.approx((60.2, 264.3), abs=0.05)
    by_name = {one.name: one for one in read.obstacles}
    tower = by_name["Colonia Haus"]
    expected = enu_from_geodetic([50.96059554, 6.981995577, 184.27], COLOGNE)
    assert tower.position_m[:2] == pytest.approx(expected[:2], abs=0.2)
    assert tops([tower])[0] == pytest.approx(184.27 - 50.0, abs=1.0)  # less Earth's curvature
    assert any("20 m assumed" in note for note in read.notes)


def test_what_lies_outside_the_area_is_left_out_and_counted(data_dir):
    path = real(data_dir, "obstacles/LAC_obstacles_v1.csv")
    bounds = (np.array([-500.0, -500.0]), np.array([500.0, 500.0]))
    (read,) = read_maps([path], COLOGNE, bounds_m=bounds)
    assert 0 < len(read.obstacles) < 20
    assert len(read.obstacles) + read.counts["outside the area"] == 73


def test_a_table_may_tell_radius_and_height_above_ground_only(tmp_path):
    path = saved(tmp_path, "a.csv", "lat;lon;height;radius;name\n50.9413;6.9583;30;2;mast\n")
    (mast,) = read_map(path, COLOGNE).obstacles
    assert mast.size_m == pytest.approx((4.0, 4.0, 30.0))
    assert mast.position_m == pytest.approx([0.0, 0.0, 15.0], abs=1e-6)


@pytest.mark.parametrize(
    ("text", "place", "cause"),
    [
        ("lat,lon,h\n50,7,x\n95,7,10\n50,7,-3\n50,7\n", "line 2: height", "'x'"),
        ("lat,lon,h\n50,7,x\n95,7,10\n50,7,-3\n50,7\n", "line 3: latitude", "90"),
        ("lat,lon,h\n50,7,x\n95,7,10\n50,7,-3\n50,7\n", "line 4: height", "above 0"),
        ("lat,lon,h\n50,7,x\n95,7,10\n50,7,-3\n50,7\n", "line 5: 2 of 3 columns", "truncated"),
        ("lat,lon,h\n50,7,nan\n", "line 2: height", "out of range"),
        ("lon,h\n7,10\n", "line 1: no column for latitude", "lat or latitude"),
        ("lat,lon,h\n", "no obstacle", "place"),
    ],
)
def test_bad_tables_name_line_and_cause(tmp_path, text, place, cause):
    with pytest.raises(InputError) as refused:
        read_map(saved(tmp_path, "bad.csv", text))
    lines = [line for line in str(refused.value).splitlines() if place in line]
    assert lines
    assert cause in lines[0]


# FAA digital obstacle file


def test_faa_records_have_the_accuracy_that_they_state(data_dir):
    path = real(data_dir, "obstacles/faa_dof_5records_ASSEMBLED.dat")
    place = [52 + 43 / 60 + 15.7 / 3600, 174 + 6 / 60 + 36.6 / 3600, 60.0]  # east, unlike the rest
    read = read_map(path, Geodetic(52.7, 174.1, 0.0))
    assert {one.name for one in read.obstacles} == {"02-292529 TANK, EARECKSON AIR ST"}
    assert read.counts == {"farther than 100 km from the origin": 4}
    # 187 ft above the sea and 50 ft of accuracy, from 174 ft up.
    assert read.obstacles[0].size_m[2] == pytest.approx((237 - 174) * 0.3048)
    assert tops(read.obstacles).max() == pytest.approx(237 * 0.3048, abs=0.5)
    # Horizontal accuracy 4: 250 ft, besides the 20 m of the tank itself.
    middle = enu_from_geodetic(place, read.origin)
    angles = np.linspace(0, 2 * np.pi, 40)
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)
    around = ObstacleMap(read.obstacles)
    assert around.distance_m(middle + (250 * 0.3048 + 19.9) * ring).max() <= 0.0
    assert around.distance_m(middle + 1.4 * (250 * 0.3048 + 20.0) * ring).min() > 0.0


def test_dismantled_obstacles_are_left_out(data_dir, tmp_path):
    path = real(data_dir, "obstacles/faa_dof_5records_ASSEMBLED.dat")
    lines = path.read_text().splitlines()
    lines[4] = lines[4][:118] + "D" + lines[4][119:]
    read = read_map(saved(tmp_path, "dof.dat", "\n".join(lines)))
    assert read.counts["dismantled"] == 1


@pytest.mark.parametrize(
    ("start", "end", "text", "cause"),
    [
        (35, 37, "xx", "latitude is no number"),
        (46, 47, "Q", "hemisphere 'Q'"),
        (83, 88, "     ", "height above ground is no number"),
        (100, None, "", "of 128 columns: truncated?"),
        (5, None, "", "of 128 columns: truncated?"),
    ],
)
def test_bad_faa_records_name_line_and_cause(data_dir, tmp_path, start, end, text, cause):
    lines = real(data_dir, "obstacles/faa_dof_5records_ASSEMBLED.dat").read_text().splitlines()
    last = lines[8]
    lines[8] = last[:start] + text + (last[end:] if end else "")
    with pytest.raises(InputError, match="line 9") as refused:
        read_map(saved(tmp_path, "bad.dat", "\n".join(lines)))
    assert cause in str(refused.value)


# GeoJSON


def test_geojson_outlines_points_and_what_has_no_height(tmp_path):
    path = saved(
        tmp_path,
        "a.geojson",
        collection(
            feature(
                {"type": "Polygon", "coordinates": square(50.9413, 6.9583)}, height=25, name="hall"
            ),
            feature({"type": "Point", "coordinates": [6.96, 50.9413]}, top_m=110.0, radius_m=3),
            feature({"type": "Point", "coordinates": [6.96, 50.9413]}),
            feature({"type": "LineString", "coordinates": [[6.9, 50.9], [7.0, 50.9]]}, height=8),
        ),
    )
    read = read_map(path, COLOGNE)
    hall, mast = read.obstacles
    assert hall.name == "hall"
    assert sorted(hall.size_m) == pytest.approx([25.0, 140.6, 222.5], abs=0.5)
    assert hall.position_m[2] == pytest.approx(12.5, abs=0.01)
    assert mast.size_m == pytest.approx((6.0, 6.0, 60.0), abs=0.01)
    assert read.counts == {"no height": 1, "LineString: no outline": 1}
    assert any("origin's height" in note for note in read.notes)


def test_bad_geojson_names_the_feature(tmp_path):
    path = saved(
        tmp_path,
        "bad.geojson",
        collection(
            feature({"type": "Polygon", "coordinates": [[[7, 50], [7, 51]]]}, height=5),
            feature({"type": "Point", "coordinates": [200, 50]}, height=5),
            feature({"type": "Point", "coordinates": [7, 50]}, height="tall"),
        ),
    )
    with pytest.raises(InputError) as refused:
        read_map(path)
    text = str(refused.value)
    assert "features[0]: ring 0: 2 corners" in text
    assert "features[1]: longitude 200" in text
    assert "features[2]: properties.height: 'tall'" in text


# Terrain


def test_the_floor_is_never_below_the_terrain(data_dir):
    import rasterio

    path = real(data_dir, "obstacles/Cologne_DEM_merged_from_LAS_25x25.tif")
    bounds = (np.array([-800.0, -800.0]), np.array([800.0, 800.0]))
    (read,) = read_maps([path], COLOGNE, bounds_m=bounds)
    assert 100 < len(read.floor) <= 4000
    assert read.obstacles == ()
    rng = np.random.default_rng(1)
    places = COLOGNE[:2] + rng.uniform(-0.006, 0.006, (500, 2))
    with rasterio.open(path) as raster:
        from pyproj import Transformer

        x, y = Transformer.from_crs(4326, raster.crs.to_wkt(), always_xy=True).transform(
            places[:, 1], places[:, 0]
        )
        ground = np.array([value[0] for value in raster.sample(zip(x, y, strict=True))])
    surface = enu_from_geodetic(np.column_stack([places, ground]), COLOGNE)
    floor = ObstacleMap(read.floor)
    assert floor.distance_m(surface).max() <= 0.01
    assert np.median(floor.distance_m(surface + np.array([0, 0, 8.0]))) > 2.0


def test_heights_above_ground_are_above_the_terrain(data_dir, tmp_path):
    table = saved(tmp_path, "a.csv", "lat,lon,height\n50.9413,6.9583,30\n")
    raster = real(data_dir, "obstacles/Cologne_DEM_merged_from_LAS_25x25.tif")
    bounds = (np.array([-100.0, -100.0]), np.array([100.0, 100.0]))
    masts, _ = read_maps([table, raster], Geodetic(50.9413, 6.9583, 0.0), bounds_m=bounds)
    (mast,) = masts.obstacles
    assert 40.0 < mast.position_m[2] - mast.half_m[2] < 60.0
    assert tops([mast])[0] > 30.0 + 45.0
    assert not any("origin's height" in note for note in masts.notes)


# Files that are none


@pytest.mark.parametrize(
    "name",
    [
        "obstacles/LAC_obstacles_v1.csv",
        "obstacles/faa_dof_5records_ASSEMBLED.dat",
        "cityjson/delft.city.json",
        "geozones/cis_source_sample_ed318.json",
        "geozones/cis_source_sample_ed269.json",
        "obstacles/Cologne_DEM_merged_from_LAS_25x25.tif",
    ],
)
@pytest.mark.parametrize("share", [0.0, 0.3, 0.97])
def test_truncated_files_are_refused(data_dir, tmp_path, name, share):
    whole = real(data_dir, name)
    content = whole.read_bytes()
    path = tmp_path / whole.name
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(InputError) as refused:
        read_map(path)
    text = str(refused.value)
    assert text.startswith(str(path))
    assert any(word in text for word in ("truncated", "empty", "line", "no record"))


@pytest.mark.parametrize(
    ("name", "text", "cause"),
    [
        ("a.map", "x", "valid suffixes: .csv, .tsv, .dat, .json"),
        ("a.json", "[1]", "a JSON object is needed"),
        ("a.json", '{"type": "Topology"}', "no known map format"),
        ("a.json", '{"type": "CityJSON", "vertices": [[NaN, 0, 0]]}', "NaN is no number"),
        ("a.json", '{"type": \n "City', "line 2 column"),
        ("a.tif", "no raster", "no raster"),
        ("a.dat", "not a record of anything", "no record of a digital obstacle file"),
    ],
)
def test_files_of_other_formats_are_refused(tmp_path, name, text, cause):
    with pytest.raises(InputError) as refused:
        read_map(saved(tmp_path, name, text))
    assert cause in str(refused.value)


def test_an_absent_file_and_a_folder_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read: No such file"):
        read_map(tmp_path / "none.csv")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        read_map(tmp_path / "folder.csv")


def test_names_are_those_of_the_files(data_dir):
    read = read_map(real(data_dir, "obstacles/LAC_obstacles_v1.csv"))
    assert Counter(one.name for one in read.obstacles)["Koelner Dom"] == 1
