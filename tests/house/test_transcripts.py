"""Transcripts of pages are what their commands print."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest
from tools.transcripts import WIDTH, differences, filled, pages

from in_process import clearway
from repository import REPOSITORY


def in_this_process(words: Sequence[str], folder: Path) -> tuple[str, str]:
    done = clearway(*words, cwd=folder)
    return done.stdout, done.stderr


def test_there_are_pages_with_transcripts() -> None:
    assert len(pages()) >= 6


@pytest.mark.parametrize("page", pages(), ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_a_page_shows_what_its_commands_print(
    page: Path, samples: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", WIDTH)
    text = pages()[page]
    made = filled(text, samples, in_this_process)
    assert differences(text, made) == [], "run python -m tools.transcripts --write"


def test_a_last_digit_may_differ_and_nothing_else() -> None:
    shown = "reached  yes\nnearest  0.75 m of 0.6 m\n"
    assert differences(shown, shown.replace("0.75", "0.76")) == []
    assert differences(shown, shown.replace("0.75", "0.77")) != []
    assert differences(shown, shown.replace("yes", "no")) != []
    assert differences(shown, f"{shown}warning\n") == ["warning"]
    assert differences(shown, shown.replace("0.75 m", "-")) != []
