"""Names of files and folders that are empty are refused by every command, before any work."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_type_hints

import pytest
from typer.main import get_command

from clearway.cli.app import app
from in_process import clearway
from own_process import run_clearway


def _places(command: Any, words: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Every option and argument that is a path, after the words of its command."""
    if words and command.callback is not None:
        hints = get_type_hints(command.callback)
        for param in command.params:
            if "Path" in str(hints.get(param.name)):
                yield (*words, param.opts[0])
    for name, one in getattr(command, "commands", {}).items():
        yield from _places(one, (*words, name))


PLACES = list(_places(get_command(app)))


@pytest.mark.parametrize("words", PLACES, ids=" ".join)
def test_an_empty_name_is_refused(words: tuple[str, ...], tmp_path: Path) -> None:
    *command, name = words
    ways = ([f"{name}="], [name, ""]) if name.startswith("--") else ([""],)
    for way in ways:
        done = clearway(*command, *way, cwd=tmp_path)
        assert done.exit_code == 2
        assert "it names nothing; this folder is ." in done.stderr, done.stderr
        assert name.startswith("--") <= (f"'{name}'" in done.stderr), done.stderr
    assert not list(tmp_path.iterdir())


def test_all_commands_that_leave_files_are_looked_at() -> None:
    assert len([words for words in PLACES if words[-1] == "--out"]) >= 15


def test_this_folder_by_its_name_is_written_into(tmp_path: Path) -> None:
    done = run_clearway("pursuit", "--out", ".", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.glob("*.png"))
    empty = run_clearway("pursuit", "--out", "", cwd=tmp_path)
    assert empty.returncode == 2
    assert "Invalid value for '--out': it names nothing; this folder is ." in empty.stderr
