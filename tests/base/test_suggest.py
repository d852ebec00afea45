"""A name that there is not brings the one that was probably meant, wherever it is given."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearway.base.errors import ClearwayError
from clearway.base.suggest import did_you_mean, file_nearby
from clearway.io.maps.maps import read_maps
from clearway.io.toml import parse_model
from clearway.missions.scene_file import SceneFile
from clearway.missions.world_file import read_mission
from clearway.sensors import find_pattern
from clearway.sim.baselines import check_planner_name
from clearway.studies.campaigns.file import read_campaign
from clearway.studies.reproduction.registry import targets_named

CHOICES = ("forest", "Street", "walls")


@pytest.mark.parametrize(
    ("word", "meant"), [("forrest:3", "forest"), ("STREET", "Street"), ("wals", "walls")]
)
def test_the_nearest_is_told(word: str, meant: str) -> None:
    assert did_you_mean(word, CHOICES) == f" (did you mean {meant!r}?)"


@pytest.mark.parametrize("word", ["", "xyz", "\x00", "f" * 10_000])
def test_what_is_near_to_none_is_not_guessed(word: str) -> None:
    assert did_you_mean(word, CHOICES) == ""


def test_a_file_of_nearly_that_name(tmp_path: Path) -> None:
    (tmp_path / "street.pcd").write_text("")
    assert "street.pcd" in file_nearby(tmp_path / "stret.pcd")
    assert file_nearby(tmp_path / "absent" / "stret.pcd") == ""


def test_a_file_of_another_kind_only_where_its_name_is_the_same(tmp_path: Path) -> None:
    for name in ("encounter.scn", "nothere.csv", "sweeps.pcd"):
        (tmp_path / name).write_text("")
    assert file_nearby(tmp_path / "encountr.pcd") == ""
    assert "encounter.scn" in file_nearby(tmp_path / "encounter.pcd")
    assert "sweeps.pcd" in file_nearby(tmp_path / "sweep.pcd")


def _table(path: Path) -> None:
    path.write_text("lattitude,longitude,height\n1,2,3\n")
    read_maps([path])


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        (lambda _: read_mission("static-obstacle"), "static-obstacles"),
        (lambda _: read_mission("forrest:3"), "forest"),
        (lambda _: check_planner_name("potental-field"), "potential-field"),
        (lambda _: find_pattern("vlp-16"), "vlp16"),
        (lambda _: read_campaign("standart"), "standard"),
        (lambda _: targets_named(["table-6.3"]), "table-6"),
        (lambda _: parse_model("a", {"gird": {}}, SceneFile), "grid"),
        (lambda _: parse_model("a", {"rating": {"name": "totl"}}, SceneFile), "total"),
        (lambda folder: _table(folder / "masts.csv"), "latitude"),
    ],
)
def test_every_kind_of_name_has_a_suggestion(given: object, meant: str, tmp_path: Path) -> None:
    assert callable(given)
    with pytest.raises(ClearwayError, match=rf"did you mean '{meant}"):
        given(tmp_path)
