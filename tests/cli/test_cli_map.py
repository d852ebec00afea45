"""`clearway map` through its real entry point."""

import json

import pytest

from in_process import clearway as run_here
from own_process import run_clearway as run

pytest.importorskip("pyproj")
pytest.importorskip("shapely")

TABLE = "name,lat,lon,height,top\nchimney,50.94,6.96,80,130\nmast,50.941,6.961,60,112\n"


def test_a_map_is_summarised_and_drawn(tmp_path):
    (tmp_path / "masts.csv").write_text(TABLE)
    done = run("map", "masts.csv", "--radius", 5, "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "obstacles   2" in done.stdout
    assert "60.0 to 80.0 m from foot to top" in done.stdout
    assert "5 m assumed" in done.stdout
    picture = (tmp_path / "out" / "map.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert len(picture) > 20_000


def test_json_tells_the_same(tmp_path):
    (tmp_path / "masts.csv").write_text(TABLE)
    origin = "50.94,6.96,50"
    done = run_here("map", "masts.csv", "--json", "--no-plots", "--origin", origin, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["origin"] == {"latitude_deg": 50.94, "longitude_deg": 6.96, "height_m": 50.0}
    assert result["obstacles"] == 2
    (file,) = result["files"]
    assert file["height_m"] == {"min": 60.0, "max": 80.0}
    assert file["extent_m"]["z"] == pytest.approx([0.0, 80.0], abs=2.1)
    assert not (tmp_path / "clearway-out").exists()


def test_the_real_files_of_cologne_in_one_frame(tmp_path, data_dir):
    pytest.importorskip("rasterio")
    folder = data_dir / "maps" / "obstacles"
    files = [
        folder / "LAC_obstacles_v1.csv",
        folder / "Cologne_DEM_merged_from_LAS_25x25.tif",
    ]
    if not all(file.is_file() for file in files):
        pytest.skip("needs data: masts and terrain of Cologne")
    done = run_here("map", *files, "--json", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    masts, terrain = json.loads(done.stdout)["files"]
    assert (masts["obstacles"], masts["floor_blocks"]) == (73, 0)
    assert terrain["obstacles"] == 0
    assert terrain["floor_blocks"] > 100
    # Feet of the masts stand on the floor.
    assert masts["extent_m"]["z"][0] < terrain["extent_m"]["z"][1]


@pytest.mark.parametrize(
    ("arguments", "cause"),
    [
        (["none.csv"], "none.csv: cannot be read"),
        (["bad.csv"], "bad.csv: line 2: latitude"),
        (["masts.csv", "--origin", "here"], "--origin: latitude,longitude,height are needed"),
        (["masts.csv", "--radius", "1e8"], "'--radius'"),
        (["masts.csv", "--at", "noon"], "--at: 'noon' is no date and time"),
    ],
)
def test_bad_input_ends_with_2_and_one_line(tmp_path, arguments, cause):
    (tmp_path / "masts.csv").write_text(TABLE)
    (tmp_path / "bad.csv").write_text("lat,lon,h\nnorth,7,3\n")
    done = run_here("map", *arguments, "--out", "out", cwd=tmp_path)
    assert done.returncode == 2
    assert cause in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


def test_all_files_that_are_not_there_are_told_at_once(tmp_path):
    (tmp_path / "masts.csv").write_text(TABLE)
    done = run_here("map", "masts.csv", "nofile.csv", "none2.tif", "--no-plots", cwd=tmp_path)
    assert done.returncode == 2
    first, second = done.stderr.splitlines()
    assert first.startswith("nofile.csv: cannot be read: No such file")
    assert second.startswith("none2.tif: cannot be read: No such file")


@pytest.mark.parametrize(
    ("package", "file"), [("shapely", "hall.geojson"), ("rasterio", "terrain.tif")]
)
def test_an_absent_package_is_told_by_its_extra(tmp_path, package, file):
    ring = [[6.96, 50.94], [6.961, 50.94], [6.961, 50.941], [6.96, 50.94]]
    hall = {
        "geometry": {"type": "Polygon", "coordinates": [ring]},
        "properties": {"height": 9},
    }
    (tmp_path / "hall.geojson").write_text(
        json.dumps({"type": "FeatureCollection", "features": [hall]})
    )
    (tmp_path / "terrain.tif").write_bytes(b"II*\0 anything")
    done = run("map", file, cwd=tmp_path, absent=package)
    assert done.returncode == 2
    assert "pip install 'clearway[map]'" in done.stderr
    assert "Traceback" not in done.stderr
