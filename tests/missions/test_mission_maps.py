"""Maps in missions: what is there, what is known, what is kept out of; the examples, flown."""

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pyproj")
pytest.importorskip("shapely")

from clearway.base.errors import ClearwayError, InputError
from clearway.io.maps.maps import read_maps
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from in_process import clearway, flown_in
from repository import REPOSITORY

MISSIONS = REPOSITORY / "examples" / "missions"
DATA = "../../../shared/data/"

MISSION = """
[mission]
name = "past-a-mast"
origin_geodetic = [50.94, 6.96, 50]
waypoints_m = [[60, 0, 20]]

[vehicle]
position_m = [0, 0, 20]
speed_mps = 2

[grid]
range_m = 20

[map]
files = ["masts.csv", "zone.json"]
"""
# 30 m east of the origin, 40 m high, and a second one 3 km away.
MASTS = "name,lat,lon,height,radius\nmast,50.94,6.960427,40,2\nfar,50.97,6.96,40,2\n"


def zone(north_deg, hours):
    """A zone of 14 x 22 m to the north or the south, in force at some hours."""
    south, north = sorted([50.94 + 0.00005 * np.sign(north_deg), 50.94 + north_deg])
    ring = [[6.9603, south], [6.9605, south], [6.9605, north], [6.9603, north]]
    return {
        "type": "FeatureCollection",
        "features": [
            {
                "type": "Feature",
                "geometry": {
                    "type": "Polygon",
                    "coordinates": [ring],
                    "layer": {
                        "lower": 0,
                        "lowerReference": "AMSL",
                        "upper": 500,
                        "upperReference": "AMSL",
                        "uom": "m",
                    },
                },
                "properties": {
                    "identifier": "Z",
                    "type": "PROHIBITED",
                    "limitedApplicability": [{"schedule": [hours]}],
                },
            }
        ],
    }


def saved(tmp_path, text=MISSION, north_deg=0.0003):
    (tmp_path / "masts.csv").write_text(MASTS)
    hours = {"startTime": "08:00Z", "endTime": "18:00Z"}
    (tmp_path / "zone.json").write_text(json.dumps(zone(north_deg, hours)))
    path = tmp_path / "mission.toml"
    path.write_text(text)
    return read_mission_file(str(path))


def names(world):
    return sorted({one.name for one in world.obstacles})


def test_the_map_is_there_and_known_and_zones_are_known_only(tmp_path):
    setup = prepare(saved(tmp_path))
    assert names(setup.world) == ["mast"]
    assert names(setup.obstacle_map) == ["Z", "mast"]
    said = "\n".join(setup.notes)
    assert "1 left out: outside the area" in said
    assert "1 obstacles, 0 blocks of ground, 0 zones" in said


@pytest.mark.parametrize(
    ("keys", "there", "charted"),
    [
        ('known = "map"', [], ["Z", "mast"]),
        ('known = "world"', ["mast"], ["Z"]),
        ("keep_out = false", ["mast"], ["mast"]),
        ('at = "2025-06-02T12:00Z"', ["mast"], ["Z", "mast"]),
        ('at = "2025-06-02T20:00Z"', ["mast"], ["mast"]),
    ],
)
def test_keys_of_the_map_table(tmp_path, keys, there, charted):
    setup = prepare(saved(tmp_path, MISSION + keys))
    assert names(setup.world) == there
    assert names(setup.obstacle_map) == charted


@pytest.mark.parametrize("north_deg", [0.0003, -0.0003])
def test_a_flight_keeps_clear_of_the_mast_on_the_side_without_the_zone(tmp_path, north_deg):
    setup = prepare(saved(tmp_path, north_deg=north_deg))
    run = setup.fly()
    assert run.reached
    assert run.metrics.min_obstacle_distance_m >= 0.6
    zones = [one for one in setup.obstacle_map.obstacles if one.name == "Z"]
    from clearway.obstacles.obstacle_map import ObstacleMap

    assert ObstacleMap(zones).distance_m(run.states[:, :3]).min() >= 0.55
    beside = run.states[np.argmin(np.abs(run.states[:, 0] - 30.0)), 1]
    assert np.sign(beside) == -np.sign(north_deg)


def test_without_an_origin_it_is_in_the_middle_of_the_first_file_and_said(tmp_path):
    text = MISSION.replace("origin_geodetic = [50.94, 6.96, 50]\n", "")
    setup = prepare(saved(tmp_path, text))
    assert "the origin is in the middle of the first map file, at 50.955" in "\n".join(setup.notes)


def test_the_effective_mission_finds_its_maps_from_anywhere(tmp_path):
    files = saved(tmp_path).effective()["map"]["files"]
    assert [Path(file).is_absolute() and Path(file).is_file() for file in files] == [True, True]


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (('"masts.csv"', '"none.csv"'), "none.csv: cannot be read"),
        (('"zone.json"]', '"zone.json"]\nat = "noon"'), "map.at: 'noon' is no date"),
        (('"zone.json"]', '"zone.json"]\nradius = 3'), "map.radius: unknown key"),
        (("[[60, 0, 20]]", "[[30, 0, 20]]"), "waypoint 1 at (30, 0, 20) lies"),
    ],
)
def test_bad_maps_of_missions_are_refused(tmp_path, change, cause):
    with pytest.raises(ValueError, match=r".") as refused:
        prepare(saved(tmp_path, MISSION.replace(*change))).refuse_impossible()
    assert cause in str(refused.value)


