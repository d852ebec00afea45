"""Flight plans of ground stations as missions: real ones, and made ones with every part."""

import json

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.base.frames import enu_from_geodetic
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare

HOME = (47.3977507, 8.5456075, 488.9)


def real(data_dir, name):
    path = data_dir / "maps" / "missions" / name
    if not path.is_file():
        pytest.skip(f"needs data: {name}")
    return path


def place(east_m, north_m):
    """Latitude and longitude so far from home; good to a millimetre or so here."""
    latitude = HOME[0] + np.degrees(north_m / 6_370_600.0)
    return [latitude, HOME[1] + np.degrees(east_m / (6_388_600.0 * np.cos(np.radians(HOME[0]))))]


def item(command, east_m=None, north_m=None, height=30.0, frame=3, **others):
    where = [None, None] if east_m is None else place(east_m, north_m)
    return {
        "type": "SimpleItem",
        "command": command,
        "frame": frame,
        "params": [0, 0, 0, None, *where, height],
        **others,
    }


def plan(tmp_path, *items, **parts):
    data = {
        "fileType": "Plan",
        "mission": {
            "plannedHomePosition": HOME,
            "items": items,
            "vehicleType": 2,
            "hoverSpeed": 6,
            "cruiseSpeed": 15,
        },
        **parts,
    }
    path = tmp_path / "made.plan"
    path.write_text(json.dumps(data))
    return path


def read(path):
    """The mission of a plan, and what was said about it."""
    said = []
    return read_mission_file(str(path), said.append), "\n".join(said)


# Real files


def test_the_plan_of_zurich(data_dir):
    mission, said = read(real(data_dir, "mavsdk_qgroundcontrol_sample.plan"))
    assert mission.mission.name == "mavsdk_qgroundcontrol_sample"
    assert mission.mission.origin_geodetic == pytest.approx((47.3977507, 8.5456075, 488.931), abs=1)
    third = enu_from_geodetic([47.39827377, 8.54660532, 538.93], mission.mission.origin_geodetic)
    assert mission.mission.waypoints_m[1] == pytest.approx(third, abs=0.01)
    assert len(mission.mission.waypoints_m) == 3
    assert mission.mission.landing_m == ((0.0, 0.0, 50.0),)
    assert mission.vehicle.position_m == (0.0, 0.0, 50.0)
    assert mission.vehicle.speed_mps == 5.0
    assert "1 left out: command 2000" in said
    assert "the plan's" in said


def test_the_waypoints_of_redmond_are_flown(data_dir):
    mission, said = read(real(data_dir, "qgc_MissionPlanner.waypoints"))
    assert len(mission.mission.waypoints_m) == 5
    heights = np.array(mission.mission.waypoints_m)[:, 2]
    assert heights == pytest.approx(np.full(5, 100.0), abs=0.1)
    assert "5 m/s is assumed" in said
    setup = prepare(mission)
    run = setup.fly()
    assert run.reached
    assert run.progress.waypoints_reached(run.mission) == 5


@pytest.mark.parametrize(
    "name", ["mavsdk_qgroundcontrol_sample.plan", "qgc_MissionPlanner.waypoints"]
)
@pytest.mark.parametrize("share", [0.0, 0.2, 0.6, 0.95])
def test_truncated_plans_are_refused(data_dir, tmp_path, name, share):
    content = real(data_dir, name).read_bytes()
    path = tmp_path / name
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(InputError) as refused:
        read(path)
    assert str(refused.value).startswith(str(path))
    assert any(word in str(refused.value) for word in ("truncated", "empty", "line"))


# What a plan may hold


def test_scales_with_the_speed_of_the_plan(tmp_path):
    mission, _ = read(plan(tmp_path, item(22, 0, 0), item(16, 200, 0)))
    assert mission.vehicle.speed_mps == 6.0
    assert mission.grid.range_m == 60.0
    assert mission.safety.margin_m == pytest.approx(2.4)
    faster = [item(178, height=0.0), item(22, 0, 0), item(16, 400, 0)]
    faster[0]["params"] = [1, 10, -1, 0, 0, 0, 0]
    mission, _ = read(plan(tmp_path, *faster))
    assert mission.vehicle.speed_mps == 10.0


