"""Documentation that cannot drift: generated pages, code as printed, links, pictures."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from tools.format_tables import FLOWN_BY, PARTS, fly_mission_table
from tools.transcripts import differences

from clearway.io.toml import parse_model
from clearway.missions.mission_file import MissionFile
from clearway.missions.samples import COPTER
from clearway.missions.scene_file import SceneFile
from clearway.studies.samples import PLANNER
from clearway.vehicle.automaton import MovementAutomaton
from repository import REPOSITORY

DOCS = REPOSITORY / "docs"
PAGES = [REPOSITORY / "README.md", *sorted(DOCS.rglob("*.md"))]
BLOCK = r"^```{language}\n(.*?)^```$"


def blocks(page: Path, language: str) -> list[str]:
    """Code blocks of a language, in order."""
    pattern = BLOCK.format(language=language)
    return re.findall(pattern, page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def test_the_reference_page_is_what_the_models_say() -> None:
    made = subprocess.run(
        [sys.executable, "-m", "tools.reference"],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert made == (DOCS / "missions.md").read_text(encoding="utf-8"), (
        "run python -m tools.reference --write"
    )


ALL_FLIGHTS = ("results/missions.md", "missions")
BY_DAY = (("copter-columns", "mixed", "intruders-collision"), (FLOWN_BY[0], FLOWN_BY[2]))
"""Of the missions' table what every run of the tests flies: a copter, sensors and map, traffic."""


@pytest.mark.parametrize(
    ("page", "mark"),
    [
        pytest.param(*part, marks=pytest.mark.nightly if part == ALL_FLIGHTS else [])
        for part in PARTS
    ],
)
def test_tables_between_marks_are_what_the_registries_say(page: str, mark: str) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    there = text.partition(f"<!-- {mark}:begin -->\n")[2].partition(f"\n<!-- {mark}:end -->")[0]
    assert differences(there, PARTS[page, mark]()) == [], "run python -m tools.reference --write"


def test_missions_fly_as_their_table_says() -> None:
    there = (DOCS / ALL_FLIGHTS[0]).read_text(encoding="utf-8").splitlines()
    rows = fly_mission_table(*BY_DAY).splitlines()[2:]
    assert len(rows) == 6
    said = {tuple(line.split("|")[1:3]): line for line in there if line.startswith("| `")}
    old = "\n".join(said[tuple(row.split("|")[1:3])] for row in rows)
    assert differences(old, "\n".join(rows)) == [], "run python -m tools.reference --write"


def test_every_key_of_the_reference_has_a_meaning() -> None:
    rows = re.findall(r"^\| `(\w+)` \|(.*)\|$", (DOCS / "missions.md").read_text(), re.MULTILINE)
    assert len(rows) > 100
    assert not [key for key, rest in rows if not rest.split("|")[-1].strip()]


@pytest.mark.parametrize("number", range(len(blocks(REPOSITORY / "README.md", "python"))))
def test_the_readme_s_python_runs_as_printed(
    number: int, capsys: pytest.CaptureFixture[str]
) -> None:
    exec(compile(blocks(REPOSITORY / "README.md", "python")[number], "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert printed == blocks(REPOSITORY / "README.md", "text")[number]
    names = {movement.name for movement in MovementAutomaton.plane().movements}
    flown = re.findall(r"'([\w-]+)'", printed)
    assert flown
    assert set(flown) <= names
    clear = re.search(r"([\d.]+) m clear", printed)
    assert clear is not None
    assert float(clear[1]) >= 0.6


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=lambda page: page.name)
def test_python_of_the_documentation_runs(page: Path, tmp_path: Path) -> None:
    code = "\n".join(blocks(page, "python"))
    if not code:
        return
    ran = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert ran.returncode == 0, ran.stderr


def test_the_planner_shown_is_that_of_the_samples() -> None:
    (shown,) = blocks(DOCS / "tutorials" / "own-planner.md", "python")
    assert PLANNER.partition("\n\n")[2] == shown


def test_the_copter_shown_is_that_of_the_samples() -> None:
    assert blocks(DOCS / "tutorials" / "own-drone.md", "toml") == [COPTER]


def test_the_readme_has_an_example() -> None:
    (example,) = blocks(REPOSITORY / "README.md", "python")
    assert len([line for line in example.splitlines() if line]) <= 12


def test_files_shown_in_the_reference_are_accepted() -> None:
    mission, scene = blocks(DOCS / "missions.md", "toml")
    assert parse_model("page", tomllib.loads(mission), MissionFile).obstacle[0].shape == "ball"
    assert parse_model("page", tomllib.loads(scene), SceneFile).scan is not None


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_relative_links_and_pictures_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)\s]+)(?: \"[^\"]*\")?\)", text)
    lost = []
    for target in targets:
        path, _, anchor = target.partition("#")
        if "://" in path:
            continue
        other = page if not path else (page.parent / path).resolve()
        if not other.exists() or (anchor and anchor not in anchors(other)):
            lost.append(target)
    assert not lost


def anchors(page: Path) -> set[str]:
    """What headings of a page are called in links."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {
        re.sub(r"[^\w\- ]", "", heading).strip().lower().replace(" ", "-") for heading in headings
    }


@pytest.mark.parametrize("picture", sorted(DOCS.glob("images/*")), ids=lambda path: path.name)
def test_pictures_are_small_and_shown(picture: Path) -> None:
    assert picture.stat().st_size < 200_000
    assert any(f"images/{picture.name})" in page.read_text(encoding="utf-8") for page in PAGES)
