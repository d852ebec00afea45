"""Numbers that nothing has are refused by every command where its options are read."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args, get_type_hints

import pytest
from typer.main import get_command

from clearway.cli.app import app
from in_process import clearway


def _commands(command: Any, words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    if words and command.callback is not None:
        yield words, command
    for name, one in getattr(command, "commands", {}).items():
        yield from _commands(one, (*words, name))


def _needed(command: Any) -> list[str]:
    """Some value for every argument and option that may not be left out."""
    needed = [param.opts[0] for param in command.params if param.required]
    return [f"{name}=x" if name.startswith("--") else "x" for name in needed]


def _options(kind: type) -> list[tuple[str, ...]]:
    """Every option of a kind of number, with its command and what that needs before it."""
    return [
        (*words, *_needed(command), param.opts[0])
        for words, command in _commands(get_command(app))
        for param in command.params
        if param.opts[0].startswith("--")
        and kind in (hint := get_type_hints(command.callback).get(param.name), *get_args(hint))
    ]


@pytest.mark.parametrize("words", _options(float), ids=" ".join)
def test_what_is_no_number_or_absurd_is_refused(words: tuple[str, ...]) -> None:
    for value in ("nan", "inf", "-inf", "1e300"):
        done = clearway(*words[:-1], f"{words[-1]}={value}")
        assert done.exit_code == 2
        assert words[-1] in done.stderr, done.stderr


@pytest.mark.parametrize("words", _options(int), ids=" ".join)
def test_whole_numbers_beyond_all_are_refused(words: tuple[str, ...]) -> None:
    done = clearway(*words[:-1], f"{words[-1]}={10**40}")
    assert done.exit_code == 2
    assert words[-1] in done.stderr, done.stderr


def test_all_numbers_are_looked_at() -> None:
    assert len(_options(float)) > 30
    assert len(_options(int)) > 30
