"""Hand-written pages are short, in short active sentences, and in the field's words."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from repository import GENERATED_PAGES, REPOSITORY

DOCS = REPOSITORY / "docs"
TOP = [
    REPOSITORY / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")
]
WRITTEN = [
    *TOP,
    *(
        page
        for page in sorted(DOCS.rglob("*.md"))
        if page.name not in GENERATED_PAGES and "results" not in page.parts
    ),
]
LINES, LINES_OF = 150, {"README.md": 110, "CHANGELOG.md": 100}
MEAN_WORDS, RARE_WORDS, MOST_WORDS = 18.0, 25, 38
RARE_SHARE = 0.1
"""Of a page's sentences those that may be longer than RARE_WORDS."""

FORBIDDEN = {
    r"\b(?:is|are|was|were|be|been|being) (?:also |not )?(?:said|told)\b": "name who reports",
    r"(?:^|[.?!] |\| )Who(?:ever)?\b(?![^.|]*\?)|\bwhoever\b": "a vehicle, a pilot, a program",
    r"\bin hand\b": "held",
    r"\bways? out\b": "escape",
    r"\b(?:coats?|coating)\b|(?<!\")\bcoated\b(?! in the paper|\")": "inflated",
    r"\bunseen\b|\bnobody has (?:seen|looked)\b": "unobserved space",
    r"\blikewise\b": "repeat the noun",
    r"\bthe same(?=[.,;:)])": "repeat the noun",
    r"(?:^|[.?!] |\| )Those\b": "repeat the noun",
    r"\bheard of\b": "detected, reported",
    r"\bheld against\b": "checked against",
    r"\bdearer\b": "more expensive, higher cost",
    r"\bprices?\b|\bpriced\b": "cost, cost weight",
    r"\bown (?:place|states?)\b(?! estimates?)": "own position, state estimate",
    r"\baside\b": "lateral",
    r"\bin vain\b|\bstuck\b": "no progress, recovery",
    r"\binsist(?:s|ed|ence)?\b|\bboldness\b": "risk level",
    r"\bmovers?\b": "moving obstacles",
    r"\baloof\b": "standoff",
    r"\bequal ones\b": "effective sample size",
    r"\bby turns\b|\bthe version before\b": "what holds now",
    r"\b20\d\d-\d\d-\d\d\b": "dates stand in results",
}
"""What is not written, and what is written instead."""


MESSAGES = REPOSITORY / "src" / "clearway"
REFERENCE = DOCS / "missions.md"


def prose(text: str) -> str:
    """What people wrote of a page: without code, generated parts, pictures and targets of links."""
    text = re.sub(r"<!-- ([\w-]+):begin -->.*?<!-- \1:end -->", "", text, flags=re.DOTALL)
    text = re.sub(r"^ *```.*?^ *```$", "\n", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"<!--.*?-->|!\[[^\]]*\]\([^)]*\)", "", text, flags=re.DOTALL)
    text = re.sub(r'\[([^\]]+)\]\([^)\s]+(?: "[^"]*")?\)', r"\1", text)
    return re.sub(r"`[^`]*`", "`code`", text).replace("*", "")


def paragraphs(text: str) -> Iterator[str]:
    """Paragraphs and items of lists, each in one line; headings and tables are none."""
    lines: list[str] = []
    for line in [*prose(text).splitlines(), ""]:
        begins = re.match(r" *(?:- |\d+\. |> )", line)
        if begins or not line.strip() or line.startswith(("#", "|")):
            if lines:
                yield " ".join(lines)
            lines = []
        if line.strip() and not line.startswith(("#", "|")):
            lines.append(line[begins.end() :] if begins else line.strip())


def sentences(text: str) -> list[str]:
    """Sentences of a page's paragraphs, in order."""
    found: list[str] = []
    for paragraph in paragraphs(text):
        whole = re.sub(r"\b(figs?|secs?)\. ", r"\1 ", paragraph)
        found += re.split(r"(?<=[.?!]) (?=[A-Z`\"(\d]|clearway\b|pyrvo\b)", whole)
    return found


def length(sentence: str) -> int:
    """The number of words of a sentence."""
    return sum(bool(re.search(r"\w", word)) for word in sentence.split())


