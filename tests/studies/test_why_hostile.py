"""`clearway why` and logs that are cut, broken or not what they seem: one error, or an answer."""

from __future__ import annotations

import dataclasses
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("foxglove")
pytest.importorskip("mcap")
pytest.importorskip("rosbags")
pytest.importorskip("pyulog")
pytest.importorskip("pymavlink")

import made_logs
from clearway.io.toml_writing import write_toml
from clearway.studies.why import opening
from clearway.view.replay.raw_scans import read_raw_scans
from clearway.view.replay.reading import read_run
from in_process import Done, clearway
from made_crashes import MadeCrash, make_crash
from made_logs import ULOG_TOPICS, WRITERS, Change, Flown, as_flown

LOGS = ("run", "MCAP", "ROS 1 bag", "ULog", "DataFlash")
FILES = {"run": "run/run.mcap"}
"""What of a log is cut, where it is a folder."""
CUTS = [4, pytest.param(20, marks=pytest.mark.nightly)]
ANSWERS = (0, 2, 3)
"""A cause or none, bad input, not recorded."""


@cache
def crash() -> MadeCrash:
    """A short one."""
    return make_crash(9001, "seen late")


def written(form: str, folder: Path, change: Change = as_flown) -> tuple[Path, list[object]]:
    """A log, and the options that it is asked with."""
    log = WRITERS[form](crash(), folder, change)
    if form == "run":
        return log, []
    mission = folder / "mission.toml"
    write_toml(crash().file.effective(), mission)
    return log, ["--mission", mission]


def ask(log: Path, options: list[object]) -> Done:
    """One clear answer: a cause, or one error that names the log; errors come up as they are."""
    done = clearway("why", log, "--json", *options)
    assert done.exit_code in ANSWERS, done
    assert "Traceback" not in done.stderr
    if done.exit_code == 2:
        assert done.stdout == ""
        assert log.name in done.stderr or "run.mcap" in done.stderr
    else:
        told = json.loads(done.stdout)
        assert (done.exit_code == 3) == (told["cause"] == "not recorded")
    return done


