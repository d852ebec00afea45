"""What somebody may have meant by a name that there is not."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from itertools import islice
from pathlib import Path

MOST_SEEN = 2_000
"""Names that are compared with: a folder may have any number."""


def did_you_mean(word: str, choices: Iterable[str]) -> str:
    """ " (did you mean 'forest'?)", or nothing where no choice is near; capitals count for nothing.

    A family of worlds keeps its seed: of "forrest:3" the part before the colon is compared.
    """
    near = suggest_nearest(word.partition(":")[0], choices)
    return f" (did you mean {near!r}?)" if near is not None else ""


def suggest_nearest(word: str, choices: Iterable[str]) -> str | None:
    """The choice that is most like a word; None where none is."""
    known = {choice.lower(): choice for choice in islice(choices, MOST_SEEN)}
    close = difflib.get_close_matches(word.lower(), known, n=1)
    return known[close[0]] if close else None


def file_nearby(path: str | Path) -> str:
    """The same of a file that is not there: one of its folder that is called nearly so.

    One of another ending, which is mostly of another kind, only where all else is the same.
    """
    wanted = Path(path)
    try:
        there = [entry.name for entry in islice(wanted.parent.iterdir(), MOST_SEEN)]
    except (OSError, ValueError):
        return ""
    # An ending alone is no likeness: stems are compared.
    alike = {Path(one).stem: one for one in there if Path(one).suffix == wanted.suffix}
    same = (one for one in there if Path(one).stem.lower() == wanted.stem.lower())
    near = suggest_nearest(wanted.stem, alike)
    name = alike[near] if near is not None else next(same, None)
    return "" if name is None else f" (did you mean {str(wanted.with_name(name))!r}?)"
