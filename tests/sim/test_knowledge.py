"""What planners cannot know: of missions, of conflicts, and in the tables that say n/a."""

from __future__ import annotations

import json
from itertools import chain, combinations
from pathlib import Path

import pytest

from clearway.base.errors import OwnCodeError
from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from clearway.sim.baselines import PLANNERS, REPORTED_TRAFFIC, Source
from clearway.sim.baselines.knowledge import describe_hidden
from clearway.sim.baselines.notes import list_shared_notes, not_known
from clearway.studies.encounters.encounter import EncounterSettings
from clearway.studies.encounters.flights import EncounterTally
from clearway.studies.risk.settings import RiskSettings
from clearway.studies.risk.study import RiskStudy
from in_process import clearway

HITS_ALONE = {"deterministic", "deterministic-reduced", "deterministic-first-hit"}
BALL = """
[[obstacle]]
shape = "ball"
position_m = [9, 0.5, 0]
radius_m = 1.0
known = "{known}"
"""
INTRUDER = """
[[intruder]]
name = "i1"
appears_s = 0.0
position_m = [10, 0, 0]
velocity_mps = [-1, 0, 0]
radius_m = 0.5
transponder = {transponder}
visible = {visible}
"""


def mission(folder: Path, *parts: str, sensors: str = "") -> Path:
    path = folder / "m.toml"
    head = '[mission]\nname = "m"\nwaypoints_m = [[14, 0, 0]]\n'
    path.write_text(f"{sensors}\n{head}" + "".join(parts))
    return path


def hidden_in(path: Path | str) -> dict[str, str]:
    """Of each planner, without those that know all."""
    dangers = prepare(read_mission(str(path))).dangers
    told = {name: planner.describe_hidden(dangers) for name, planner in PLANNERS.items()}
    return {name: what for name, what in told.items() if what}


def test_who_knows_a_source_of_each_danger_knows_all() -> None:
    """Over all sets of sources: hidden exactly where some danger has none that is known."""
    sets = [
        frozenset(some)
        for some in chain.from_iterable(combinations(Source, n) for n in range(len(Source) + 1))
    ]
    for knows in sets:
        for one in sets:
            for other in sets:
                missing = any(told and not told & knows for told in (one, other))
                assert bool(describe_hidden(knows, [one, other])) == missing


def test_the_reference_knows_nothing_and_is_judged_all_the_same() -> None:
    assert PLANNERS["straight"].knows == frozenset()
    assert PLANNERS["straight"].describe_hidden([REPORTED_TRAFFIC]) == ""


@pytest.mark.parametrize(
    ("name", "blind"),
    [("static-obstacles", set()), ("intruders", HITS_ALONE), ("mixed", HITS_ALONE)],
)
def test_missions_of_clearway_hide_traffic_from_who_knows_hits_alone(
    name: str, blind: set[str]
) -> None:
    assert hidden_in(name) == dict.fromkeys(blind, "what traffic reports")


@pytest.mark.parametrize(
    ("part", "blind"),
    [
        (BALL.format(known="world"), ""),
        (BALL.format(known="both"), ""),
        (BALL.format(known="map"), ""),
        (INTRUDER.format(transponder="true", visible="false"), "what traffic reports"),
        (INTRUDER.format(transponder="true", visible="true"), ""),
        (INTRUDER.format(transponder="false", visible="true"), ""),
    ],
)
def test_what_sensors_see_is_known_and_what_is_only_reported_is_not(
    tmp_path: Path, part: str, blind: str
) -> None:
    """Only what is really there counts: what a map tells and is not there cannot be hit."""
    found = hidden_in(mission(tmp_path, part))
    assert found == (dict.fromkeys(HITS_ALONE, blind) if blind else {})


def test_without_sensors_maps_alone_tell(tmp_path: Path) -> None:
    path = mission(tmp_path, BALL.format(known="both"), sensors="lidar = []")
    assert hidden_in(path) == dict.fromkeys(HITS_ALONE, "what maps tell")
    nobody = mission(tmp_path, BALL.format(known="world"), sensors="lidar = []")
    assert hidden_in(nobody) == {}, "what nobody is told of counts for all alike"


def test_encounters_and_risks_are_of_reported_traffic() -> None:
    blind = {name for name in PLANNERS if EncounterTally(EncounterSettings(), (), name).hidden}
    assert blind == HITS_ALONE
    study = RiskStudy(RiskSettings(), tuple(PLANNERS), 0, ())
    assert {name for name in PLANNERS if study.describe_hidden(name)} == HITS_ALONE


def test_a_table_says_not_applicable_and_why_and_still_tells_path_and_time(tmp_path: Path) -> None:
    path = mission(
        tmp_path, INTRUDER.format(transponder="true", visible="false"), sensors="lidar = []"
    )
    options = ("--planners", "mvp,deterministic-reduced,adaptive", "--no-plots")
    done = clearway("compare", path, *options, "--out", "table", cwd=tmp_path)
    row = next(line for line in done.stdout.splitlines() if "deterministic-reduced" in line)
    assert row.split()[2:4] == ["n/a", "n/a"], done.stdout
    assert all(float(cell) > 0.0 for cell in row.split()[4:6]), "time and path"
    assert row.split().count("n/a") == 4
    assert len(row.split()) == 10, "as many cells as columns"
    assert "n/a: deterministic-reduced cannot know what traffic reports" in done.stdout
    assert "adaptive: reach sets, costs, memory of returns and verification" in done.stdout
    told = json.loads((tmp_path / "table" / "comparison.json").read_text())["planners"]
    assert [one["hidden"] for one in told] == ["", "what traffic reports", ""]
    assert told[1]["safe"] is None
    assert told[1]["path_length_m"] > 0.0


def test_own_planners_know_all_unless_they_say_otherwise(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "def make(craft): return None\n"
        "def hits(craft): return None\n"
        "hits.knows = ('sensors',)\n"
        "def wrong(craft): return None\n"
        "wrong.knows = ('radar',)\n"
    )
    assert PLANNERS.find("mine.py:make", tmp_path).describe_hidden([REPORTED_TRAFFIC]) == ""
    assert PLANNERS.find("mine.py:hits", tmp_path).describe_hidden([REPORTED_TRAFFIC])
    with pytest.raises(OwnCodeError, match="'sensors', 'map', 'traffic'"):
        PLANNERS.find("mine.py:wrong", tmp_path)


def test_notes_name_planners_by_what_they_share() -> None:
    told = "\n".join(list_shared_notes(["clearway", "turn-back", "adaptive", "straight"]))
    assert "turn-back, adaptive: " in told
    assert "straight avoids nothing" in told
    assert list_shared_notes(["clearway"]) == []
    assert not_known([("a", ""), ("b", "x"), ("c", "x"), ("b", "x")]) == ["n/a: b, c cannot know x"]
