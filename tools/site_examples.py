"""An extension of griffe for the documentation's site: examples of docstrings as blocks of code.

As they stand their `>>>` would be quotes within quotes, and their brackets references.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

EXAMPLE = re.compile(r"((?:^ *>>> .*\n?)(?:^ *\S.*\n?)*)", re.MULTILINE)


class Examples(griffe.Extension):
    """Puts fences round every example, whatever comes of it included."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Called by griffe for every object that it has read."""
        if obj.docstring is not None:
            obj.docstring.value = fenced(obj.docstring.value)


def fenced(text: str) -> str:
    """A docstring with its examples in fences."""
    return EXAMPLE.sub(lambda found: f"```pycon\n{found[1].rstrip()}\n```\n", text)
