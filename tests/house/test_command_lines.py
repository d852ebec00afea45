"""Every command line of the documentation: known to the program, and run on the samples.

What is not run as it stands stands below a comment, `<!-- commands: KIND -->`, that says why:
setup (installs), hardware (a link, a cluster), data (public files: `clearway data`), or long. Its
options are checked all the same; a night run tries long ones, and those on data that are there, on
few flights each.

`CLEARWAY_PROGRAM=/path/to/bin/clearway` runs them by a program that is installed elsewhere, such as
one from a wheel, each in a process of its own that knows nothing of the checkout.
"""

from __future__ import annotations

import itertools
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
from typer.main import get_command

from clearway.cli.app import app
from in_process import Done
from in_process import clearway as clearway_of_checkout
from repository import REPOSITORY

PROGRAM = os.environ.get("CLEARWAY_PROGRAM")

PAGES = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]
KINDS = ("setup", "hardware", "data", "long")
BLOCK = re.compile(
    r"(?:^<!-- commands: (?P<kind>\w+) -->\n)?^ *```(?P<language>\w*)[^\n]*\n(?P<text>.*?)^ *```$",
    re.MULTILINE | re.DOTALL,
)
OTHERS = (
    "echo",
    "pip",
    "make",
    "python",
    "git",
    "cd",
    "export",
    "mkdocs",
    "docker",
    "sudo",
    "source",
)
STUDIES = ("campaign", "compare", "encounters", "risk")
"""They fly more than once: a night run tries them."""
ALWAYS = ("docs/maps.md",)
"""Pages whose lines run in every run of the tests; those of the others in a night run."""
FEW = {
    "automaton measure": "--flights 2 --held-out 1",
    "campaign": "--only */clearway/0 --workers 1",
    "compare": "--seeds 1 --no-plots",
    "encounters": "--count 4 --workers 1",
    "faults": "--flights 1 --workers 1",
    "risk": "--count 4 --workers 1",
}
"""What is added to a long command for a night run; what is said twice counts as said last."""
BESIDE = "clearway.mavlink.simulated"
"""What flies beside the command of the line before."""
DRAWS = ("assess", "compare", "fly", "map", "pursuit", "reach-set", "reproduce")


def clearway(*arguments: object, cwd: Path | None = None) -> Done:
    """The command of the checkout, or of the program that is to be tried."""
    if PROGRAM is None:
        return clearway_of_checkout(*arguments, cwd=cwd)
    words = [PROGRAM, *map(str, arguments)]
    ended = subprocess.run(
        words, cwd=cwd, env=surroundings(), capture_output=True, text=True, check=False
    )
    return Done(ended.returncode, ended.stdout, ended.stderr)


def surroundings() -> dict[str, str]:
    """The environment of processes: without the checkout where a program is to be tried."""
    kept = dict(os.environ)
    if PROGRAM is not None:
        kept.pop("PYTHONPATH", None)
    return kept


def python() -> str:
    """Of the program's environment."""
    return sys.executable if PROGRAM is None else str(Path(PROGRAM).parent / "python")


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
            text = re.sub(r" (?:2>/dev/null|\| grep .*)$", "", text.strip().removeprefix("$ "))
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


def shortened(words: list[str]) -> list[str]:
    """A long command on few flights."""
    if "--curves" in words or "--replay" in words:
        return words
    few = FEW.get(" ".join(words[:2]), FEW.get(words[0], ""))
    return words + few.split()


@pytest.fixture(scope="module")
def prepared(samples: Path) -> Path:
    """The samples, with what commands of the documentation name beside them."""
    results = REPOSITORY / "docs" / "results"
    shutil.copytree(results, samples / "docs" / "results")
    shutil.copy(results / "standard.md", samples / "page.md")
    for name in ("a", "b"):
        words = ("risk", "model.txt", "--vehicle", "copter", "--count", "4", "--workers", "1")
        done = clearway(*words, "--out", name, cwd=samples)
        assert done.exit_code in (0, 1, 3), done.stderr
    clearway("fly", "mixed", "--no-plots", "--out", "flights/mixed", cwd=samples)
    return samples


LONG = [line for line in LINES if line.kind == "long"]


@pytest.mark.nightly
@pytest.mark.parametrize(
    "line",
    [
        one
        for one, after in zip(LONG, [*LONG[1:], None], strict=True)
        if one.words[0] == "clearway" and (after is None or BESIDE not in after.text)
    ],
    ids=lambda line: line.text,
)
def test_long_command_lines_run_on_few_flights(line: Line, prepared: Path) -> None:
    if ".mp4" in line.text and shutil.which("ffmpeg") is None:
        pytest.skip("needs ffmpeg")
    done = clearway(*shortened(line.words[1:]), cwd=prepared)
    assert done.exit_code in (0, 1, 3), f"{line.text}: {done.stderr}"
    assert done.stdout.strip() or done.stderr.strip(), line.text


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("line", "beside"),
    [(one, after) for one, after in itertools.pairwise(LONG) if BESIDE in after.text],
    ids=lambda line: line.text,
)
def test_commands_beside_the_simulated_autopilot_fly(
    line: Line, beside: Line, prepared: Path
) -> None:
    code = "from clearway.cli.app import main; main()"
    companion = subprocess.Popen(
        [python(), "-c", code, *line.words[1:]],
        cwd=prepared,
        env=surroundings(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        words = [python(), *beside.words[1:], "--duration", "40"]
        flown = subprocess.run(
            words, cwd=prepared, env=surroundings(), capture_output=True, text=True, timeout=300
        )
    finally:
        companion.send_signal(signal.SIGINT)
        told = companion.communicate(timeout=60)
    assert flown.returncode in (0, 1), flown.stderr
    assert "nearest" in flown.stdout, flown.stdout + flown.stderr
    assert companion.returncode in (0, 1), told
    assert "Traceback" not in told[1]


@pytest.mark.nightly
@pytest.mark.parametrize(
    "line", [line for line in LINES if line.kind == "data"], ids=lambda line: line.text
)
def test_command_lines_on_public_data_run_where_these_are(
    line: Line, samples: Path, data_dir: Path
) -> None:
    for name in (word for word in line.words if word.endswith(".txt")):
        found = next(iter(data_dir.rglob(name)), None)
        if found is None:
            pytest.skip(f"needs data: {name}")
        shutil.copy(found, samples)
    done = clearway(*shortened(line.words[1:]), cwd=samples)
    assert done.exit_code in (0, 1, 3), f"{line.text}: {done.stderr}"
    assert done.stdout.strip()