def test_heights_above_home_sea_and_ground(tmp_path):
    items = [
        item(22, 0, 0),
        item(16, 100, 0, 40.0),
        item(16, 200, 0, 540.0, frame=0),
        item(16, 300, 0, 25.0, frame=10),
        item(16, 400, 0, 25.0, frame=11, AMSLAltAboveTerrain=560.0),
    ]
    mission, said = read(plan(tmp_path, *items))
    heights = [point[2] for point in mission.mission.waypoints_m]
    assert heights == pytest.approx([40.0, 540.0 - HOME[2], 25.0, 560.0 - HOME[2]], abs=0.05)
    assert [point[0] for point in mission.mission.waypoints_m] == pytest.approx(
        [100, 200, 300, 400], abs=0.2
    )
    assert "above sea level are taken relative to home's" in said
    assert "no terrain is asked" in said


def test_starts_towards_the_first_waypoint_and_lands_above_the_place(tmp_path):
    items = [item(22), item(16, 0, 300), item(16, 0, 301), item(21, -50, 300, 0.0)]
    mission, said = read(plan(tmp_path, *items))
    assert mission.vehicle.attitude_deg == pytest.approx((0, 0, 90), abs=0.01)
    assert len(mission.mission.waypoints_m) == 1
    assert "1 left out: waypoint within the reach radius" in said
    assert mission.mission.landing_m[0] == pytest.approx((-50, 300, 30), abs=0.1)


def test_a_survey_is_flown_and_other_complex_items_are_counted(tmp_path):
    survey = {
        "type": "ComplexItem",
        "complexItemType": "survey",
        "TransectStyleComplexItem": {"Items": [item(16, 100, 0), item(206), item(16, 100, 90)]},
    }
    other = {"type": "ComplexItem", "complexItemType": "StructureScan"}
    mission, said = read(plan(tmp_path, item(22, 0, 0), survey, other, item(18, 0, 90)))
    assert len(mission.mission.waypoints_m) == 3
    assert "1 left out: StructureScan" in said
    assert "1 left out: command 206" in said
    assert "1 left out: loitering" in said


def test_returns_to_the_nearest_rally_point(tmp_path):
    points = [[*place(500, 0), 50.0], [*place(0, 200), 60.0]]
    rally = {"points": points}
    path = plan(tmp_path, item(22, 0, 0), item(16, 50, 250), item(20), rallyPoints=rally)
    mission, said = read(path)
    assert mission.mission.landing_m[0] == pytest.approx((0, 200, 60), abs=0.1)
    assert "nearest of 2 rally points" in said


def square(east_m, north_m, half_m):
    corners = [(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)]
    return [place(east_m + x, north_m + y) for x, y in corners]


def test_fences_are_kept_in_a_flight(tmp_path):
    pytest.importorskip("shapely")
    fences = {
        "polygons": [
            {"inclusion": True, "polygon": square(100, 0, 180)},
            {"inclusion": False, "polygon": square(100, 5, 25)},
        ],
        "circles": [{"inclusion": False, "circle": {"center": place(0, 150), "radius": 20}}],
    }
    mission, _ = read(plan(tmp_path, item(22, 0, 0), item(16, 200, 0), geoFence=fences))
    assert {part.known for part in mission.obstacle} == {"map"}
    assert sum(part.name.endswith("wall") for part in mission.obstacle) == 4
    run = prepare(mission).fly()
    assert run.reached
    assert run.metrics.min_obstacle_distance_m == np.inf  # there is nothing to be seen
    x, y = run.states[:, 0], run.states[:, 1]
    outside = np.maximum(np.abs(x - 100), np.abs(y - 5)) - 25
    assert outside.min() >= mission.safety.margin_m - 0.05
    assert np.maximum(np.abs(x - 100), np.abs(y)).max() <= 180 - mission.safety.margin_m


