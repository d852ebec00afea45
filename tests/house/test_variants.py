"""A variant is written down in one place: help, files, pages and pictures are made from it."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from tools.format_tables import PARTS
from tools.reference import page

from clearway.avoidance.rate.fusion import RATINGS, total
from clearway.avoidance.rules.airspace import altitude_floor
from clearway.avoidance.rules.own import OWN_RULES
from clearway.base.grid import AvoidanceGrid
from clearway.base.variants import Variants
from clearway.io.maps.map_formats import JSON_FORMATS
from clearway.io.maps.map_formats import MAP_FORMATS as MAPS
from clearway.io.poses.pose_file import POSE_FORMATS as POSES
from clearway.io.scans.scan_formats import SCAN_FORMATS as SCANS
from clearway.io.toml import parse_model
from clearway.io.traffic.traffic_formats import TRAFFIC_FORMATS as TRAFFIC
from clearway.missions.mission_file import MissionFile
from clearway.missions.planned import PLANS
from clearway.missions.rule_sections import RulesSection, mission_rules
from clearway.missions.scene_file import SceneFile
from clearway.missions.sensor_section import SENSORS, AnyKind
from clearway.reach import METHODS
from clearway.reach.choose.covering import select_for_flying
from clearway.sensors import COMBINE_RULES
from clearway.sensors.cells.detection import RULES
from clearway.sim.baselines import PLANNERS
from clearway.sim.run import METRICS, Metric
from clearway.studies.campaigns.file import CampaignFile
from clearway.studies.campaigns.row import IDENTITY, FlightRow, measure_run, measures
from flown_missions import flown
from in_process import clearway
from repository import REPOSITORY

SOURCE = REPOSITORY / "src" / "clearway"
REGISTRIES: Mapping[str, tuple[Variants[Any], str]] = {
    "rating": (RATINGS, "avoidance/rate/fusion.py"),
    "planner": (PLANNERS, "sim/baselines/registry.py"),
    "sensor": (SENSORS, "missions/sensor_section.py"),
    "reach set": (METHODS, "reach/sets.py"),
    "detection": (RULES, "sensors/cells/detection.py"),
    "sensor fusion": (COMBINE_RULES, "sensors/standing.py"),
}
AS_PRINTED = ("reach/compare/comparison.py", "studies/reproduction/")
"""What repeats tables and figures of the paper lists what the paper does."""
MISSION = {"mission": {"name": "m", "waypoints_m": [[9, 0, 0]]}}


@pytest.mark.parametrize("kind", REGISTRIES)
def test_names_are_listed_in_their_registry_alone(kind: str) -> None:
    registry, home = REGISTRIES[kind]
    if len(registry) < 2:
        return
    others = {
        str(path.relative_to(SOURCE))
        for path in SOURCE.rglob("*.py")
        if len(set(registry) & _texts(path)) > 2 or set(registry) <= _texts(path)
    }
    assert {path for path in others if not path.startswith(AS_PRINTED)} == {home}


@cache
def _texts(path: Path) -> set[str]:
    """Texts of a file that are no documentation, and the words of those that are lists."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docs = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}
    texts = [
        n.value
        for n in ast.walk(tree)
        if isinstance(n, ast.Constant) and isinstance(n.value, str) and id(n) not in docs
    ]
    words = (word for text in texts if ", " in text for word in re.split(r"[\s,.]+", text))
    return {*texts, *words}


@pytest.mark.parametrize("kind", REGISTRIES)
def test_every_variant_is_told_in_the_reference(kind: str) -> None:
    registry, _ = REGISTRIES[kind]
    text = page()
    for name in registry:
        assert f"| `{name}` | {registry.about(name)} |" in text
        assert len(registry.about(name)) > 10


def told(tmp_path: Path, *command: str) -> str:
    """The help of a command as one line."""
    done = clearway(*command, "--help", cwd=tmp_path)
    assert done.exit_code == 0
    return re.sub(r"[\s│]+", " ", done.stdout)


def test_a_new_rating_needs_no_other_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(RATINGS.built_in, "throw-away", total)
    for command in ("fly", "assess"):
        assert "throw-away" in told(tmp_path, command)
    table = {"rating": {"name": "throw-away"}}
    assert parse_model("m", MISSION | table, MissionFile).to_avoidance().rating == "throw-away"
    assert parse_model("s", table, SceneFile).rating.name == "throw-away"
    assert '`"throw-away"`' in page()