def not_our_words(text: str) -> list[str]:
    """Each forbidden pattern of a text, with what to write instead."""
    return [
        f"{found[0].strip()!r}: {instead}"
        for line in prose(text).splitlines()
        for pattern, instead in FORBIDDEN.items()
        for found in re.finditer(pattern, line, re.IGNORECASE if pattern.islower() else 0)
    ]


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_sentences_are_short(page: Path) -> None:
    found = sentences(page.read_text(encoding="utf-8"))
    lengths = [length(one) for one in found]
    assert [one for one in found if length(one) > MOST_WORDS] == []
    assert sum(lengths) / len(lengths) <= MEAN_WORDS
    long = [one for one in found if length(one) > RARE_WORDS]
    assert len(long) <= max(1, RARE_SHARE * len(found)), long


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_pages_are_in_the_field_s_words(page: Path) -> None:
    assert not_our_words(page.read_text(encoding="utf-8")) == []


def test_the_reference_of_missions_is_in_the_field_s_words() -> None:
    assert not_our_words(REFERENCE.read_text(encoding="utf-8")) == []


def test_messages_are_in_the_field_s_words() -> None:
    found = {
        f"{path.relative_to(REPOSITORY)}:{line}": wrong
        for path in sorted(MESSAGES.rglob("*.py"))
        for line, text in messages(path.read_text(encoding="utf-8"))
        if (wrong := not_our_words(text))
    }
    assert found == {}


def messages(code: str) -> Iterator[tuple[int, str]]:
    """Lines and texts of a module's string constants of several words, without docstrings."""
    tree = ast.parse(code)
    alone = {id(one.value) for one in ast.walk(tree) if isinstance(one, ast.Expr)}
    for one in ast.walk(tree):
        constant = isinstance(one, ast.Constant) and id(one) not in alone
        if constant and isinstance(one.value, str) and " " in one.value.strip():
            yield one.lineno, one.value


def test_messages_are_found_and_docstrings_are_not() -> None:
    code = 'def f(x):\n    """It is said."""\n    return f"{x} is said by whom", "one"\n'
    assert list(messages(code)) == [(3, " is said by whom")]


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_pages_are_short(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    text = text.partition("\n## 0.1.0")[0] if page.name == "CHANGELOG.md" else text
    assert len(text.splitlines()) <= LINES_OF.get(page.name, LINES)


@pytest.mark.parametrize(
    "page", [page for page in WRITTEN if page not in TOP], ids=lambda page: page.stem
)
def test_a_page_begins_with_what_it_is_for_and_for_whom(page: Path) -> None:
    first = page.read_text(encoding="utf-8").partition("\n## ")[0]
    assert re.search(r"\bFor \w+|\bis for \w+", prose(first)), "For whom is this page?"


@pytest.mark.parametrize(
    "text",
    [
        "Before take-off it is said where returns are lost.",
        "Who sees nothing for 3 s stays.",
        "The guardian asks whoever flies.",
        "Every decision holds a way out.",
        "It is kept in hand.",
        "Cells are coated by the margin.",
        "The unseen counts as occupied.",
        "It keeps clear of returns, likewise.",
        "Planes do the same.",
        "Those are left out.",
        "It was first heard of at 10 m.",
        "Plans are held against returns.",
        "A longer way is dearer.",
        "The price of no room is 6.",
        "It is told by own states.",
        "It flew 20 m aside.",
        "Measured by turns on 2026-11-22.",
    ],
)
def test_what_is_forbidden_is_found(text: str) -> None:
    assert not_our_words(text)


@pytest.mark.parametrize(
    "text",
    [
        "Who decides?",
        "A pilot who can take over.",
        "The keys are `way_out` and `prices.no_room`.",
        "The same seed gives the same flight.",
        "Own state estimates outside the tube are counted.",
    ],
)
def test_nothing_else_is(text: str) -> None:
    assert not_our_words(text) == []


def test_sentences_and_words_are_counted_as_read() -> None:
    page = (
        '# A title\n\nOne `a b c` of [two](x.md "a/b > c") words. It is\nbroken.\n\n'
        "- An item: 3 m\n  and more.\n\n| a | table |\n\n```sh\nclearway fly\n```\n"
    )
    found = sentences(page)
    assert [length(one) for one in found] == [5, 3, 6]
