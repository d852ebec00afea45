"""A user's own planner, rating, sensor and rule through the command lines that take them."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from clearway.base import own_code
from in_process import clearway
from repository import REPOSITORY

EXAMPLES = REPOSITORY / "examples"
BROKEN = """
from clearway.sim.baselines import Manoeuvre

def forgetful(craft):
    return lambda situation, before: None

def mistaken(craft):
    return lambda situation, before: Manoeuvre(("Sideways",), "why not")

def late(craft):
    def rule(situation, before):
        if situation.state.time_s > 2.5:
            raise RuntimeError("out of ideas")
        return Manoeuvre(("Straight",), "on")
    return rule

def of_nothing():
    return None
"""

SHORT = """
[mission]
name = "short"
waypoints_m = [[18, 0, 0]]

[[obstacle]]
shape = "ball"
position_m = [9, 0.5, 0]
radius_m = 1.5
"""


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """A folder with the examples; what is imported from it is forgotten again."""
    for name in ("own_planner", "own_rating", "own_sensor", "own_rule"):
        shutil.copy(EXAMPLES / f"{name}.py", tmp_path)
    (tmp_path / "broken.py").write_text(BROKEN)
    (tmp_path / "short.toml").write_text(SHORT)
    modules, path = set(sys.modules), list(sys.path)
    beside = list(own_code.list_looked_beside())
    yield tmp_path
    for name in set(sys.modules) - modules:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]
    sys.path[:] = path
    own_code._NEIGHBOURS.folders[:] = beside


def answer(folder: Path, *arguments: str | Path, code: int = 0) -> dict[str, Any]:
    done = clearway(*arguments, "--json", cwd=folder)
    assert done.exit_code == code, done.stderr
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def test_an_own_planner_is_compared_with_ours(folder: Path) -> None:
    names = "clearway,own_planner:make"
    result = answer(folder, "compare", "short.toml", "--planners", names, "--no-plots")
    ours, own = result["planners"]
    assert (ours["planner"], ours["safe"]) == ("clearway", 1)
    assert own["planner"] == own["runs"][0]["planner"] == "own_planner:make"
    assert own["runs"][0]["decisions"] > 5


@pytest.mark.nightly
def test_an_own_planner_flies_encounters_in_worker_processes(folder: Path) -> None:
    planners = ("--planners", "own_planner:make,straight")
    count = ("--count", "26", "--workers", "2")  # more than one worker takes at once
    own, straight = answer(folder, "encounters", *planners, *count, code=1)["encounters"]
    assert (own["planner"], straight["planner"]) == ("own_planner:make", "straight")
    # It knows nothing of traffic, so that it meets whoever straight flight meets.
    assert own["failures"] == straight["failures"] == list(range(26))


@pytest.mark.nightly
def test_an_own_planner_flies_a_campaign_from_the_folder_of_its_file(folder: Path) -> None:
    pytest.importorskip("pyarrow")
    (folder / "plans").mkdir()
    (folder / "plans" / "mine.toml").write_text(
        'name = "mine"\nplanners = ["../own_planner.py:make", "straight"]\nseeds = 1\n'
        '[[family]]\nfamily = "mission"\nparameters = { mission = "static-obstacles" }\n'
    )
    result = answer(folder, "campaign", "plans/mine.toml", "--workers", "2", code=1)
    assert [row["planner"] for row in result["table"]] == ["../own_planner.py:make", "straight"]
    assert [row["flights"] for row in result["table"]] == [1, 1]
    assert not any(row["not_flown"] for row in result["table"])


def test_an_own_planner_is_weighed_beside_ours(folder: Path) -> None:
    command = ("risk", "--planners", "own_planner:make", "--count", "2", "--workers", "1", "--json")
    done = clearway(*command, cwd=folder)
    assert list(json.loads(done.stdout)["planners"]) == ["own_planner:make"]


@pytest.mark.nightly
def test_a_mission_of_own_parts_flies_and_its_log_flies_it_again(folder: Path) -> None:
    (folder / "missions").mkdir()
    shutil.copy(EXAMPLES / "missions" / "own-parts.toml", folder / "missions")
    quiet = ("--no-plots", "--no-mcap")
    first = answer(folder, "fly", "missions/own-parts.toml", "--out", "one", *quiet)
    assert first["reached"]
    assert first["margin_violations"] == first["emergencies"] == 0
    log = (folder / "one" / "decisions.jsonl").read_text()
    assert '"name": "stay low"' in log
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    again = answer(elsewhere, "fly", folder / "one" / "mission.toml", "--out", "two", *quiet)
    assert again["path_length_m"] == first["path_length_m"]
    assert (elsewhere / "two/track.csv").read_text() == (folder / "one/track.csv").read_text()


def test_a_rating_and_a_rule_are_named_on_the_command_line(folder: Path) -> None:
    options = ("--rating", "own_rating:wary", "--rule", "own_rule:stay_low", "--no-plots")
    # The rule holds it below waypoints that lie higher, so that it need not arrive.
    assert clearway("fly", "short.toml", *options, cwd=folder).exit_code in (0, 1)
    text = (folder / "clearway-out" / "short" / "mission.toml").read_text()
    assert f'name = "{folder}/own_rating.py:wary"' in text
    assert f'own = ["{folder}/own_rule.py:stay_low"]' in text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("fly", "short.toml", "--planner", "brokn:make"), "did you mean 'broken'?"),
        (("fly", "short.toml", "--planner", "nowhere:make"), "no module 'nowhere' in"),
        (("fly", "short.toml", "--planner", "own_planner:mak"), "did you mean 'make'?"),
        (("fly", "short.toml", "--planner", "own_planner:AHEAD_M"), "no function but float"),
        (("fly", "short.toml", "--planner", "own_planner:swerve"), "called with (craft)"),
        (("fly", "short.toml", "--planner", "broken:of_nothing"), "called with (craft)"),
        (("fly", "short.toml", "--planner", "broken:forgetful"), "a Manoeuvre is needed (clearway"),
        (("fly", "short.toml", "--planner", "broken:mistaken"), "'Sideways'; at least"),
        (("fly", "short.toml", "--planner", "broken:late"), "RuntimeError: out of ideas"),
        (("compare", "forest", "--planners", "clearway,broken:late"), "broken.py, line 13"),
        (("encounters", "--planners", "broken:late", "--count", "2"), "RuntimeError: out of ideas"),
        (("fly", "short.toml", "--rating", "own_rating:wari"), "rating.name: rating own_rat"),
        (("fly", "short.toml", "--rule", "own_rule:LOW_M"), "rules.own[0]: rule own_rule"),
        (("fly", "mission.toml"), "without standing, sigma_m"),
        (("fly", "other.toml"), "unexpected keyword argument 'colour'"),
    ],
)
def test_what_is_wrong_with_own_parts_is_told_without_a_traceback(
    folder: Path, arguments: tuple[str, ...], said: str
) -> None:
    head = '[mission]\nname = "m"\nwaypoints_m = [[20, 0, 0]]\n[[sensor]]\n'
    (folder / "mission.toml").write_text(head + 'kind = "pathlib:Path"\n')
    (folder / "other.toml").write_text(
        head + 'kind = "own_sensor:Radar"\nsettings = { colour = "red" }\n'
    )
    done = clearway(*arguments, cwd=folder)
    assert done.exit_code == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr
