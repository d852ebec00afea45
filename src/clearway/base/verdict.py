"""What an interval shows of a demand: judged by the end that counts against us."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum


class DemandVerdict(StrEnum):
    """What may be stated of a demand."""

    SHOWN = "shown"
    """All of the interval meets it."""
    NOT_SHOWN = "not shown"
    """Some of the interval does not: more flights, or better ones, are needed."""
    MISSED = "missed"
    """None of the interval meets it."""


def at_most(low: float, high: float, limit: float) -> DemandVerdict:
    """Of a figure that must not exceed a limit; ends that are no numbers show nothing."""
    if high <= limit:
        return DemandVerdict.SHOWN
    return DemandVerdict.MISSED if low > limit else DemandVerdict.NOT_SHOWN


def judge_at_least(low: float, high: float, need: float) -> DemandVerdict:
    """Of a figure that must not fall below a need; ends that are no numbers show nothing."""
    if low >= need:
        return DemandVerdict.SHOWN
    return DemandVerdict.MISSED if high < need else DemandVerdict.NOT_SHOWN


def worst_of(verdicts: Iterable[DemandVerdict]) -> DemandVerdict:
    """Missed where any is, else not shown where any is; not shown without any."""
    found = set(verdicts)
    if DemandVerdict.MISSED in found:
        return DemandVerdict.MISSED
    return DemandVerdict.SHOWN if found == {DemandVerdict.SHOWN} else DemandVerdict.NOT_SHOWN
