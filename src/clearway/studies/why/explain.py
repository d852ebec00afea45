"""A log's whole answer, by one call."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from clearway.io.flights.recorded import RecordedFlight
from clearway.missions.setup import Notice
from clearway.studies.why.causes import Answer, find_cause
from clearway.studies.why.decisions import decide_along
from clearway.studies.why.ending import Event, find_ending
from clearway.studies.why.evidence import gather_evidence
from clearway.studies.why.opening import open_flight
from clearway.studies.why.vehicle import Judge, judge_of
from clearway.studies.why.views import PlacedReading, decisive_readings


class Explained(NamedTuple):
    """A flight, whose eyes it was judged by, and the answer."""

    flight: RecordedFlight
    judge: Judge
    seen: tuple[PlacedReading, ...]
    answer: Answer

    @property
    def start_s(self) -> float:
        """When the flight's clock begins: its first pose."""
        return float(self.flight.track.time_s[0])


def explain_flight(
    path: Path, mission: Path | None = None, notice: Notice | None = None
) -> Explained:
    """Why the flight of a log went wrong.

    Raises InputError naming the file and what is wrong with it, MissingExtraError without the
    package that reads it.
    """
    flight = open_flight(path)
    judge = judge_of(flight, mission, notice)
    ending = find_ending(flight, judge)
    seen = decisive_readings(flight, ending.time_s)
    evidence = gather_evidence(flight, judge, ending, seen)
    asked = ending.event is not Event.NOTHING and bool(evidence.sights)
    sight_s = evidence.sights[0].time_s if asked else None
    decisions = decide_along(flight, judge, ending, seen, sight_s)
    return Explained(flight, judge, seen, find_cause(judge, ending, evidence, decisions))
