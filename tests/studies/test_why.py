"""`clearway why`: crashes made with one fault each get the name of that fault."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("foxglove")
pytest.importorskip("mcap")
pytest.importorskip("rosbags")
pytest.importorskip("pyulog")
pytest.importorskip("pymavlink")

from clearway.io.flights.recorded import RangeReading, sector_reading
from clearway.io.public_data import FOLDER
from clearway.io.toml_writing import write_toml
from clearway.studies.why.causes import CrashCause
from clearway.studies.why.ending import Event
from clearway.studies.why.explain import explain_flight
from clearway.studies.why.words import explain_in_words
from in_process import clearway
from made_crashes import CAUSES, make_crash
from made_logs import WRITERS, as_flown, without_clouds

SHARE = 0.95
LOGS = ("run", "MCAP", "ULog", "DataFlash")
SITL_LOG = Path(__file__).parents[3] / "shared/data/logs/px4_sitl_sample_px4_events.ulg"


@cache
def crash(cause, seed=0):
    return make_crash(seed, cause)


def written(made, form, folder, change=as_flown):
    """Log and mission of a crash; a run has its own mission."""
    log = WRITERS[form](made, folder, change)
    mission = folder / "mission.toml"
    write_toml(made.file.effective(), mission)
    return log, None if form == "run" else mission


def cause_of(made, form, folder):
    return explain_flight(*written(made, form, folder)).answer.cause


@pytest.mark.parametrize(
    ("cause", "form"),
    [
        ("unseen", "ULog"),
        ("seen late", "ROS 2 bag"),
        ("sensor dead", "DataFlash"),
        ("wrong map", "run"),
        ("late decision", "ROS 1 bag"),
    ],
)
def test_a_made_crash_gets_the_name_of_its_fault(cause, form, tmp_path):
    explained = explain_flight(*written(crash(cause), form, tmp_path))
    assert explained.answer.cause == cause
    words = explain_in_words(explained).splitlines()
    assert 5 <= len(words) <= 8
    assert words[0] == f"cause      {cause}"


@pytest.mark.nightly
def test_nearly_all_made_crashes_of_four_formats_get_the_name_of_their_fault(tmp_path):
    wrong, count = [], 0
    for number, cause in enumerate(CAUSES):
        for seed, form in enumerate(LOGS):
            folder = tmp_path / f"{number}-{seed}"
            folder.mkdir()
            found = cause_of(crash(cause, 100 + seed), form, folder)
            count += 1
            if found != cause:
                wrong.append((cause, form, found))
    assert count - len(wrong) >= SHARE * count, wrong


@pytest.mark.parametrize("form", LOGS)
def test_a_log_without_clouds_is_not_recorded(form, tmp_path):
    log, mission = written(crash("late decision"), form, tmp_path, without_clouds)
    answer = explain_flight(log, mission).answer
    assert answer.ending.event is Event.CONTACT
    assert answer.cause is CrashCause.NOT_RECORDED
    assert answer.decisions == ()


def test_what_is_told_of_a_late_decision(tmp_path):
    made = crash("late decision")
    log, mission = written(made, "MCAP", tmp_path)
    done = clearway("why", log, "--mission", mission, "--json", "--out", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["cause"] == "late decision"
    assert told["time_s"] == pytest.approx(made.flight.time_s[-1], abs=0.3)
    sight, (shown_s, shown_m) = told["sights"][0], made.flight.shown[0]
    assert sight["sensor"] == "/front/points"
    # It may first have shown another part of what was hit.
    assert shown_s - 0.01 <= sight["time_s"] < shown_s + 2.0
    assert sight["away_m"] < shown_m + made.case.danger.wide
    assert told["clearway"]["time_s"] < told["last_clear"]["time_s"] < told["time_s"]
    assert told["clearway"]["kept_m"] > told["body_radius_m"]
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"why.json", "why.png"} <= names


def test_a_flight_that_kept_its_margin_has_no_cause(tmp_path):
    made = crash("unseen")
    sound = replace(made, flight=made.sound)
    least = sound.flight.surface_m.min()
    assert least > made.case.craft.margin_m
    explained = explain_flight(*written(sound, "MCAP", tmp_path))
    assert explained.answer.cause is CrashCause.NONE
    # Returns show no place nearer than the nearest one, and may miss that.
    assert explained.answer.ending.nearest_m >= least - 0.1


def test_a_crash_without_a_mission_states_what_is_assumed(tmp_path):
    log, _ = written(crash("late decision"), "MCAP", tmp_path, without_clouds)
    done = clearway("why", log)
    assert done.exit_code == 3
    speed = crash("late decision").case.craft.speed_mps
    assert f"assumed a multirotor of {speed:g} m/s" in done.stderr
    assert "--mission" in done.stderr


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("bad.ulg", b"nope", "ULog"),
        ("bad.bin", b"nope", "no DataFlash log"),
        ("bad.mcap", b"nope", "MCAP"),
        ("bad.bag", b"nope", "bad.bag"),
        ("bad.txt", b"nope", "valid: a run folder"),
        ("absent.ulg", None, "cannot be read"),
    ],
)
def test_wrong_files_are_named_with_what_is_wrong(name, content, told, tmp_path):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    done = clearway("why", name, cwd=tmp_path)
    assert done.exit_code == 2
    assert name in done.stderr
    assert told in done.stderr
    assert "Traceback" not in done.stderr


def test_an_empty_folder_is_no_log(tmp_path):
    done = clearway("why", tmp_path)
    assert done.exit_code == 2
    assert "neither a run nor a bag" in done.stderr


def test_a_log_of_px4_without_obstacles_is_not_recorded():
    if not SITL_LOG.is_file():
        pytest.skip(f"the log of PX4's simulation is not there ({FOLDER})")
    done = clearway("why", SITL_LOG)
    assert done.exit_code == 3, done.stderr
    assert done.stdout.startswith("cause      not recorded")


def test_a_sector_stands_for_all_of_its_arc_and_a_beam_for_its_point():
    azimuth = np.radians([0.0, -90.0, 180.0, 90.0])
    reading = sector_reading(1.0, azimuth, np.array([4.0, np.nan, np.nan, 2.0]))
    points, whose = reading.arcs()
    assert set(whose) == {0, 1}
    ahead = points[whose == 0]
    assert np.allclose(np.linalg.norm(ahead[:, :2], axis=1), 4.0)
    turned = np.degrees(np.arctan2(ahead[:, 1], ahead[:, 0]))
    assert turned.min() == pytest.approx(-45.0)
    assert turned.max() == pytest.approx(45.0)
    assert np.ptp(ahead[:, 2]) >= 10.0
    beam = RangeReading(1.0, np.array([[3.0, 0.0, 0.0]]))
    assert np.array_equal(beam.arcs()[0], beam.points_m)