@pytest.mark.parametrize(("inclusion", "side"), [(True, "outside"), (False, "inside")])
def test_waypoints_on_the_wrong_side_of_a_fence_are_refused(tmp_path, inclusion, side):
    pytest.importorskip("shapely")
    center = (0, 0) if inclusion else (200, 0)
    fences = {"polygons": [{"inclusion": inclusion, "polygon": square(*center, 60)}]}
    path = plan(tmp_path, item(22, 0, 0), item(16, 200, 0), geoFence=fences)
    with pytest.raises(InputError, match=f"fence 0: goal 1 lies {side} of it"):
        read(path)


# A mission file over a plan


def test_keys_of_a_mission_file_take_precedence_over_its_plan(tmp_path):
    plan(tmp_path, item(22, 0, 0), item(16, 300, 0))
    path = tmp_path / "own.toml"
    path.write_text(
        '[mission]\nplan = "made.plan"\nname = "mine"\n[vehicle]\nspeed_mps = 10\n'
        '[safety]\nmargin_m = 7\n[[obstacle]]\nshape = "ball"\nposition_m = [150, 0, 30]\n'
        "radius_m = 5\n"
    )
    mission, said = read(path)
    assert mission.mission.name == "mine"
    assert mission.mission.waypoints_m[0] == pytest.approx((300, 0, 30), abs=0.1)
    assert (mission.vehicle.speed_mps, mission.grid.range_m) == (10.0, 100.0)
    assert mission.safety.margin_m == 7.0
    assert len(mission.obstacle) == 1
    assert "10 m/s is chosen" in said
    again = mission.effective()
    assert "plan" not in again["mission"]


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ('[mission]\nplan = "none.plan"\n', "none.plan: cannot be read"),
        ('[mission]\nplan = "own.toml"\n', "valid: .plan, .kmz, .kml, .waypoints"),
        ("[mission]\nplan = 3\n", "mission.plan"),
        ('vehicle = 3\n[mission]\nplan = "made.plan"\n', "vehicle: should be a table"),
        ('obstacle = 3\n[mission]\nplan = "made.plan"\n', "obstacle"),
    ],
)
def test_bad_mission_files_over_a_plan(tmp_path, text, cause):
    plan(tmp_path, item(22, 0, 0), item(16, 300, 0))
    path = tmp_path / "own.toml"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        read(path)
    assert cause in str(refused.value)


def test_a_plan_whose_home_is_not_set_begins_at_its_first_place(tmp_path):
    def made(*items):
        home = {"plannedHomePosition": (0, 0, 0), "items": items, "vehicleType": 2}
        return plan(tmp_path, mission=home)

    mission, said = read(made(item(22, 100, 50), item(16, 150, 50)))
    assert mission.mission.origin_geodetic == pytest.approx((*place(100, 50), 0.0))
    np.testing.assert_allclose(mission.vehicle.position_m, (0, 0, 30), atol=0.01)
    np.testing.assert_allclose(mission.mission.waypoints_m, [(50, 0, 30)], atol=0.1)
    assert "home is not set in the plan: the first place in it is taken for home" in said
    with pytest.raises(InputError, match="heights above sea level need its own"):
        read(made(item(22, 0, 0), item(16, 50, 50, 500, frame=0)))


def test_lands_where_a_landing_pattern_ends_and_keeps_a_speed_that_is_not_changed(tmp_path):
    pattern = {
        "type": "ComplexItem",
        "complexItemType": "fwLandingPattern",
        "landCoordinate": [*place(200, 100), 0],
        "altitudesAreRelative": True,
    }
    keep = item(178, params=[1, -1, -1, 0, 0, 0, 0])
    mission, said = read(plan(tmp_path, keep, item(22, 0, 0), item(16, 150, 0), pattern))
    np.testing.assert_allclose(mission.mission.landing_m, [(200, 100, 30)], atol=0.1)
    assert mission.vehicle.speed_mps == 6.0
    assert "left out" not in said


