"""The decisions of a flight: as they were taken, or packed where these would fill the memory."""

from __future__ import annotations

from dataclasses import replace
from typing import Generic

from clearway.avoidance.past import bytes_of, past
from clearway.live import FlightDecision
from clearway.sim.pilot import D
from clearway.sim.run import LoggedDecision

MOST_BYTES = 32 * 1024 * 1024
"""Of decisions that are kept whole: those of a flight of a minute or two among walls, of more than
that in the open."""


class Logbook(Generic[D]):
    """Takes decisions one by one. Once they hold more than so many bytes, all but the last are
    packed: kept for a while and freed then, they would leave holes in the memory."""

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._entries: list[LoggedDecision[D]] = []
        self._packed, self._left = 0, most_bytes

    def add(self, entry: LoggedDecision[D]) -> None:
        """Keep a decision."""
        flight = entry.flight
        if isinstance(flight, FlightDecision):
            self._left -= bytes_of(flight.decision)
        if self._left < 0:
            for at in range(self._packed, len(self._entries)):
                self._entries[at] = _pack(self._entries[at])
            self._packed = len(self._entries)
        self._entries.append(entry)

    @property
    def entries(self) -> tuple[LoggedDecision[D], ...]:
        """In the order of flight."""
        return tuple(self._entries)


def _pack(entry: LoggedDecision[D]) -> LoggedDecision[D]:
    flight = entry.flight
    if not isinstance(flight, FlightDecision):
        return entry
    return replace(entry, flight=replace(flight, decision=past(flight.decision)))