@pytest.mark.parametrize("count", CUTS)
@pytest.mark.parametrize("form", LOGS)
def test_a_log_cut_anywhere_gets_one_answer(form: str, count: int, tmp_path: Path) -> None:
    log, options = written(form, tmp_path)
    file = tmp_path / FILES.get(form, log.name)
    whole = file.read_bytes()
    places = np.random.default_rng(LOGS.index(form)).integers(0, len(whole), count)
    for place in (len(whole) // 50, *sorted(places.tolist())):
        file.write_bytes(whole[:place])
        done = ask(log, options)
        assert done.exit_code == 2 or place > len(whole) // 50, "hardly anything is left"
    file.write_bytes(whole)
    assert ask(log, options).exit_code == 0


@pytest.mark.parametrize("form", ["MCAP", "ULog", "DataFlash"])
@pytest.mark.parametrize("jump_s", [-10.0, 3600.0, 3e8])
def test_a_clock_that_jumps(form: str, jump_s: float, tmp_path: Path) -> None:
    half_s = 0.5 * float(crash().flight.time_s[-1])

    def clock(time_s: float) -> float:
        # Before all jumps, so that none is before boot.
        return 20.0 + time_s + (jump_s if time_s > half_s else 0.0)

    assert ask(*written(form, tmp_path, lambda kept: kept._replace(clock=clock))).exit_code == 0


def no_poses(kept: Flown) -> Flown:
    return kept._replace(
        time_s=kept.time_s[:0], place_m=kept.place_m[:0], world_from_body=kept.world_from_body[:0],
        wind=(), states_crash=False,
    )  # fmt: skip


def one_pose(kept: Flown) -> Flown:
    return kept._replace(
        time_s=kept.time_s[:1], place_m=kept.place_m[:1], world_from_body=kept.world_from_body[:1]
    )


def no_numbers(kept: Flown) -> Flown:
    return kept._replace(place_m=np.full_like(kept.place_m, np.nan))


def some_no_numbers(kept: Flown) -> Flown:
    place = kept.place_m.copy()
    place[::3] = np.nan
    return kept._replace(place_m=place)


def empty_clouds(kept: Flown) -> Flown:
    return kept._replace(scans=tuple((time_s, points[:0]) for time_s, points in kept.scans))


def clouds_without_numbers(kept: Flown) -> Flown:
    lost = tuple((time_s, np.full_like(points, np.nan)) for time_s, points in kept.scans)
    return kept._replace(scans=lost)


CHANGES: dict[str, tuple[Callable[[Flown], Flown], tuple[int, ...], str]] = {
    "no poses": (no_poses, (2,), "pose"),
    "one pose": (one_pose, (0, 2, 3), ""),
    "no position is a number": (no_numbers, (2,), "pose"),
    "some positions are no numbers": (some_no_numbers, (0,), "poses left out"),
    "empty clouds": (empty_clouds, (0, 3), ""),
    "clouds without numbers": (clouds_without_numbers, (0, 3), ""),
}


@pytest.mark.parametrize("form", ["MCAP", "ULog", "DataFlash"])
@pytest.mark.parametrize("name", CHANGES)
def test_topics_that_are_missing_or_empty(name: str, form: str, tmp_path: Path) -> None:
    change, codes, told = CHANGES[name]
    done = ask(*written(form, tmp_path, change))
    assert done.exit_code in codes, done
    assert told in done.stderr


def put(topic: str, places: slice, value: float, every: int = 1) -> Callable[[Any], Any]:
    """Rows whose every so many of a topic have other values at places."""

    def change(rows: Any) -> Any:
        count = 0
        for time_s, name, values in rows:
            told = list(values)
            count += name == topic
            if name == topic and count % every == 0:
                told[places] = [value] * len(told[places])
            yield time_s, name, tuple(told)

    return change


STRANGE: dict[str, tuple[str, Callable[[Any], Any], int, str]] = {
    "sectors of no width": ("ULog", put("obstacle_distance", slice(1, 2), np.nan), 3, "sectors"),
    "sectors backwards": ("ULog", put("obstacle_distance", slice(1, 2), -5.0), 3, "sectors"),
    "some attitudes are none": (
        "ULog", put("vehicle_attitude", slice(1, 5), np.nan, 3), 0, "attitudes left out",
    ),
    "a wind that is none": ("ULog", put("wind", slice(1, 3), np.nan), 0, ""),
    "distances beyond reason": ("DataFlash", put("PRX", slice(3, 7), 1e6, 2), 0, ""),
    "distances that are none": ("DataFlash", put("PRX", slice(3, 4), np.nan, 2), 0, ""),
    "a time beyond reason": ("DataFlash", put("XKF1", slice(0, 1), 2**63, 30), 0, "left out"),
}  # fmt: skip


@pytest.mark.parametrize("name", STRANGE)
def test_values_that_no_logger_means(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    form, change, code, told = STRANGE[name]
    rows = {"ULog": "_ulog_rows", "DataFlash": "_dataflash_rows"}[form]
    real = getattr(made_logs, rows)
    monkeypatch.setattr(made_logs, rows, lambda kept: change(real(kept)))
    done = ask(*written(form, tmp_path))
    assert done.exit_code == code, done
    assert told in done.stderr


@pytest.mark.parametrize(
    ("topic", "field", "code", "told"),
    [
        ("obstacle_distance", "frame", 3, "obstacle_distance left out: it lacks fields"),
        ("vehicle_local_position", "x", 2, "vehicle_local_position of the log lacks x"),
        ("wind", "windspeed_north", 0, ""),
    ],
)
def test_topics_of_another_release(
    topic: str, field: str, code: int, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fields = [(kind, "other" if name == field else name) for kind, name in ULOG_TOPICS[topic]]
    monkeypatch.setitem(ULOG_TOPICS, topic, tuple(fields))
    done = ask(*written("ULog", tmp_path))
    assert done.exit_code == code, done
    assert told in done.stderr


def test_a_run_whose_mission_is_no_toml(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log, _ = written("run", tmp_path)
    kept = read_raw_scans(log / "run.mcap")
    for content in (b"[[[", b"\xff\xfe"):
        broken = kept._replace(mission_toml=content)
        monkeypatch.setattr(opening, "read_raw_scans", lambda _, broken=broken: broken)
        done = ask(log, [])
        assert done.exit_code == 2
        assert "its mission: no " in done.stderr


@pytest.mark.parametrize(("key", "value"), [("time_s", -1.0), ("position_m", [])])
def test_a_run_whose_states_are_damaged(
    key: str, value: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, _ = written("run", tmp_path)
    run = read_run(log)
    broken = dataclasses.replace(run, states=[{**one, key: value} for one in run.states])
    monkeypatch.setattr(opening, "read_run", lambda _: broken)
    done = ask(log, [])
    assert done.exit_code == 2
    assert "damaged" in done.stderr


def test_a_log_of_another_vehicle(tmp_path: Path) -> None:
    """The mission of a plane that is far faster and elsewhere: an answer all the same."""
    log, options = written("ULog", tmp_path)
    other = make_crash(9000, "undeclared wind")
    assert not other.case.craft.stops
    write_toml(other.file.effective(), Path(str(options[1])))
    ask(log, options)


def test_a_folder_and_an_empty_file_are_no_logs(tmp_path: Path) -> None:
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "flight.ulg").write_bytes(b"")
    folder = clearway("why", tmp_path / "notes")
    assert (folder.exit_code, folder.stdout) == (2, "")
    assert "neither a run nor a bag" in folder.stderr
    for suffix in (".ulg", ".bin", ".mcap", ".bag", ".db3"):
        path = tmp_path / f"empty{suffix}"
        path.write_bytes(b"")
        done = clearway("why", path)
        assert (done.exit_code, done.stdout) == (2, ""), done
        assert path.name in done.stderr


@pytest.mark.parametrize("missing", ["mission.toml", "run.mcap", "track.csv"])
def test_a_run_without_one_of_its_files(missing: str, tmp_path: Path) -> None:
    log, options = written("run", tmp_path)
    (log / missing).unlink()
    ask(log, options)


def test_a_bag_whose_messages_are_gone(tmp_path: Path) -> None:
    log, options = written("ROS 2 bag", tmp_path)
    for file in log.glob("*.db3"):
        file.unlink()
    assert ask(log, options).exit_code == 2
    shutil.rmtree(log)
    assert clearway("why", log).exit_code == 2


def test_a_sensor_that_reports_nothing_known_is_silent(tmp_path: Path) -> None:
    """PX4 goes on to log a dead sensor, with all sectors unknown: that is no reading."""
    made = make_crash(9000, "sensor dead")
    dead_s = made.case.fault.dead_s
    times = tuple(np.arange(dead_s, made.flight.time_s[-1], 0.2).tolist())

    def reports(kept: Flown) -> Flown:
        return kept._replace(dead_s=times)

    log = WRITERS["ULog"](replace(made, form="ULog"), tmp_path, reports)
    mission = tmp_path / "mission.toml"
    write_toml(made.file.effective(), mission)
    told: dict[str, Any] = json.loads(clearway("why", log, "--mission", mission, "--json").stdout)
    assert told["cause"] == "sensor dead"
    assert told["silent"][0]["last_s"] < dead_s
