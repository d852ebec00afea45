"""What a command may do with a damaged file, and what it may not."""

from __future__ import annotations

import re
from typing import NamedTuple

STATUSES = (0, 1, 2, 3, 130)
LONGEST = 500
"""Characters of a line."""
MOST_LINES = 210
"""Of a message: one a problem, and hints."""
CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
PREPARING = "preparing reach sets"
"""Begins a line that is no message about the file."""


class Outcome(NamedTuple):
    """How a command ended."""

    status: int
    output: str
    errors: str
    """Standard error."""
    warnings: tuple[str, ...] = ()
    raised: str = ""
    """What came out of it besides an exit."""


def faults(outcome: Outcome, names: tuple[str, ...]) -> list[str]:
    """What is wrong with an outcome; names: of the files, one of which a message has to name."""
    found = []
    if outcome.raised:
        found.append(f"raised {outcome.raised}")
    elif outcome.status not in STATUSES:
        found.append(f"status {outcome.status}")
    if "Traceback (most" in outcome.errors or "error inside clearway" in outcome.errors:
        found.append("traceback")
    found += [f"warning {warning}" for warning in outcome.warnings[:3]]
    if "Warning" in outcome.errors or "panicked" in outcome.errors:
        found.append("warning printed")
    for what, text in (("errors", outcome.errors), ("output", outcome.output)):
        if CONTROL.search(text):
            found.append(f"control characters in {what}")
    if outcome.status == 2 and not outcome.raised:
        message = "\n".join(
            line for line in outcome.errors.splitlines() if not line.startswith(PREPARING)
        )
        lines = message.splitlines()
        if len(lines) > MOST_LINES or max(map(len, lines), default=0) > LONGEST:
            found.append(f"message of {len(lines)} lines, {len(message)} characters")
        if not any(name in message for name in names):
            found.append("message names no file")
    elif max(map(len, outcome.errors.splitlines()), default=0) > 2 * LONGEST:
        found.append("note too long")
    return found
