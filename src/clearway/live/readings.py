"""What may come in, and how long it counts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from clearway.base.checks import found, number_problem, take_floats
from clearway.base.errors import ClearwayError, InputError
from clearway.base.state import State
from clearway.sensors import Scan
from clearway.traffic import Intruder

Reading = State | Scan | Intruder

TIME_TOLERANCE_S = 1e-6
"""Times no farther apart are one: seconds since 1970 are told to a quarter of it."""


NAMES: dict[type, str] = {State: "state", Scan: "scan", Intruder: "intruder"}
"""How counts call what comes in."""


def reading_of(kind: type[Reading], *values: Any, **named: Any) -> Reading | str:
    """A reading of raw values, or in a few words why it cannot be made of them."""
    try:
        return kind(*values, **named)
    except InputError as refused:
        wrong = ", ".join(problem.partition(":")[0] for problem in refused.problems)
        return f"{NAMES[kind]}: unusable {wrong}"
    except ClearwayError:
        return f"{NAMES[kind]}: unusable"


@dataclass(frozen=True, slots=True)
class DataLimits:
    """How old data may be, and how long things are kept; raises InputError below 0 and for NaN."""

    state_s: float = 1.5
    """Own state; an older one is used, counted, and widens the margin."""
    scan_s: float = 3.0
    """Scans; without a fresh one the sensor's columns count as unseen."""
    intruder_s: float = 10.0
    """Intruder reports."""
    ahead_s: float = 0.25
    """Readings that lie farther ahead of the question have a wrong clock; nearer ones wait."""
    history_s: float = 10.0
    """Own states, and movements flown, are kept for so long: late scans are placed by them."""
    memory_s: float = 120.0
    """Points out of reach are remembered so long after they were last seen; in reach, for ever."""
    patience_turns: float = 1.5
    """Full circles' worth of time without progress before a detour."""

    def __post_init__(self) -> None:
        keys = self.__slots__
        problems = found(number_problem(key, getattr(self, key), 0.0, math.inf) for key in keys)
        if problems:
            raise InputError("data limits", problems)
        take_floats(self, DataLimits)
