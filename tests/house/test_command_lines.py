"""Every command line of the documentation: known to the program, and run on the samples.

What cannot be run here stands in a block under a comment, `<!-- commands: KIND -->`, that says why:
setup (installs), hardware (a link, a cluster), data (public files: `clearway data`), or long. Its
options are checked all the same.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import NamedTuple

import pytest
from typer.main import get_command

from clearway.cli.app import app
from in_process import clearway
from repository import REPOSITORY

PAGES = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]
KINDS = ("setup", "hardware", "data", "long")
BLOCK = re.compile(
    r"(?:^<!-- commands: (?P<kind>\w+) -->\n)?^ *```(?P<language>\w*)[^\n]*\n(?P<text>.*?)^ *```$",
    re.MULTILINE | re.DOTALL,
)
OTHERS = ("echo", "pip", "make", "python", "git", "cd", "export", "mkdocs", "docker", "sudo")
STUDIES = ("campaign", "compare", "encounters", "risk")
"""They fly more than once: a night run tries them."""
ALWAYS = ("docs/index.md", "docs/scans.md", "docs/maps.md")
"""Pages whose lines run in every run of the tests; those of the others in a night run."""
DRAWS = ("assess", "compare", "fly", "map", "pursuit", "reach-set", "reproduce")


class Line(NamedTuple):
    """One command of a page."""

    page: str
    kind: str
    """Why it is not run; empty where it is."""
    text: str

    @property
    def words(self) -> list[str]:
        """Without comment, and without the ampersand of the background."""
        return [word for word in shlex.split(self.text, comments=True) if word != "&"]


def lines_of(page: Path) -> list[Line]:
    found = []
    for block in BLOCK.finditer(page.read_text(encoding="utf-8")):
        if block["language"] not in ("sh", "bash", "console", ""):
            continue
        for text in block["text"].replace("\\\n", " ").splitlines():
            if block["language"] == "console" and not text.startswith("$ "):
                continue  # what it prints
            text = text.strip().removeprefix("$ ")
            first = text.split(maxsplit=1)[0] if text else ""
            if first == "clearway" or (block["language"] and first and not first.startswith("#")):
                name = page.relative_to(REPOSITORY).as_posix()
                found.append(Line(name, block["kind"] or "", text))
    return found


LINES = [line for page in PAGES for line in lines_of(page)]


def test_there_are_command_lines_and_the_kinds_are_known() -> None:
    assert len(LINES) > 60
    assert {line.kind for line in LINES} <= {"", *KINDS}
    assert [line for line in LINES if line.words[0] not in ("clearway", *OTHERS)] == []
    assert [line for line in LINES if not line.kind and line.words[0] != "clearway"] == []


@pytest.mark.parametrize(
    "line", [line for line in LINES if line.words[0] == "clearway"], ids=lambda line: line.text
)
def test_the_program_knows_the_command_and_its_options(line: Line) -> None:
    command, words = get_command(app), line.words[1:]
    while hasattr(command, "commands"):
        named = words[0] if words else ""
        if named not in command.commands:
            break
        command, words = command.commands[named], words[1:]
    command.make_context("clearway", words).close()


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("samples") / "made"
    done = clearway("sample", folder)
    assert done.exit_code == 0, done.stderr
    return folder


RUN = [line for line in LINES if not line.kind]
QUICK = [line for line in RUN if line.words[1] not in STUDIES]


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=[] if page in ALWAYS else [pytest.mark.nightly])
        for page in sorted({line.page for line in QUICK})
    ],
)
def test_command_lines_run_on_the_samples(page: str, samples: Path) -> None:
    """In the order of the page: later lines may use what earlier ones wrote."""
    for line in dict.fromkeys(one for one in QUICK if one.page == page):
        run(line, samples)


@pytest.mark.nightly
@pytest.mark.parametrize("page", sorted({line.page for line in RUN if line not in QUICK}))
def test_all_command_lines_run_on_the_samples(page: str, samples: Path) -> None:
    for line in dict.fromkeys(one for one in RUN if one.page == page):
        run(line, samples)


def run(line: Line, folder: Path) -> None:
    words = line.words[1:]
    more = ["--no-plots"] if words[0] in DRAWS and "--no-plots" not in words else []
    if words[0] == "replay" and "--html" not in words:
        more = ["--html", "page.html"]  # instead of serving it until somebody ends it
    done = clearway(*words, *more, cwd=folder)
    # Too few encounters show nothing, and a planner of one's own may hit something.
    assert done.exit_code in (0, 1, 3), f"{line.text}: {done.stderr}"
    assert done.stdout.strip() or "--html" in more + words, line.text
