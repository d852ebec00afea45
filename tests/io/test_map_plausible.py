"""No format gets an impossible place or height into a map, and an empty map is loud."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from clearway.base.errors import InputError
from clearway.cli.app import app
from clearway.io.maps.map_features import Disc, Height, MapFeature
from clearway.io.maps.maps import NOTHING_LEFT, read_maps
from clearway.io.maps.obstacle_table import read_obstacle_table
from clearway.io.maps.plausible import feature_problem

FAA_TABLE = "OAS,VERIFIED STATUS,COUNTRY,STATE,CITY,LATDEC,LONDEC,TYPE,QUANTITY,AGL,LIGHTING,"
FAA_TABLE += "ACCURACY,MARKING,AMSL,ACTION\n"
ROW = "01-00130{n},O,US,AL,OPP,31.5,-86.2,TOWER,1,{agl},R,1A,N,{amsl},A\n"
GOOD = ROW.format(n=1, agl="00300", amsl="00500")
BAD = ("-inf", "inf", "nan", "-9999", "1e9")


@pytest.mark.parametrize("height", BAD)
@pytest.mark.parametrize("field", ["agl", "amsl"])
def test_one_impossible_record_of_the_faa_is_named(tmp_path: Path, field: str, height: str) -> None:
    path = tmp_path / "DOF.CSV"
    row = ROW.format(n=2, **({"agl": "00300", "amsl": "00500"} | {field: height}))
    path.write_text(FAA_TABLE + GOOD + row)
    with pytest.raises(InputError, match="line 3: "):
        read_maps([path])


@pytest.mark.parametrize("height", ["-inf", "nan", "-9999", "99999999"])
@pytest.mark.parametrize("format_", ["geojson", "table"])
def test_other_formats_hold_the_same_limits(tmp_path: Path, format_: str, height: str) -> None:
    if format_ == "table":
        path = tmp_path / "obstacles.csv"
        path.write_text(f"name,latitude,longitude,top_m,height_m\nmast,50,7,{height},20\n")
    else:
        path = tmp_path / "obstacles.geojson"
        token = {"-inf": "-Infinity", "nan": "NaN"}.get(height, height)
        path.write_text(
            '{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": '
            f'{{"name": "mast", "height": {token}, "elevation": {token}}}, "geometry": '
            '{"type": "Point", "coordinates": [7, 50]}}]}'
        )
    with pytest.raises(InputError, match=path.name):
        read_maps([path])


@pytest.mark.parametrize(
    ("outline", "low_m", "high_m", "said"),
    [
        (Disc(50.0, 7.0, 20.0), 0.0, 100.0, None),
        (Disc(50.0, 7.0, 20.0), 0.0, 20_000.0, None),
        (Disc(50.0, 7.0, 20.0), float("-inf"), 100.0, "foot -inf m"),
        (Disc(50.0, 7.0, 20.0), 0.0, float("nan"), "top nan m"),
        (Disc(50.0, 7.0, 20.0), -3109.0, 100.0, "foot -3109 m"),
        (Disc(50.0, 7.0, float("inf")), 0.0, 100.0, "radius inf m"),
        (Disc(50.0, 7.0, -1.0), 0.0, 100.0, "radius -1 m"),
        (Disc(float("nan"), 7.0, 20.0), 0.0, 100.0, "latitude nan"),
        (Disc(50.0, 361.0, 20.0), 0.0, 100.0, "longitude 361"),
    ],
)
def test_the_limits(outline: Disc, low_m: float, high_m: float, said: str | None) -> None:
    feature = MapFeature("mast", outline, Height(low_m, "sea level"), Height(high_m, "sea level"))
    problem = feature_problem(feature)
    assert problem is None if said is None else problem is not None and problem.startswith(said)


def test_what_would_hang_above_all_ground_is_refused(tmp_path: Path) -> None:
    """One wrong digit must not lift an obstacle out of the way of who flies into it."""
    faa = tmp_path / "DOF.CSV"
    faa.write_text(FAA_TABLE + GOOD + ROW.format(n=2, agl="00240", amsl="99999"))
    with pytest.raises(InputError, match=r"line 3: foot .* higher than any ground"):
        read_maps([faa])
    outline = tmp_path / "obstacles.geojson"
    outline.write_text(
        '{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": '
        '{"name": "mast", "top_m": 90000, "ground_m": 89950}, "geometry": '
        '{"type": "Point", "coordinates": [7, 50]}}]}'
    )
    with pytest.raises(InputError, match=r"mast: foot 89950 m .* higher than any ground"):
        read_maps([outline])


def test_zones_of_the_air_may_begin_above_all_ground() -> None:
    high = (Height(15_000.0, "sea level"), Height(20_000.0, "sea level"))
    zone = MapFeature("upper space", Disc(50.0, 7.0, 20.0), *high)
    assert feature_problem(zone) is not None
    assert feature_problem(zone, stands=False) is None


@pytest.mark.parametrize(
    ("top", "ground", "low_m", "high_m", "told"),
    [
        ("161.6", "45.6", 45.6, 161.6, False),
        ("8161.6", "45.6", 45.6, 8161.6, True),
        ("161.6", "845.6", 45.6, 961.6, True),
    ],
)
def test_heights_that_contradict_each_other_are_all_taken(
    tmp_path: Path, top: str, ground: str, low_m: float, high_m: float, told: bool
) -> None:
    path = tmp_path / "obstacles.csv"
    path.write_text(f"name,lat,lon,h,z,gnd_elev\nmast,50,7,116.0,{top},{ground}\n")
    parsed = read_obstacle_table(path, 10.0)
    (mast,) = parsed.features
    assert mast.low.value_m == pytest.approx(low_m)
    assert mast.high.value_m == pytest.approx(high_m)
    assert any("lines 2: top, height and ground" in note for note in parsed.notes) is told


def test_a_map_of_which_nothing_is_left_is_a_loud_warning(tmp_path: Path) -> None:
    path = tmp_path / "DOF.CSV"
    path.write_text(FAA_TABLE + GOOD)
    told = CliRunner().invoke(
        app, ["map", str(path), "--origin", "10.0,10.0,0", "--json", "--no-plots"]
    )
    assert told.exit_code == 0, told.output
    assert NOTHING_LEFT in told.stderr
    (file,) = json.loads(told.stdout)["files"]
    assert file["obstacles"] == 0
    assert any(note.startswith(NOTHING_LEFT) for note in file["notes"])


def test_a_flight_without_anything_of_its_map_says_so(tmp_path: Path) -> None:
    (tmp_path / "DOF.CSV").write_text(FAA_TABLE + GOOD)
    mission = tmp_path / "far.toml"
    mission.write_text(
        '[mission]\nname = "far"\nwaypoints_m = [[4, 0, 0]]\norigin_geodetic = [10.0, 10.0, 0.0]\n'
        '[map]\nfiles = ["DOF.CSV"]\n'
    )
    line = ["fly", str(mission), "--no-plots", "--json", "--out", str(tmp_path / "out")]
    told = CliRunner().invoke(app, line)
    assert told.exit_code == 0, told.output
    assert NOTHING_LEFT in told.stderr
    assert any(NOTHING_LEFT in note for note in json.loads(told.stdout)["notes"])