@pytest.mark.parametrize("name", ["made.PLAN", "made.json", "made.txt", "made"])
def test_plans_by_other_names(tmp_path, name):
    path = plan(tmp_path, item(16, 100, 0))
    other = path.rename(tmp_path / name)
    if name == "made.txt":  # as Mission Planner may call it
        where = " ".join(map(str, (*place(100, 0), 30)))
        home = " ".join(map(str, HOME))
        other.write_text(f"QGC WPL 110\n0 1 0 16 0 0 0 0 {home} 1\n1 0 3 16 0 0 0 0 {where} 1\n")
    mission, _ = read(other)
    np.testing.assert_allclose(mission.mission.waypoints_m, [(100, 0, 30)], atol=0.1)


def test_a_map_is_no_mission(tmp_path):
    path = tmp_path / "city.json"
    path.write_text('{"type": "CityJSON"}')
    with pytest.raises(InputError, match=r"looks like a map: `clearway map` takes it"):
        read(path)


# Bad plans


@pytest.mark.parametrize(
    ("items", "cause"),
    [
        ([], "no waypoint in it"),
        ([item(22, 0, 0)], "no waypoint in it"),
        ([item(16)], "mission.items[0]: latitude and longitude are missing"),
        ([item(16, 0, 0, None)], "mission.items[0]: the height is missing"),
        ([item(16, 0, 0, frame=1)], "mission.items[0]: frame 1; valid: 0, 3"),
        ([item(16, 0, 0, params=[0, 0, 0, 0, 99, 8, 30])], "latitude 99"),
        (
            [item(16, 0, 120_000)],
            "goal 1: 120 km from home, where down is another way; at most 100",
        ),
    ],
)
def test_bad_plans_name_the_item(tmp_path, items, cause):
    with pytest.raises(InputError) as refused:
        read(plan(tmp_path, *items))
    assert cause in str(refused.value)


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("QGC WPL 110\n0 1 0 16 0 0 0 0 47 8 400 1\n1 0 3 16 0 0 0 0 47\n", "line 3: 9 of 12"),
        ("QGC WPL 110\n0 1 0 16 0 0 0 0 47 8 x 1\n", "line 2: 'x' is no number"),
        (
            "QGC WPL 110\n0 1 0 16 0 0 0 0 47 8 400 1\n1 0 3 16.5 0 0 0 0 47 8 30 1\n",
            "command 16.5",
        ),
        ("QGC WPL 110\n0 1 0 16 0 0 0 0 47 8 400 1\n1 0 3 16 0 0 0 0 91 0 30 1\n", "latitude 91"),
        ("QGC WPL 100\n0 1 0 16 0 0 0 0 47 8 400 1\n", "valid: QGC WPL 110 or 120"),
        ("QGC WPL 110\n0 1 0 16 0 0 0 0 97 8 400 1\n", "line 2: home: latitude 97"),
        ("QGC WPL 110\n0 1 0 16 0 0 0 0 47 8 400 1\n1 0 3 nan 0 0 0 0 47 8 30 1\n", "command"),
        ("QGC WPL 110\n", "no item in it"),
        ("lat,lon\n", "valid: QGC WPL 110"),
    ],
)
def test_bad_waypoint_files_name_the_line(tmp_path, text, cause):
    path = tmp_path / "bad.waypoints"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        read(path)
    assert cause in str(refused.value)


def test_the_vehicle_of_a_mission_decides_which_waypoints_of_its_plan_are_one(tmp_path):
    """A plane of 6 m/s counts as there within 9 m, a multirotor within 1.5 m."""
    plan(tmp_path, item(22, 0, 0), item(16, 100, 0), item(16, 100, 5), item(16, 0, 5))
    path = tmp_path / "own.toml"
    for vehicle, goals, reach_m in (
        ("", 2, 9.0),
        ('[vehicle]\nkind = "multirotor"\n', 3, 1.5),
        ("reach_radius_m = 4\n", 3, 4.0),
        ("[vehicle]\nspeed_mps = 3\n", 3, 4.5),
    ):
        path.write_text(f'[mission]\nplan = "made.plan"\n{vehicle}')
        mission, said = read(path)
        assert len(mission.mission.waypoints_m) == goals, vehicle
        assert mission.mission.reach_radius_m == reach_m
        assert ("within the reach radius" in said) == (goals == 2)
