"""The public names: at most forty, each told on the page made from docstrings, with an example."""

from __future__ import annotations

import doctest
import subprocess
import sys
from pathlib import Path

import pytest

import clearway
from repository import REPOSITORY

NAMES = [name for name in clearway.__all__ if name != "__version__"]
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE | doctest.IGNORE_EXCEPTION_DETAIL


def test_there_are_at_most_forty() -> None:
    assert len(clearway.__all__) <= 40
    assert len(set(clearway.__all__)) == len(clearway.__all__)


def test_the_page_is_what_the_docstrings_say() -> None:
    made = subprocess.run(
        [sys.executable, "-m", "tools.api"],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    page = (REPOSITORY / "docs" / "api.md").read_text(encoding="utf-8")
    assert made == page, "run python -m tools.api --write"
    assert [name for name in NAMES if f"### `{name}`" not in page] == []


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder like examples/scenes, to write into."""
    place = tmp_path_factory.mktemp("scenes")
    for file in (REPOSITORY / "examples" / "scenes").iterdir():
        (place / file.name).write_bytes(file.read_bytes())
    return place


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_has_an_example_that_runs(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    text = getattr(clearway, name).__doc__
    example = doctest.DocTestParser().get_doctest(text, {}, name, None, None)
    assert example.examples
    told: list[str] = []
    doctest.DocTestRunner(optionflags=OPTIONS).run(example, out=told.append)
    assert not told, "".join(told)
