"""Docstrings of modules, classes and functions are in the field's words."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import clearway
from repository import CHANGE_ELSEWHERE

PACKAGE = Path(clearway.__file__).parent
FORBIDDEN = {
    r"\bin hand\b": "held",
    r"\bways? out\b(?! of\b)": "escape",
    r"\bcoat(?:s|ed|ing)?\b": "inflated",
    r"\bunseen\b|\bnobody has (?:seen|looked)\b": "unobserved space",
    r"\bheard of\b": "reported",
    r"\bheld against\b": "checked against",
    r"\bdearer\b": "more expensive",
    r"\bprice[sd]?\b": "cost, cost weight",
    r"\baside\b": "to the side",
    r"\bby turns\b": "interleaved",
    r"\baloof\b": "standoff",
    r"\b[Ww]hoever\b": "the caller, the pilot, the vehicle",
    r"\bown places?\b": "own position",
}
CODE = re.compile(r"`[^`]*`|\"[^\"]*\"|^ *\w+(?:, \w+)*: |(?<=[.;] )\w+: ", re.MULTILINE)
"""Names and what is quoted, and arguments before their meanings."""


def docstrings(file: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield ast.get_docstring(node) or ""


def not_our_words(text: str) -> list[str]:
    """Each forbidden pattern of a docstring, with what to write instead."""
    prose = CODE.sub(" ", text)
    return [
        f"{found[0]!r}: {instead}"
        for pattern, instead in FORBIDDEN.items()
        for found in re.finditer(pattern, prose)
    ]


def test_docstrings_are_in_the_field_s_words() -> None:
    files = {str(file.relative_to(PACKAGE)): file for file in sorted(PACKAGE.rglob("*.py"))}
    assert len(files) > 800
    found = {
        name: words
        for name, file in files.items()
        if not name.startswith(CHANGE_ELSEWHERE)
        and (words := [word for text in docstrings(file) for word in not_our_words(text)])
    }
    assert found == {}


@pytest.mark.parametrize(
    "text",
    [
        "The way out in hand.",
        "A coated cell.",
        "What nobody has seen.",
        "It is heard of.",
        "Plans are held against returns.",
        "A look aside.",
        "Whoever flies.",
    ],
)
def test_what_is_forbidden_is_found(text: str) -> None:
    assert not_our_words(text)


@pytest.mark.parametrize(
    "text",
    ["The shortest way out of a cylinder.", "price: metres off the route.", "As `way_out` says."],
)
def test_nothing_else_is(text: str) -> None:
    assert not_our_words(text) == []
