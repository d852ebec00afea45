"""The causes of crashes, and the questions to a log that tell them apart (docs/why.md)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from clearway.studies.why.decisions import FlownDecision
from clearway.studies.why.ending import Ending, Event
from clearway.studies.why.evidence import CrashEvidence
from clearway.studies.why.vehicle import Judge


class CrashCause(StrEnum):
    """Why a flight went wrong, as far as its log shows."""

    NONE = "none"
    NOT_RECORDED = "not recorded"
    WRONG_MAP = "wrong map"
    SENSOR_DEAD = "sensor dead"
    UNSEEN = "unseen"
    SEEN_LATE = "seen late"
    UNDECLARED_WIND = "undeclared wind"
    LATE_DECISION = "late decision"
    NO_ESCAPE = "no escape"


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """Everything that is reported of a flight."""

    cause: CrashCause
    ending: Ending
    evidence: CrashEvidence
    decisions: tuple[FlownDecision, ...]
    acted: FlownDecision | None
    """What clearway would have done first of all that leads elsewhere; None where it would not."""
    last_clear: FlownDecision | None
    """Its last decision that keeps clear, after the first sight."""


def find_cause(
    judge: Judge, ending: Ending, evidence: CrashEvidence, decisions: tuple[FlownDecision, ...]
) -> Answer:
    """The first question whose answer is yes names the cause."""
    first_s = evidence.sights[0].time_s if evidence.sights else ending.time_s
    clear = [one for one in decisions if one.time_s >= first_s and one.kept_m > judge.body_m]
    since = [one for one in decisions if one.time_s >= first_s]
    acting = [one for one in since if one.acts]
    leads_on = [one for one in acting if one.kept_m > judge.body_m]
    acted = next(iter(leads_on or acting or clear), None)
    cause = _cause(judge, ending, evidence, escapable=bool(clear))
    return Answer(cause, ending, evidence, decisions, acted, clear[-1] if clear else None)


def _cause(judge: Judge, ending: Ending, evidence: CrashEvidence, *, escapable: bool) -> CrashCause:
    if ending.event is Event.NOTHING and ending.nearest_m < float("inf"):
        return CrashCause.NONE
    if not evidence.readings and not evidence.silent:
        return CrashCause.NOT_RECORDED
    if ending.event is Event.NOTHING:
        return CrashCause.NONE
    if evidence.map_shift is not None or evidence.map_lacks_m is not None:
        return CrashCause.WRONG_MAP
    farthest_m = max((sight.away_m for sight in evidence.sights), default=0.0)
    if farthest_m < judge.needed_m:
        if evidence.silent:
            return CrashCause.SENSOR_DEAD
        unseen = farthest_m <= max(judge.margin_m, judge.body_m)
        return CrashCause.UNSEEN if unseen else CrashCause.SEEN_LATE
    if evidence.drift is not None and evidence.drift.still_air_m >= judge.margin_m:
        return CrashCause.UNDECLARED_WIND
    return CrashCause.LATE_DECISION if escapable else CrashCause.NO_ESCAPE
