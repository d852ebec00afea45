"""Rules in mission files: from tables to flights, and what is refused."""

import json
from functools import partial

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from in_process import clearway
from repository import REPOSITORY

EXAMPLE = REPOSITORY / "examples" / "missions" / "rules.toml"

MISSION = """
[mission]
name = "ruled"
waypoints_m = [[30, 0, 0]]
"""


def mission(tmp_path, rules):
    path = tmp_path / "mission.toml"
    path.write_text(MISSION + rules)
    return path


fly = partial(clearway, "fly")


def test_rules_of_a_file_are_flown_logged_and_written_into_the_effective_mission(tmp_path):
    path = mission(
        tmp_path,
        """
[rules]
floor_m = -2
ceiling_m = 1
route_m = 8

[[keep_out]]
name = "school"
shape = "cuboid"
position_m = [15, 0, 0]
size_m = [6, 6, 20]
""",
    )
    out = tmp_path / "out"
    flown = fly(str(path), "--out", str(out), "--no-plots", "--json")
    assert flown.returncode == 0, flown.stderr
    track = np.genfromtxt(out / "track.csv", delimiter=",", names=True)
    places = np.stack([track["x_m"], track["y_m"], track["z_m"]], axis=1)
    school = ObstacleMap([Obstacle.cuboid([15, 0, 0], (6, 6, 20))])
    assert school.distance_m(places).min() >= -0.05
    assert places[:, 2].min() >= -2.0
    assert places[:, 2].max() <= 1.0
    log = [json.loads(line) for line in (out / "decisions.jsonl").read_text().splitlines()]
    notes = [note for entry in log for note in entry["rules"]]
    assert {note["name"] for note in notes} >= {"keep out of school", "near the route"}
    assert any(note["decided"] for note in notes if note["name"] == "keep out of school")
    assert set(notes[0]) == {"name", "reason", "forbidden", "broken", "decided"}
    again = read_mission_file(str(out / "mission.toml"))
    assert [rule.name for rule in prepare(again).planner.rules] == [
        "keep out of school",
        "altitude floor",
        "altitude ceiling",
        "near the route",
    ]


def test_a_volume_counts_at_its_times_only(tmp_path):
    volume = '[[keep_out]]\nshape = "ball"\nposition_m = [15, 0, 0]\nradius_m = 3\n'
    later = prepare(read_mission_file(str(mission(tmp_path, volume + "from_s = 40\n")))).fly()
    assert np.abs(later.states[:, 1]).max() < 1.5
    now = prepare(read_mission_file(str(mission(tmp_path, volume + "until_s = 40\n")))).fly()
    assert np.linalg.norm(now.states[:, :3] - [15, 0, 0], axis=1).min() >= 3.0 - 0.05


@pytest.mark.parametrize(
    ("rules", "said"),
    [
        ("[rules]\nfloor_m = 5\nceiling_m = 2\n", "floor_m 5 is not below ceiling_m 2"),
        ("[rules]\nterrain_m = 5\n", "rules.terrain_m: needs a terrain raster"),
        ('[rules]\nseparation = "sideways"\n', "'any', 'horizontal' or 'vertical'"),
        ("[rules]\nseparation_within_m = 5\n", 'needs separation = "horizontal"'),
        ("[rules]\nroute_m = 0\n", "route_m"),
        ("[rules]\nheight = 5\n", "rules.height"),
        ('[[keep_out]]\nshape = "ball"\nposition_m = [1, 2, 3]\n', "radius_m"),
        (
            '[[keep_out]]\nshape = "ball"\nposition_m = [1, 2, 3]\nradius_m = 1\nfrom_s = 3\n'
            "until_s = 3\n",
            "from_s 3 is not before until_s 3",
        ),
    ],
)
def test_impossible_rules_are_refused(tmp_path, rules, said):
    with pytest.raises(InputError) as refused:
        prepare(read_mission_file(str(mission(tmp_path, rules))))
    assert said in str(refused.value)


def test_the_command_line_refuses_them_in_a_sentence(tmp_path):
    rules = "[rules]\nfloor_m = 5\nroute_m = 0\nheight = 5\n"
    flown = fly(str(mission(tmp_path, rules)), "--out", str(tmp_path / "out"))
    assert flown.returncode == 2
    assert "rules.route_m" in flown.stderr
    assert "rules.height: unknown key; valid keys: ceiling_m" in flown.stderr
    assert "Traceback" not in flown.stderr
    assert not (tmp_path / "out").exists()


def test_the_example_obeys_the_rules_of_the_air():
    setup = prepare(read_mission_file(str(EXAMPLE)))
    run = setup.fly()
    assert run.reached
    assert run.metrics.margin_violations == 0
    reasons = " ".join(
        note.reason
        for entry in run.decisions
        for note in entry.flight.decision.choice.rules
        if note.name == "right of way"
    )
    for met in ("head-on head on", "crossing converging from the right", "slow overtaking it"):
        assert met in reasons


def raster(path, height_m):
    """25 x 25 samples of 20 m around the mission's origin."""
    rasterio = pytest.importorskip("rasterio")
    from affine import Affine

    with rasterio.open(
        path, "w", driver="GTiff", width=25, height=25, count=1, dtype="float32",
        crs="EPSG:25832", transform=Affine(20.0, 0.0, 356_300.0, 0.0, -20.0, 5_645_300.0),
    ) as file:  # fmt: skip
        file.write(height_m.astype("float32"), 1)


def test_terrain_is_kept_below(tmp_path):
    from pyproj import Transformer

    heights = np.full((25, 25), 50.0)
    heights[:, 14:] = 56.0  # The eastern half lies higher.
    raster(tmp_path / "terrain.tif", heights)
    latitude, longitude = Transformer.from_crs("EPSG:25832", "EPSG:4326").transform(
        356_500.0, 5_645_050.0
    )
    path = tmp_path / "mission.toml"
    path.write_text(
        f"""
[mission]
name = "over-a-step"
origin_geodetic = [{latitude}, {longitude}, 50]
waypoints_m = [[120, 0, 20]]
reach_radius_m = 3
[vehicle]
position_m = [0, 0, 9]
speed_mps = 2
[grid]
range_m = 20
[map]
files = ["terrain.tif"]
known = "map"
[rules]
terrain_m = 8
"""
    )
    setup = prepare(read_mission_file(str(path)))
    (rule,) = setup.planner.rules
    assert rule.name == "terrain clearance"
    run = setup.fly()
    east, height = run.states[:, 0], run.states[:, 2]
    assert run.reached
    # Samples stand for 20 m, and the rule keeps to the highest around.
    assert height[east > 80.0].min() >= 14.0 - 0.1
    assert height[east < 20.0].min() >= 8.0


def test_the_place_of_a_mission_has_to_lie_in_the_terrain(tmp_path):
    raster(tmp_path / "terrain.tif", np.full((25, 25), 50.0))
    path = tmp_path / "mission.toml"
    path.write_text(
        MISSION
        + 'origin_geodetic = [10, 10, 0]\n[map]\nfiles = ["terrain.tif"]\n[rules]\nterrain_m = 8\n'
    )
    with pytest.raises(InputError, match="the mission's place in it"):
        prepare(read_mission_file(str(path)))
