"""Docstrings are in the field's words; those of public functions list their parameters."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import clearway

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
PARAMETERS = re.compile(r"^Parameters\n-{10}\n((?:.+\n| *\n(?!\S+\n-))*)", re.MULTILINE)
MEANT = re.compile(r"^(\S+)\n(?= {4}\S)", re.MULTILINE)
"""A parameter on its own line, with its meaning below."""


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
        if (words := [word for text in docstrings(file) for word in not_our_words(text)])
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


def public_callables() -> Iterator[tuple[str, Callable[..., Any], str]]:
    """Each public function, method, and class with a constructor of its own: name, what is called,
    docstring."""
    for name in clearway.__all__:
        value = getattr(clearway, name)
        if inspect.isfunction(value):
            yield name, value, value.__doc__ or ""
        for ancestor in getattr(value, "__mro__", ()):
            if not ancestor.__module__.startswith("clearway."):
                continue
            source = ast.parse(inspect.getsource(ancestor)).body[0]
            assert isinstance(source, ast.ClassDef)
            for node in source.body:
                if not isinstance(node, ast.FunctionDef):
                    continue
                method = getattr(value, node.name, None)
                if node.name == "__init__":
                    yield name, value, inspect.getdoc(value) or ""
                elif not node.name.startswith("_") and callable(method):
                    yield f"{name}.{node.name}", method, inspect.getdoc(method) or ""


def arguments(called: Callable[..., Any]) -> list[str]:
    """Parameters as a docstring lists them, with their stars, but for self and cls."""
    stars: dict[object, str] = {
        inspect.Parameter.VAR_POSITIONAL: "*",
        inspect.Parameter.VAR_KEYWORD: "**",
    }
    return [
        stars.get(each.kind, "") + each.name
        for each in inspect.signature(called).parameters.values()
        if each.name != "self"
    ]


def listed(docstring: str) -> list[str]:
    """The parameters of the section Parameters that have a meaning, in their order."""
    section = PARAMETERS.search(inspect.cleandoc(docstring) + "\n")
    return MEANT.findall(section[1]) if section else []


def test_public_functions_list_exactly_their_parameters() -> None:
    public = list(public_callables())
    assert len({name for name, _, _ in public}) > 90
    wrong = {
        name: {"has": arguments(called), "lists": listed(text)}
        for name, called, text in public
        if arguments(called) != listed(text)
    }
    assert wrong == {}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("No section.", []),
        (
            "One.\n\nParameters\n----------\nfirst\n    Its meaning.\n*rest\n    More.",
            ["first", "*rest"],
        ),
        ("One.\n\nParameters\n----------\nfirst\nsecond\n    Its meaning.", ["second"]),
        ("One.\n\nParameters\n----------\na\n    b\n\nReturns\n-------\nint\n    c", ["a"]),
        ("first: its meaning in prose.", []),
    ],
)
def test_what_a_section_lists(text: str, found: list[str]) -> None:
    assert listed(text) == found