def test_a_new_keep_rule_needs_no_other_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(METHODS.built_in, "throw-away", select_for_flying)
    for command in (("assess",), ("reach-set",)):
        assert "throw-away" in told(tmp_path, *command)
    table = {"reach_set": {"method": "throw-away"}}
    assert parse_model("m", MISSION | table, MissionFile).reach_set.method == "throw-away"
    assert parse_model("s", table, SceneFile).reach_set.method == "throw-away"
    assert '`"throw-away"`' in page()


def test_a_new_planner_needs_no_other_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(PLANNERS.built_in, "throw-away", PLANNERS["straight"])
    for command in ("fly", "compare", "encounters", "risk"):
        assert "throw-away" in told(tmp_path, command)
    tables = tomllib.loads('name = "c"\nplanners = ["throw-away"]\n[[family]]\nfamily = "balls"')
    assert parse_model("c", tables, CampaignFile).planners == ("throw-away",)
    assert "| `throw-away` |" in page()


def test_a_new_metric_needs_no_other_place(monkeypatch: pytest.MonkeyPatch) -> None:
    run = flown().run
    before, row = run.summary(), run.to_row()
    metric = Metric("A throw-away.", lambda run: len(run.movements))
    monkeypatch.setitem(METRICS.built_in, "throw_away", metric)
    assert run.summary() == before | {"throw_away": len(run.movements)}
    assert run.to_row() == row | {"throw_away": len(run.movements)}
    text = page()
    assert "| `throw_away` | A throw-away. |" in text
    assert all(f"| `{name}` | {METRICS.about(name)} |" in text for name in METRICS)


def test_a_new_metric_of_campaigns_is_one_field() -> None:
    """Its field says what it is of a run; rows, Parquet files and `COLUMNS` follow."""
    run = flown().run
    told = measures(run)
    assert told["corrections"] == run.corrections
    unmeasured = {f.name for f in fields(FlightRow)} - set(told)
    assert unmeasured == set(IDENTITY)

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Wider(FlightRow):
        throw_away: int = measure_run(lambda run: len(run.movements), 0)

    assert measures(run, Wider) == told | {"throw_away": len(run.movements)}


def test_a_new_kind_of_sensor_needs_no_other_place(monkeypatch: pytest.MonkeyPatch) -> None:
    def throw_away(grid: AvoidanceGrid, settings: Mapping[str, Any]) -> AnyKind:
        """A throw-away."""
        return SENSORS["lidar"](grid, settings)

    monkeypatch.setitem(SENSORS.built_in, "throw-away", throw_away)
    table = {"sensor": [{"kind": "throw-away", "settings": {"name": "new"}}]}
    parsed = parse_model("m", MISSION | table, MissionFile)
    assert parsed.sensor[0].to_sensor(AvoidanceGrid.uniform()).name == "new"
    assert "| `throw-away` | A throw-away. |" in page()


def test_a_new_rule_needs_no_other_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """By name it is in `OWN_RULES`; by a key of its own, a field of the section is told at once."""
    monkeypatch.setitem(OWN_RULES.built_in, "throw-away", altitude_floor(1.0))
    table = {"rules": {"own": ["throw-away"]}}
    section = parse_model("m", MISSION | table, MissionFile).rules
    assert mission_rules(section, (), None, "m") == (OWN_RULES["throw-away"],)
    told = PARTS["rules.md", "rules"]()
    assert all(f"| `[rules] {key}` |" in told for key in RulesSection.model_fields)


def test_every_format_is_told_in_the_help(tmp_path: Path) -> None:
    scans, traffic, maps = (told(tmp_path, name) for name in ("assess", "traffic", "map"))
    for scan in SCANS:
        assert all(suffix in scans for suffix in scan.suffixes)
    assert all(one.name in scans for one in POSES)
    for recording in TRAFFIC:
        assert recording.name in traffic
    for one in MAPS:
        assert one.name in maps
        assert all(suffix in maps for suffix in one.suffixes)
    assert all(plan in told(tmp_path, "fly") for plan in PLANS)


def test_every_map_and_plan_is_told_in_its_page() -> None:
    text = (REPOSITORY / "docs" / "maps.md").read_text()
    assert all(suffix in text for one in MAPS for suffix in one.suffixes)
    assert all(one.name.split()[0] in text for one in JSON_FORMATS)
    assert all(suffix in text for suffix in PLANS)