def test_what_points_stand_for_blames_its_key_and_no_line_of_a_map(tmp_path):
    saved(tmp_path)
    (tmp_path / "m.toml").write_text(MISSION + "point_radius_m = 1e8\n")
    done = clearway("fly", "m.toml", "--no-plots", "--no-mcap", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == (
        "m.toml: map.point_radius_m: should be less than or equal to 100000, got 100000000.0\n"
    )
    for radius_m in (0.0, -1.0, 1e8, float("nan"), "wide"):
        with pytest.raises(ClearwayError, match=r"^point_radius_m: must be .*, got "):
            read_maps([tmp_path / "masts.csv"], point_radius_m=radius_m)


def test_input_errors_are_what_the_command_line_reports(tmp_path):
    with pytest.raises(InputError):
        prepare(saved(tmp_path, MISSION.replace('"masts.csv"', '"none.csv"')))


def test_all_files_that_are_not_there_are_told_at_once(tmp_path):
    text = MISSION.replace("masts.csv", "none.csv").replace("zone.json", "none.json")
    text += '[traffic]\nrecording = "none.jsonl"\n[point_cloud]\nfile = "none.las"\n'
    (tmp_path / "m.toml").write_text(text + "point_radius_m = 1\n")
    done = clearway("fly", "m.toml", "--no-plots", "--no-mcap", cwd=tmp_path)
    assert done.returncode == 2
    for name in ("none.csv", "none.json", "none.jsonl", "none.las"):
        assert f"{name}: cannot be read: No such file" in done.stderr


# The examples, flown by the command


def placed(name, data_dir, folder):
    """An example as mission.toml in a folder, wherever that of the data is."""
    mission = read_mission_file(str(MISSIONS / f"{name}.toml"))
    text = (MISSIONS / f"{name}.toml").read_text()
    files = [line.split('"')[1] for line in text.splitlines() if f'"{DATA}' in line]
    assert len(files) == len(mission.map.files)
    for file in files:
        if not (data_dir / file.removeprefix(DATA)).is_file():
            pytest.skip(f"needs data: {Path(file).name}")
    (folder / "mission.toml").write_text(text.replace(DATA, f"{data_dir}/"))
    return mission


def flown(name, data_dir, folder):
    """JSON, positions [n, 3] and setup of an example."""
    mission = placed(name, data_dir, folder)
    result, track = flown_in(folder)
    assert result["mission"] == name
    assert result["waypoints_reached"] == len(mission.mission.waypoints_m)
    assert result["safety_margin_m"] == mission.safety.margin_m
    assert result["min_obstacle_distance_m"] >= mission.safety.margin_m
    assert result["margin_violations"] == result["emergencies"] == 0
    return result, track, prepare(read_mission_file(str(folder / "mission.toml")))


@pytest.mark.nightly
def test_the_first_seconds_over_delft_keep_the_margin(data_dir, tmp_path):
    placed("delft-streets", data_dir, tmp_path)
    mission = read_mission_file(str(tmp_path / "mission.toml"))
    setup = prepare(mission.with_values("simulation", time_limit_s=8.0))
    run = setup.fly()
    assert run.metrics.time_s == 8.0
    assert run.metrics.margin_violations == run.emergencies == 0
    assert setup.obstacle_map.nearest(run.states[:, :3])[0].min() < 40.0


@pytest.mark.nightly
def test_over_the_streets_of_delft(data_dir, tmp_path):
    result, track, setup = flown("delft-streets", data_dir, tmp_path)
    assert 270.0 < result["path_length_m"] < 420.0
    distance, nearest = setup.obstacle_map.nearest(track)
    # Near things, and below the tops of some of them.
    assert distance.min() < 4.0
    assert (distance < 5.0).mean() > 0.1
    beside = [
        track[n, 2] < one.position_m[2] + one.half_m[2]
        for n, one in enumerate(setup.obstacle_map.obstacles[index] for index in nearest)
        if distance[n] < 12.0
    ]
    assert np.count_nonzero(beside) >= 20, "a second of flight beside walls"


@pytest.mark.nightly
def test_past_the_towers_of_cologne(data_dir, tmp_path):
    pytest.importorskip("rasterio")
    result, track, setup = flown("cologne-masts", data_dir, tmp_path)
    assert 3300.0 < result["path_length_m"] < 3900.0
    high = [one for one in setup.obstacle_map.obstacles if "turm" in one.name or "Dom" in one.name]
    assert any("Colonius" in one.name for one in high)
    passed = [one for one in high if np.hypot(*(track[:, :2] - one.position_m[:2]).T).min() < 80.0]
    assert len(passed) >= 2
    assert all(one.position_m[2] + one.half_m[2] > 90.0 for one in passed)
