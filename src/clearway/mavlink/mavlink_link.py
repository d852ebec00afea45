"""The link that the loop runs: frames in and out of a `MavlinkSession`, bounded and counted."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Generic, TypeVar

from clearway.live.handing import Handing
from clearway.live.link.hearing import Hearing
from clearway.live.link.outcome import TickOutcome
from clearway.mavlink.inbox import Inbox
from clearway.mavlink.links import FrameLink
from clearway.mavlink.mavlink_session import MavlinkSession
from clearway.mavlink.outbox import Outbox

S = TypeVar("S", bound=Hearing)
SAY_AGAIN_S = 5.0


@dataclass(slots=True)
class MavlinkLink(Generic[S]):
    """A `live.link.outcome.Link`."""

    frames: FrameLink
    inbox: Inbox
    session: MavlinkSession[S]
    outbox: Outbox
    handing: Handing = field(default_factory=Handing)
    _strange_s: float = -1e9
    _told: set[str] = field(default_factory=set)

    def hear(self, wall_s: float) -> None:
        for arrival in self.inbox.take(self.frames.receive()):
            if self.session.take(arrival, wall_s):
                self.frames.answer_to(arrival.peer)

    def tick(self, wall_s: float) -> TickOutcome:
        outcome = self.session.tick(wall_s)
        core = self.session.core
        sends = partial(self.outbox.send, outcome.messages)
        outcome = self.handing.send(core, outcome, wall_s, sends)
        return replace(outcome, notes=(*outcome.notes, *self._strangers(wall_s)))

    def wait(self, seconds: float) -> None:
        self.frames.wait(seconds)

    def end(self, *, crashed: bool = False) -> None:
        self.handing.end(self._farewell, crashed=crashed)

    def _farewell(self) -> None:
        self.outbox.send(self.session.farewell(time.monotonic()))

    def close(self) -> None:
        self.frames.close()

    def _strangers(self, wall_s: float) -> list[str]:
        """What comes that is not for us: each said once, or while nothing better comes."""
        said = [words for words in self.inbox.warnings if words not in self._told]
        self._told.update(said)
        if self.session.core.status is None and wall_s - self._strange_s >= SAY_AGAIN_S:
            self._strange_s = wall_s
            said += self.inbox.strangers()
        return said
