"""Faults: what each does to scans and reports, in missions, and the command that draws curves."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from clearway.base.errors import ClearwayError, InputError
from clearway.io.marked_page import put_between_marks
from clearway.missions.fault_section import FaultsSection
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.sensors import Scan
from clearway.sim.faults import NO_FAULTS, Faults
from clearway.studies.faults import STUDIES, case, fly_one, fly_studies
from clearway.traffic import Intruder
from in_process import clearway

SCAN = Scan(np.array([[5.0, 0.0, 0.0], [0.0, 5.0, 0.0], [3.0, 4.0, 12.0]]), 1.0, sensor="lidar")
REPORT = Intruder(
    np.array([1.0, 2.0, 3.0]),
    np.array([1.0, 0, 0]),
    spread_rad=np.zeros(2),
    radius_m=0.5,
    name="A",
    time_s=1.0,
)


def test_without_faults_nothing_changes():
    assert NO_FAULTS.scan(SCAN, 1.0) is SCAN
    assert NO_FAULTS.report(REPORT, np.random.default_rng(0)) is REPORT


def test_a_bias_moves_returns_along_their_beams():
    points = Faults(range_bias_m=0.5).scan(SCAN, 1.0).points_m
    assert np.linalg.norm(points, axis=1) == pytest.approx([5.5, 5.5, 13.5])
    assert points[2] / 13.5 == pytest.approx(np.array([3.0, 4.0, 12.0]) / 13.0)
    nearer = Faults(range_bias_m=-6.0).scan(SCAN, 1.0).points_m
    assert np.linalg.norm(nearer, axis=1) == pytest.approx([7.0]), "others would be behind it"


def test_a_blind_sector_returns_nothing_and_others_all():
    points = Faults(blind_from_rad=-0.1, blind_to_rad=0.1).scan(SCAN, 1.0).points_m
    assert points.tolist() == SCAN.points_m[1:].tolist()


def test_a_dead_sensor_falls_silent():
    dead = Faults(dead_from_s=2.0)
    assert dead.scan(SCAN, 1.99) is SCAN
    assert dead.scan(SCAN, 2.0) is None


def test_reports_get_lost_or_jump_as_often_as_stated():
    rng = np.random.default_rng(1)
    faults = Faults(report_loss=0.3, spoofed=0.5, spoof_m=7.0)
    heard = [faults.report(REPORT, rng) for _ in range(4000)]
    there = [report for report in heard if report is not None]
    jumps = np.array([np.linalg.norm(r.position_m - REPORT.position_m) for r in there])
    assert len(there) / 4000 == pytest.approx(0.7, abs=0.03)
    assert np.mean(jumps > 0.0) == pytest.approx(0.5, abs=0.03)
    assert jumps[jumps > 0.0] == pytest.approx(7.0)
    assert {report.name for report in there} == {"A"}


@pytest.mark.parametrize(
    "wrong",
    [
        {"report_loss": 1.5},
        {"spoofed": -0.1},
        {"range_bias_m": np.nan},
        {"blind_from_rad": 1.0, "blind_to_rad": 0.0},
    ],
)
def test_impossible_faults_are_refused(wrong):
    with pytest.raises(ClearwayError):
        Faults(**wrong)


def test_a_mission_file_says_what_goes_wrong(tmp_path):
    path = tmp_path / "mission.toml"
    path.write_text(
        '[mission]\nname = "m"\nwaypoints_m = [[20, 0, 0]]\n[simulation]\nwind_mps = [0, 0.2, 0]\n'
        "[faults]\nblind_deg = [-5, 5]\ndead_from_s = 3\nreport_loss = 0.5\n"
    )
    settings = prepare(read_mission_file(str(path))).simulation
    assert settings.faults == Faults(0.0, np.radians(-5.0), np.radians(5.0), 3.0, 0.5, 0.0, 0.0)
    assert settings.wind_mps == (0.0, 0.2, 0.0)
    path.write_text(path.read_text().replace("[-5, 5]", "[5, -5]"))
    with pytest.raises(InputError, match="blind_deg must be"):
        read_mission_file(str(path))
    assert FaultsSection().to_faults() == NO_FAULTS


def test_wind_carries_the_vehicle():
    file = read_mission_file("static-obstacles").with_values("simulation", time_limit_s=2.0)
    still = prepare(file).fly().states[-1]
    blown = prepare(file.with_values("simulation", wind_mps=(0.0, 0.1, 0.0))).fly().states[-1]
    assert blown[1] - still[1] == pytest.approx(0.2, abs=0.01)


@pytest.mark.nightly
def test_a_blind_sensor_crashes_where_the_map_does_not_know_either():
    crashed = [
        seed for seed in range(4) if fly_one("dead-sensor", "LiDAR alone", 0.0, seed).crashed
    ]
    assert crashed
    for seed in crashed:
        assert fly_one("dead-sensor", "LiDAR and map", 0.0, seed).margin_kept
        assert fly_one("dead-sensor", "LiDAR and map", 0.0, seed, "off").kept


def test_every_study_starts_from_the_same_worlds_and_makes_missions_that_read_back():
    for name, study in STUDIES.items():
        file = case(study, 3)
        for make in study.variants.values():
            made = [make(file, level, 3) for level in study.levels]
            assert len({one.model_dump_json() for one in made}) == len(made), name
            assert made[0] == make(case(study, 3), study.levels[0], 3)


@pytest.mark.nightly
def test_studies_do_not_depend_on_the_number_of_processes():
    one = fly_studies(["report-loss"], range(2), workers=1)
    two = fly_studies(["report-loss"], range(2), workers=2)
    assert one == two
    lossless, *_, silent = [p for p in one if p.variant == "reports as they come"]
    assert lossless.kept == 2
    assert silent.crashed == 2
    assert silent.interval(silent.crashed)[1] == 1.0


@pytest.mark.nightly
def test_the_command_draws_tabulates_and_writes_missions(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "# Faults\n<!-- faults-strict:begin -->\nold\n<!-- faults-strict:end -->\nend\n"
    )
    out = tmp_path / "out"
    flown = clearway(
        "faults", "report-loss", "--flights", "1", "--workers", "1", "--json",
        "--out", str(out), "--docs", str(page), cwd=tmp_path,
    )  # fmt: skip
    assert flown.returncode == 1, "some crashed: " + flown.stderr
    points = json.loads(flown.stdout)["points"]
    assert len(points) == 12
    assert points[5]["crashed"] == 1
    assert points[5]["not_kept"] == [0]
    assert (out / "faults.png").stat().st_size > 10_000
    with (out / "faults.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 12
    assert "old" not in page.read_text()
    assert "| Reports of traffic lost" in page.read_text()
    options = ("--missions", "--seed", "1", "--out", str(out))
    missions = clearway("faults", "report-loss", *options, cwd=tmp_path)
    assert missions.returncode == 0, missions.stderr
    lost = out / "report-loss-1-tracker-1.toml"
    assert str(lost) in missions.stdout
    again = prepare(read_mission_file(str(lost))).fly()
    assert again.crashed_s is not None


def test_wrong_names_and_pages_without_marks_are_refused(tmp_path):
    wrong = clearway("faults", "rain", "blind-sector", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "'rain' is no fault; valid: gusts, wind" in wrong.stderr
    page = tmp_path / "page.md"
    page.write_text("nothing")
    with pytest.raises(InputError, match="no <!-- faults:begin -->"):
        put_between_marks(page, "faults", "new")
    with pytest.raises(InputError, match="cannot be written"):
        put_between_marks(tmp_path / "absent.md", "faults", "new")


def test_faults_are_frozen():
    assert replace(NO_FAULTS, spoofed=0.1).spoofed == 0.1
    assert NO_FAULTS.spoofed == 0.0
