"""Files that clearway writes say of which form they are; later forms are refused."""

from __future__ import annotations

import json
import tomllib

import pytest

from clearway.base.errors import InputError
from clearway.base.version import SCHEMA_VERSION
from clearway.io.toml_writing import write_toml
from clearway.missions.mission_file import read_mission_file
from clearway.missions.run_files import write_decisions
from clearway.missions.scene_file import SceneFile
from flown_missions import flown


def test_what_is_written_says_its_version(tmp_path):
    write_decisions(flown().run, tmp_path / "decisions.jsonl")
    for line in (tmp_path / "decisions.jsonl").read_text().splitlines():
        assert json.loads(line)["schema_version"] == SCHEMA_VERSION
    file = read_mission_file("static-obstacles")
    write_toml(file.effective(), tmp_path / "mission.toml")
    text = (tmp_path / "mission.toml").read_text()
    assert tomllib.loads(text)["schema_version"] == SCHEMA_VERSION
    assert read_mission_file(str(tmp_path / "mission.toml")) == file
    assert SceneFile().effective(tmp_path)["schema_version"] == SCHEMA_VERSION


@pytest.mark.parametrize("version", ["99", "0", "true", '"2"'])
def test_a_file_of_a_later_version_is_refused(version, tmp_path):
    (tmp_path / "a.toml").write_text(
        f"schema_version = {version}\n[mission]\nwaypoints_m = [[30.0, 0.0, 0.0]]\n"
    )
    with pytest.raises(InputError, match=r"schema_version: .* is of another version of clearway"):
        read_mission_file(str(tmp_path / "a.toml"))
