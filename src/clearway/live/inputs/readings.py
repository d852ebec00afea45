"""What may come in."""

from __future__ import annotations

from typing import Any

from clearway.base.errors import ClearwayError, InputError
from clearway.base.state import State
from clearway.sensors import Scan
from clearway.traffic import Intruder

Reading = State | Scan | Intruder

TIME_TOLERANCE_S = 1e-6
"""Times no farther apart are one: seconds since 1970 are reported to a quarter of it."""


NAMES: dict[type, str] = {State: "state", Scan: "scan", Intruder: "intruder"}
"""How counts call what comes in."""


def reading_of(kind: type[Reading], *values: Any, **named: Any) -> Reading | str:
    """A reading of raw values, or in a few words why it cannot be made of them."""
    if not any(kind is known for known in NAMES):
        raise ClearwayError(f"receive: takes State, Scan or Intruder, got {kind!r}")
    try:
        return kind(*values, **named)
    except InputError as refused:
        wrong = ", ".join(problem.partition(":")[0] for problem in refused.problems)
        return f"{NAMES[kind]}: unusable {wrong}"
    except ClearwayError:
        return f"{NAMES[kind]}: unusable"
