"""Scene files: what is refused, paths in them, overrides, and their page."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

from clearway.avoidance.scene import assess_scene
from clearway.base.errors import InputError
from clearway.io.toml import parse_model
from clearway.io.toml_problems import sections_in
from clearway.missions.scene_file import SceneFile
from clearway.missions.scene_reading import merge_tables, read_scene, scene_of
from clearway.missions.scene_result import scene_result
from repository import REPOSITORY
from scenes_for_tests import CROSSING, TWO_BALLS, problems_of, result_of


@pytest.mark.parametrize(
    ("tables", "problem"),
    [
        ({"grid": {"layers": 0}}, "grid.layers: should be greater than or equal to 1, got 0"),
        ({"grid": {"layers": "ten"}}, 'grid.layers: should be a valid integer, got "ten"'),
        ({"grid": {"range_m": -5}}, "grid: range_m: edges must be at least two and ascend, got -5"),
        ({"grid": {"range_m": [5]}}, "range_m: edges must be at least two and ascend, got [5.0]"),
        ({"grid": {"range_m": [5, 2]}}, "range_m: edges must be at least two and ascend"),
        ({"grid": {"range_m": [-5, 2]}}, "range_m: must lie within 0 to 1e+06, got [-5.0, 2.0]"),
        ({"grid": {"azimuth_deg": 200}}, "azimuth_deg: must lie within -180 to 180, got 200"),
        ({"grid": {"elevation_deg": 91}}, "elevation_deg: must lie within -90 to 90"),
        ({"grid": {"range_edges_m": [0, 1, 2], "layers": 3}}, "but layers = 3"),
        ({"grid": {"range_edges_m": [0, 1], "range_m": 3}}, "give only one of them"),
        ({"grid": {"layers": 900, "columns": 900}}, "4,050,000 cells are too many"),
        ({"grid": {"layerz": 3}}, "grid.layerz: unknown key (did you mean 'layers'?)"),
        ({"grdi": {}}, "grdi: unknown key (did you mean 'grid'?); valid keys: grid, intruder"),
        ({"obstacle": [{"shape": "ball"}]}, "obstacle[0].position_m: missing, but needed"),
        (
            {"obstacle": [{"shape": "ball", "position_m": [0, 0, 0]}]},
            "obstacle[0]: radius_m: a ball",
        ),
        (
            {"obstacle": [{"shape": "line", "position_m": [0, 0, 0], "size_m": [1, 2]}]},
            "obstacle[0]: size_m: a line needs 1 lengths, got 2; radius_m: a line needs",
        ),
        ({"obstacle": [{"shape": "bal", "position_m": [0, 0, 0]}]}, "(did you mean 'ball'?)"),
        ({"scan": {}}, "scan: either `file` or [scan.simulate] is needed"),
        ({"scan": {"file": "a.pcd", "simulate": {}}}, "and not both"),
        ({"scan": {"simulate": {"obstacles": [0]}}}, "no obstacle [0]; valid indices: none"),
        (
            {"obstacle": TWO_BALLS, "scan": {"simulate": {"obstacles": [1, 2, -1]}}},
            "no obstacle [2, -1]; valid indices: 0 to 1",
        ),
        ({"scan": {"simulate": {"azimuth_deg": [1]}}}, "are needed together"),
        ({"scan": {"simulate": {"beams_per_cell": [0, 3]}}}, "at least [1, 1]"),
        ({"scan": {"simulate": {"beams_per_cell": [10_000, 10_000]}}}, "3,500,000,000 beams; at"),
        ({"scan": {"simulate": {"dropout": 1.0}}}, "scan.simulate.dropout: should be less than 1"),
        (
            {"intruder": [CROSSING | {"spread_deg": [95, 0]}]},
            "spread: must be within [0, 90)",
        ),
        ({"intruder": [CROSSING | {"models": ["lin"]}]}, "(did you mean 'line'?)"),
        ({"intruder": [CROSSING | {"models": []}]}, "at least one of line, body, spread"),
        ({"intruder": [CROSSING | {"up": [0, 0, 0]}]}, "up: a direction is needed"),
        ({"vehicle_timing": {"speed_mps": 0}}, "vehicle_timing.speed_mps: should be greater than"),
        ({"reach_set": {"speed_mps": 1e9}}, "reach_set.speed_mps: should be less than or equal to"),
        ({"reach_set": {"spread": 3}}, "spread tunes chaotic, combined or dispersion, not flying"),
        ({"rating": {"name": "totl"}}, "rating.name: should be 'total', 'printed', 'visible'"),
        ({"rating": {"unknown": 1.5}}, "rating.unknown: should be less than or equal to 1"),
        ({"vehicle": {"position_m": [0, 0]}}, "vehicle.position_m[2]: missing"),
    ],
)
def test_bad_scenes(tables: dict[str, Any], problem: str) -> None:
    assert problem in problems_of(tables)


def test_all_problems_of_a_scene_at_once() -> None:
    problems = problems_of(
        {
            "grid": {"range_m": 0, "azimuth_deg": 400},
            "obstacle": [{"shape": "ball", "position_m": [0, 0, 0]}],
            "rating": {"unkown": 1},
        }
    )
    assert [line.split(":")[0] for line in problems.split("\n")] == [
        "grid",
        "obstacle[0]",
        "rating.unkown",
    ]
    assert "range_m: edges" in problems
    assert "azimuth_deg: must lie" in problems


def test_the_effective_scene_assesses_the_same(tmp_path: Path) -> None:
    from clearway.io.toml_writing import write_toml

    path = tmp_path / "scene.toml"
    write_toml(
        {
            "grid": {"range_edges_m": [0, 2, 5, 9], "azimuth_deg": [-20, 40]},
            "vehicle": {"attitude_deg": [0, 0, 10]},
            "obstacle": TWO_BALLS,
            "scan": {"simulate": {"azimuth_deg": [-5, 0, 5], "elevation_deg": [0, 3]}},
            "intruder": [CROSSING | {"timed": "shorter"}],
        },
        path,
    )
    first = read_scene(path)
    write_toml(first.tables, tmp_path / "again.toml")
    second = read_scene(tmp_path / "again.toml")
    assert second.tables == first.tables
    one, other = (scene_result(assess_scene(read.scene)) for read in (first, second))
    assert {**one, "name": ""} == {**other, "name": ""}


def test_scan_files_are_relative_to_the_scene(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "points.xyz", [[5.0, 0.1, 0.1], [8.0, 1.0, 0.2]])
    (tmp_path / "scene.toml").write_text('[scan]\nfile = "points.xyz"\npattern = "vlp16"\n')
    read = read_scene(tmp_path / "scene.toml")
    assert read.scene.sightings[0].pattern_from == "stated"
    assert read.scene.sightings[0].lidar.pattern.name == "vlp16"
    assert read.tables["scan"]["file"] == str(tmp_path / "points.xyz")
    with pytest.raises(
        InputError, match=r"'vlp17' \(did you mean 'vlp16'\?\); known are vlp16.*or auto"
    ):
        read_scene(tmp_path / "scene.toml", {"scan": {"pattern": "vlp17"}})


def test_a_survey_is_no_scan(tmp_path: Path) -> None:
    np.save(tmp_path / "tile.npy", np.random.default_rng(1).uniform(0, 100, (50, 3)) + 200_000.0)
    with pytest.raises(InputError, match="map coordinates, not the scan of a sensor"):
        scene_of("test", {"scan": {"file": str(tmp_path / "tile.npy")}}, Path(), "test")


def test_overrides_reach_into_tables() -> None:
    tables = {"grid": {"range_m": 10, "layers": 3}, "scan": {"file": "a"}}
    assert merge_tables(tables, {"grid": {"range_m": 20}, "rating": {"name": "visible"}}) == {
        "grid": {"range_m": 20, "layers": 3},
        "scan": {"file": "a"},
        "rating": {"name": "visible"},
    }


def test_the_page_on_scene_files_is_complete_and_true() -> None:
    page = (REPOSITORY / "docs" / "scene-file.md").read_text()
    example = page.split("```toml\n")[1].split("```")[0]
    tables = tomllib.loads(example)
    simulate = tables["scan"].pop("simulate")
    assert parse_model("docs/scene-file.md", tables, SceneFile).scan is not None
    parsed = parse_model(
        "docs/scene-file.md", {**tables, "scan": {"simulate": simulate}}, SceneFile
    )
    assert parsed.reach_set == SceneFile().reach_set.model_copy(
        update={"start_pitch_deg": 0.0, "speed_mps": 1.0}
    )
    assert parsed.rating == SceneFile().rating
    missing = [key for key in _keys(SceneFile) if not re.search(rf"\b{key}\b", example)]
    assert missing == []
    undocumented = [key for key in result_of({}) if f"`{key}" not in page]
    assert undocumented == ["name"]


def _keys(model: type[BaseModel]) -> set[str]:
    """Every key of a section and of the sections in it."""
    inner = {
        key
        for field in model.model_fields.values()
        for part in sections_in(field.annotation)
        for key in _keys(part)
    }
    return inner | set(model.model_fields)
