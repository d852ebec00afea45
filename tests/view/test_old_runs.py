"""A run that version 0.1.0 wrote, kept beside this file, is read by this version."""

from __future__ import annotations

import json
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.base.version import SCHEMA_VERSION
from clearway.io.toml_writing import write_toml
from clearway.missions.mission_file import read_mission_file
from clearway.missions.run_files import write_decisions
from clearway.missions.scene_file import SceneFile
from flown_missions import flown
from in_process import clearway

OLD = Path(__file__).parent / "run-0.1.0"


def test_a_run_of_0_1_0_replays(tmp_path):
    pytest.importorskip("mcap")
    run = shutil.copytree(OLD, tmp_path / "run")
    done = clearway("replay", run, "--html", tmp_path / "page.html", "--no-browser")
    assert done.exit_code == 0, done.stderr
    assert "<title>short - clearway replay</title>" in (tmp_path / "page.html").read_text()


def test_a_run_of_0_1_0_is_read_as_it_was_flown():
    pytest.importorskip("mcap")
    from clearway.view.replay.reading import read_run

    read = read_run(OLD)
    track = np.loadtxt(OLD / "track.csv", delimiter=",", skiprows=1)
    assert read.mission["name"] == "short"
    assert len(read.decisions) == len((OLD / "decisions.jsonl").read_text().splitlines())
    np.testing.assert_allclose(read.states[-1]["position_m"], track[-1, 1:4], atol=1e-3)


def test_its_mission_can_be_flown_again():
    mission = read_mission_file(str(OLD / "mission.toml"))
    assert mission.mission.waypoints_m == ((3.0, 0.0, 0.0),)
    assert mission.effective()["schema_version"] == SCHEMA_VERSION


def test_what_is_written_tells_its_version(tmp_path):
    write_decisions(flown().run, tmp_path / "decisions.jsonl")
    for line in (tmp_path / "decisions.jsonl").read_text().splitlines():
        assert json.loads(line)["schema_version"] == SCHEMA_VERSION
    file = read_mission_file(str(OLD / "mission.toml"))
    write_toml(file.effective(), tmp_path / "mission.toml")
    text = (tmp_path / "mission.toml").read_text()
    assert tomllib.loads(text)["schema_version"] == SCHEMA_VERSION
    assert read_mission_file(str(tmp_path / "mission.toml")) == file
    assert SceneFile().effective(tmp_path)["schema_version"] == SCHEMA_VERSION


@pytest.mark.parametrize("version", ["99", "0", "true", '"2"'])
def test_a_file_of_a_later_version_is_refused(version, tmp_path):
    text = (OLD / "mission.toml").read_text()
    (tmp_path / "a.toml").write_text(f"schema_version = {version}\n{text}")
    with pytest.raises(InputError, match=r"schema_version: .* is of another version of clearway"):
        read_mission_file(str(tmp_path / "a.toml"))
