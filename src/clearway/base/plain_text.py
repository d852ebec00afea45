"""Text for a terminal: no control characters of a file get there, and no message fills it."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence

LONGEST_MESSAGE = 500
"""Characters of a message."""
MOST_LINES = 200
"""Problems of a file that the command line tells; of more, nobody mends the last before the first.
"""
LONGEST_SOURCE = 200
"""Of which a name of a file may take; of a longer one the end, which tells more."""
LONGEST_WORD = 80
"""Of a problem; of a longer one the beginning tells enough."""
NO_NUMBER = re.compile(r"could not convert string to float: (.*)", re.DOTALL)
"""How Python puts it."""
HIDDEN = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Categories of characters that move the cursor, turn the writing round, or are half of one."""


def make_printable(text: str, kept: str = "\n\t") -> str:
    """The text with control characters escaped as Python does, but for those `kept`."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        one
        if one in kept or unicodedata.category(one) not in HIDDEN
        else one.encode("unicode_escape").decode()
        for one in text
    )


def shorten(text: str, length: int) -> str:
    """The text, or its beginning and dots where it is longer."""
    return text if len(text) <= length else text[: max(0, length - 3)] + "..."


def some_lines(text: str, length: int) -> str:
    """The text, or as many of its lines as fit and how many more there are."""
    if len(text) <= length:
        return text
    lines = text.split("\n")
    told, room = [shorten(lines[0], length - 20)], length - 20
    for line in lines[1:]:
        if sum(map(len, told)) + len(told) + len(line) > room:
            break
        told.append(line)
    left = len(lines) - len(told)
    if left:
        told.append(f"and {left} more {'line' if left == 1 else 'lines'}")
    return "\n".join(told)


def in_full(source: str, problems: Sequence[str]) -> str:
    """One line a problem, "source: problem", none longer than a message; the rest is counted."""
    if len(problems) < 2:
        return shorten_problems(source, problems)
    lines = [shorten_problems(source, [problem]) for problem in problems[:MOST_LINES]]
    left = len(problems) - len(lines)
    return "\n".join([*lines, f"{source}: and {left} more"] if left else lines)


def shorten_problems(source: str, problems: Sequence[str]) -> str:
    """One line a problem, "source: problem", as many as fit; then how many more there are.

    Of problems, which may be a million, only what fits is looked at; control characters of theirs
    are escaped.
    """
    if len(source) > LONGEST_SOURCE:
        source = "..." + source[3 - LONGEST_SOURCE :]
    lines = [f"{source}: {_in_plain_words(problem)}" for problem in problems[:LONGEST_MESSAGE]]
    if len(problems) <= LONGEST_MESSAGE and len(whole := "\n".join(lines)) <= LONGEST_MESSAGE:
        return whole
    room = LONGEST_MESSAGE - len(f"\n{source}: and {len(problems)} more")
    told: list[str] = []
    for line in lines:
        if told and sum(map(len, told)) + len(told) + len(line) > room:
            break
        told.append(line)
    left = len(problems) - len(told)
    if left:
        return "\n".join([shorten(told[0], room), *told[1:], f"{source}: and {left} more"])
    return shorten(told[0], LONGEST_MESSAGE)


def _in_plain_words(problem: str) -> str:
    """A problem with short words, without control characters."""
    said = NO_NUMBER.sub(r"\1 is no number", make_printable(problem))
    return re.sub(rf"\S{{{LONGEST_WORD + 1},}}", _cut, said)


def _cut(word: re.Match[str]) -> str:
    """The beginning of a long word and what ends it; paths stay whole."""
    whole = word[0]
    if "/" in whole:
        return whole
    return f"{whole[: LONGEST_WORD // 2]}...{whole[len(whole.rstrip(',;:)')) :]}"
