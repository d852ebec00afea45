"""What somebody with a file calls: read, assess, fly, and rows of results."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import clearway as cw
from clearway.avoidance.scene import assess_scene
from clearway.missions.scene_reading import read_scene, scene_of
from clearway.missions.setup import prepare
from repository import REPOSITORY

SCENES = REPOSITORY / "examples" / "scenes"
STREET = SCENES / "street.pcd"


@pytest.fixture(scope="module")
def run() -> cw.Run:
    return cw.fly(cw.read_mission("static-obstacles").with_values("simulation", time_limit_s=12.0))


# --- scans ------------------------------------------------------------------------------------


def test_a_scan_knows_its_points_its_lidar_and_its_file() -> None:
    scan = cw.read_scan(STREET)
    assert scan.points_m.shape == (2760, 3)
    assert scan.lidar.name == scan.sensor
    assert scan.lidar_from == "estimated"
    assert "vlp16" in scan.lidar.pattern.name
    assert (scan.state, scan.index, scan.complete) == (None, 0, True)
    named = cw.read_scan(STREET, sensor="vlp16")
    assert (named.lidar_from, named.lidar.pattern.name) == ("stated", "vlp16")
    own = cw.Lidar("roof", named.lidar.pattern, sigma_m=0.03)
    assert cw.read_scan(STREET, sensor=own).lidar is own


def test_scans_of_a_folder_with_poses(tmp_path: Path) -> None:
    folder = tmp_path / "velodyne"
    folder.mkdir()
    rng = np.random.default_rng(1)
    for number in range(3):
        points = rng.uniform(0.0, 1.0, (50, 4))
        points[:, 0] += 9.0 - number
        points.astype("<f4").tofile(folder / f"{number:06}.bin")
    (tmp_path / "way.csv").write_text("0.0, 0,0,2, 0,0,0\n0.2, 2,0,2, 0,0,0\n")
    scans = list(cw.read_scans(folder, poses=tmp_path / "way.csv"))
    assert [scan.index for scan in scans] == [0, 1, 2]
    assert [scan.state.position_m[0] for scan in scans] == pytest.approx([0.0, 1.0, 2.0])
    assert [scan.state.time_s for scan in scans] == [scan.time_s for scan in scans]
    assert len({id(scan.lidar) for scan in scans}) == 1
    one = cw.read_scan(folder, 2, poses=tmp_path / "way.csv")
    np.testing.assert_array_equal(one.points_m, scans[2].points_m)


def test_recorded_scans_go_straight_into_the_live_system() -> None:
    setup = prepare(cw.read_mission("static-obstacles"))
    scan = cw.read_scan(STREET)
    system = cw.AvoidanceSystem(setup.planner, setup.mission, lidars=[scan.lidar])
    system.update(cw.State(np.zeros(3)))
    system.update(scan)
    assert not system.counts
    (detection,) = system.situation(0.0)[0].detections
    assert len(detection.points_m) > 1000


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda f: cw.read_scan(f / "absent.pcd"), "absent.pcd: cannot be read"),
        (lambda _: cw.read_scan(STREET, 3), "no scan number 3; it has 1"),
        (lambda _: cw.read_scan(STREET, sensor="vlp17"), "vlp17"),
        (lambda _: cw.read_scan(STREET, topic="/points"), "only bags and MCAP files have topics"),
        (lambda f: cw.read_scan(STREET, poses=f / "absent.csv"), "no such file of poses"),
        (lambda f: cw.read_scans(f), "no numbered scan|no scan|cannot"),
        (lambda _: cw.read_scan(STREET, at="soon"), "valid: the number of a scan"),
        (lambda _: cw.assess([np.zeros((3, 3))]), "a scan is needed, got ndarray; valid"),
        (lambda _: cw.assess(SCENES / "empty.toml", cw.AvoidanceGrid.uniform()), "states grid"),
        (lambda _: cw.fly("no-such-mission"), "missions by name: .*static-obstacles"),
        (lambda _: cw.fly("forest:1", "no-such-planner"), "valid planners are clearway, straight"),
        (lambda _: cw.fly("forest:x"), "a whole number is needed"),
        (lambda f: cw.read_traffic(f / "absent.csv"), "cannot be read"),
        (lambda f: cw.read_map(f / "absent.csv"), "cannot be read"),
        (lambda _: cw.draw_assessment(cw.assess([]), "colour"), "valid quantities are reach"),
    ],
)
def test_what_cannot_be_used_says_why(call, told: str, tmp_path: Path) -> None:
    with pytest.raises(cw.ClearwayError, match=told):
        call(tmp_path)


# --- assess -----------------------------------------------------------------------------------


def test_a_scene_file_is_assessed_as_the_command_does() -> None:
    ours = cw.assess(SCENES / "crossing-intruder.toml")
    theirs = assess_scene(read_scene(SCENES / "crossing-intruder.toml").scene)
    np.testing.assert_array_equal(ours.cells.rating, theirs.cells.rating)
    np.testing.assert_array_equal(ours.reach.node_rating, theirs.reach.node_rating)


def test_a_scan_is_assessed_as_the_command_does() -> None:
    grid = cw.AvoidanceGrid.uniform(50.0)
    tables = {"scan": {"file": str(STREET)}, "grid": {"range_m": 50.0, "elevation_deg": 30.0}}
    theirs = assess_scene(scene_of("test", tables, Path(), "street").scene)
    from_file, from_scan = cw.assess(STREET, grid), cw.assess(cw.read_scan(STREET), grid)
    bare = cw.assess(cw.Scan(cw.read_scan(STREET).points_m), grid)
    for ours in (from_file, from_scan, bare):
        np.testing.assert_array_equal(ours.cells.rating, theirs.cells.rating)
    assert np.count_nonzero(theirs.cells.obstacle) > 5


def test_map_and_intruders_count_without_any_scan() -> None:
    ball = cw.ObstacleMap([cw.Obstacle.ball([5.0, 0.0, 0.0], 1.0)])
    mapped = cw.assess([], obstacle_map=ball)
    met = cw.assess([], intruders=[cw.Intruder([8.0, 0.0, 0.0], [-1.0, 0.0, 0.0])])
    free = cw.assess([])
    assert free.cells.obstacle.max() == 0.0
    assert mapped.cells.evidence.map_base.max() > 0.3
    assert met.cells.obstacle.max() > 0.3
    away = cw.assess([], obstacle_map=ball, state=cw.State([100.0, 0.0, 0.0]))
    assert away.cells.evidence.map_base.max() == 0.0


# --- missions ---------------------------------------------------------------------------------


def test_a_run_is_a_summary_and_a_row(run: cw.Run) -> None:
    summary, row = run.summary(), run.to_row()
    assert json.loads(json.dumps(summary)) == summary
    assert (summary["mission"], summary["planner"]) == ("static-obstacles", "clearway")
    assert set(summary) - {"decision_ms", "provenance"} <= set(row)
    assert all(isinstance(value, str | float | int | None) for value in row.values())
    assert row["safe"] is run.safe
    assert row["decision_ms_p99"] == summary["decision_ms"]["p99"]


def test_runs_of_rivals_say_who_flew() -> None:
    file = cw.read_mission("static-obstacles").with_values("simulation", time_limit_s=3.0)
    rival = cw.fly(file, "straight")
    assert rival.summary()["planner"] == "straight"
    assert isinstance(cw.draw_flight(rival), Figure)
    with pytest.raises(cw.ClearwayError, match="tells of no plan"):
        cw.draw_flight(rival, 1.0)


def test_a_flight_is_drawn_whole_and_up_to_a_moment(run: cw.Run) -> None:
    assert isinstance(cw.draw_flight(run), Figure)
    moment = cw.draw_flight(run, 5.0, title="at five")
    assert moment.get_suptitle() == "at five"
    with pytest.raises(cw.ClearwayError, match="no decision up to -1 s"):
        cw.draw_flight(run, -1.0)


def test_notices_are_told() -> None:
    told: list[str] = []
    cw.fly(
        cw.read_mission("static-obstacles").with_values("simulation", time_limit_s=1.0),
        notice=told.append,
    )
    cw.assess(STREET, notice=told.append)
    assert all(isinstance(sentence, str) for sentence in told)


@pytest.mark.parametrize(
    ("section", "values", "told"),
    [
        ("simulation", {"sede": 3}, "simulation.sede: unknown key .did you mean 'seed'"),
        ("simulation", {"seed": -1}, "simulation.seed: should be greater than or equal to 0"),
        ("simulation", {"seed": 1.5}, "simulation.seed: should be a valid integer"),
        ("simulation", {"step_s": float("nan")}, "simulation.step_s: should be"),
        ("simulaton", {"seed": 3}, "simulaton: unknown key .did you mean 'simulation'"),
        ("changed", {}, "changed: unknown key"),
        ("rating", {"name": "totl"}, "rating.name: should be 'total'"),
        ("lidar", {"sgima_m": 1.0}, r"lidar\[0\].sgima_m: unknown key .did you mean 'sigma_m'"),
        ("intruder", {"name": "a"}, "intruder: there is none to change"),
        ("mission", {"waypoints_m": [[0, 0, 1e9]]}, "is it in metres"),
        ("mission", {"waypoints_m": [[1, 2]]}, r"waypoints_m\[0\]\[2\]: missing, but needed$"),
        ("map", {"fiels": ["a.csv"]}, r"map.fiels: unknown key \(did you mean 'files'\?\)"),
    ],
)
def test_a_changed_mission_is_checked_like_a_file(section: str, values, told: str) -> None:
    with pytest.raises(cw.ClearwayError, match=told):
        cw.read_mission("static-obstacles").with_values(section, **values)


def test_a_changed_mission_has_changed_and_nothing_else() -> None:
    before = cw.read_mission("static-obstacles")
    after = before.with_values("simulation", seed=np.int64(3), wind_mps=np.array([0.0, 1.0, 0.0]))
    assert (after.simulation.seed, after.simulation.wind_mps) == (3, (0.0, 1.0, 0.0))
    assert before.simulation.seed == 0
    tables, others = before.effective(), after.effective()
    tables.pop("simulation"), others.pop("simulation")
    assert tables == others
    assert {one.dropout for one in before.with_values("lidar", dropout=0.2).lidar} == {0.2}
    assert before.with_values("traffic", tracker=True).traffic.tracker is True
