"""Hands the escape of every decision to the second process, and asks it for the word to speak."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from clearway.hand.hand import RELIEVED, Hand, NoHand
from clearway.hand.handover import HandOver, Packet, Scheduled
from clearway.live.link.hearing import Hearing
from clearway.live.link.link_state import LinkState
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.set_point import SetPoint

RENEWED_S = 0.5
"""An escape is handed over again after so long: clocks and leads are learned meanwhile."""
FLOWN = "decider silent, its escape is flown"
ENDED = "escape flown, set-points stop"
NOT_FLOWN = "decider silent, no escape is flown"
TURNED_OFF = "no second process: if this one dies, nobody flies its escape"
NO_SIMULATED_TIME = "no second process: where the vehicle's time stands still, nothing is late"
NO_ESCAPE = "no escape was held"
NOT_LED = "the vehicle was not led"


class Says(NamedTuple):
    """What the second process says, encoded."""

    begins: tuple[Packet, ...] = ()
    over: tuple[Packet, ...] = ()
    nothing: tuple[Packet, ...] = ()


@dataclass(slots=True)
class Encoding:
    """How a link says things ahead of their time."""

    set_points: Callable[[Sequence[tuple[float, SetPoint]]], list[tuple[Packet, ...]]]
    """The messages of set-points by the vehicle's times."""
    says: Callable[[float], Says]
    """By the vehicle's time."""
    peer: Callable[[], tuple[str, int] | None] = lambda: None
    leads: Callable[[], bool] = lambda: True
    """Whether the link sends set-points now, beyond what the session knows."""


@dataclass(slots=True)
class Handing:
    """A link's way to the second process; without one, everything is sent at once."""

    hand: Hand = field(default_factory=NoHand)
    encoding: Encoding | None = None
    period_s: float = 0.1
    """Between two set-points, by the vehicle's clock."""
    _handed_s: float = -math.inf
    _held: bool = False

    def send(
        self,
        session: Hearing,
        outcome: TickOutcome,
        wall_s: float,
        send: Callable[[], None],
    ) -> TickOutcome:
        """Hand over what an outcome holds, then send what it says; relieved where it may not."""
        self.hand.hand_over(self._new(session, outcome, wall_s))
        if self.hand.speak(send):
            if self.hand.wants_all:
                self.hand.hand_over(self._new(session, outcome, wall_s))
            return outcome
        if not self.hand.relieved:
            return outcome
        return replace(outcome, state=LinkState.RELIEVED, why_state=RELIEVED)

    def end(self, farewell: Callable[[], None], *, crashed: bool) -> None:
        """Send what is stated last, and have nothing flown any more; crashed: have the escape
        flown, if there is anybody to fly it."""
        if crashed and self.hand.leave():
            return
        self.hand.speak(farewell)
        self.hand.end()

    def _new(self, session: Hearing, outcome: TickOutcome, wall_s: float) -> HandOver | None:
        """What to hand over; None where what is held still holds."""
        encoding = self.encoding
        if encoding is None:
            return None
        point = outcome.set_point if encoding.leads() else None
        decided = outcome.flight is not None or outcome.guarded is not None
        holds = point is not None and session.terms.act
        is_old = wall_s - self._handed_s >= RENEWED_S
        if not (decided or is_old or holds is not self._held or self.hand.wants_all):
            return None
        self._held, self._handed_s = holds, wall_s
        speedup = session.terms.speedup or 1.0
        ahead = session.escape_ahead(point, self.period_s)
        packets = encoding.set_points([(outcome.time_s + s, one) for s, one in ahead])
        said = encoding.says(outcome.time_s)
        moments = tuple(
            Scheduled(wall_s + one.later_s / speedup, each)
            for one, each in zip(ahead, packets, strict=True)
        )
        why_none = "" if moments else NO_ESCAPE if holds else NOT_LED
        vehicle_s = outcome.time_s - wall_s
        return HandOver(moments, why_none, encoding.peer(), vehicle_s, *said)
