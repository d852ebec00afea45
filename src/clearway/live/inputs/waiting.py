"""Readings that wait for the next question, whose time alone tells which of them can be right."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from statistics import median
from typing import NamedTuple

from clearway.base.state import State
from clearway.live.inputs.readings import TIME_TOLERANCE_S, Reading
from clearway.sensors import Scan

MOST_SCANS = 32
MOST_OTHERS = 512
"""Kept until the next question; with more, they tell the time themselves."""


class Ready(NamedTuple):
    """What can be used at a question: own state estimates, scans, then reports, each by time."""

    readings: list[Reading]
    flaws: list[str]
    """Why others cannot."""


class Waiting:
    """Readings since the last question, and those that lie a little ahead of it.

    A reading cannot come before it was taken: one ahead of the question has a wrong clock. A little
    is forgiven; such a reading counts when its time has come, and an own state estimate then is as
    unsure as the vehicle is fast.
    """

    def __init__(self, ahead_s: float) -> None:
        self._ahead_s = ahead_s
        self._readings: list[Reading] = []
        self._early: dict[int, float] = {}  # By identity: how far ahead it lay.
        self._scans = 0

    def put(self, reading: Reading) -> None:
        """Keep a reading until it is asked for."""
        self._readings.append(reading)
        self._scans += isinstance(reading, Scan)

    @property
    def overdue_s(self) -> float | None:
        """A time that most of them agree on, where too many wait for a question; else None."""
        if self._scans <= MOST_SCANS and len(self._readings) - self._scans <= MOST_OTHERS:
            return None
        return median(reading.time_s for reading in self._readings)

    def ready(
        self, now_s: float, own: Callable[[float], float], unsure_mps: float, *, asked: bool = True
    ) -> Ready:
        """Take out what can be used at an own time; `own` turns told times into own ones.

        asked: whether a question tells the time; if not, what lies ahead of it may well be right.
        """
        taken: list[tuple[int, float, Reading]] = []
        kept: list[Reading] = []
        early: dict[int, float] = {}
        flaws = []
        for reading in self._readings:
            time_s = own(reading.time_s)
            ahead_s = time_s - now_s
            if ahead_s <= TIME_TOLERANCE_S:
                waited_s = self._early.get(id(reading), 0.0)
                taken.append((_rank(reading), time_s, _at(reading, time_s, waited_s * unsure_mps)))
            elif not asked:
                kept.append(reading)
            elif ahead_s <= self._ahead_s:
                kept.append(reading)
                early[id(reading)] = max(ahead_s, self._early.get(id(reading), 0.0))
            else:
                flaws.append(f"{_kind(reading)}: from the future")
        self._readings, self._early = kept, early
        self._scans = sum(isinstance(reading, Scan) for reading in kept)
        taken.sort(key=lambda entry: entry[:2])
        return Ready([reading for _, _, reading in taken], flaws)


def _rank(reading: Reading) -> int:
    return 0 if isinstance(reading, State) else 1 if isinstance(reading, Scan) else 2


def _kind(reading: Reading) -> str:
    return ("state", "scan", "intruder")[_rank(reading)]


def _at(reading: Reading, time_s: float, unsure_m: float) -> Reading:
    """The reading in own time; an own state estimate that lay ahead may be off by what was
    flown."""
    if isinstance(reading, State) and unsure_m > 0.0:
        std_m = reading.position_std_m + unsure_m
        return replace(reading, time_s=time_s, position_std_m=std_m)
    return reading if time_s == reading.time_s else replace(reading, time_s=time_s)
