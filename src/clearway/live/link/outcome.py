"""What a tick of a session came to, and the link that the loop runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from clearway.live.link.approach import PredictedApproach
from clearway.live.link.guarded import Guarded
from clearway.live.link.link_state import LinkState
from clearway.live.link.set_point import SetPoint
from clearway.live.outputs.flight_decision import FlightDecision


@dataclass(frozen=True, slots=True, eq=False)
class TickOutcome:
    """What a tick came to."""

    time_s: float
    """The vehicle's time."""
    state: LinkState
    flight: FlightDecision | None
    """The decision, if one was due."""
    why_now: str
    elapsed_s: float
    """That the decision took."""
    set_point: SetPoint | None
    """What is sent, or would be."""
    approaches: tuple[PredictedApproach, ...]
    why_state: str = ""
    """More on the state, where there is more to say."""
    messages: tuple[object, ...] = ()
    """What the link sends for it, in this order."""
    notes: tuple[str, ...] = ()
    """What the observer is told now."""
    guarded: Guarded | None = None
    """What a guardian says, where one was asked."""
    wished: object = None
    """The message that wished it, where it passes unchanged."""


class Link(Protocol):
    """A way to a vehicle, as the loop runs it: MAVLink, ROS 2, a recording."""

    def hear(self, wall_s: float) -> None:
        """Tell the session all that has come; never waits."""
        ...

    def tick(self, wall_s: float) -> TickOutcome:
        """Ask the session, and send what it says."""
        ...

    def wait(self, seconds: float) -> None:
        """Until something comes, but no longer."""
        ...

    def end(self, *, crashed: bool = False) -> None:
        """Say what is said last: to hold, where the vehicle was led. crashed: leave it to the
        second process instead, where there is one."""
        ...

    def close(self) -> None: ...
