"""What the vehicle is doing: the mode that each decision puts it in, and why it changed.

One small state machine. Every decision asks the guards below in their order, and the first that
holds gives the mode, whatever the mode before was: no mode can be entered that cannot be left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.decision import Decision
from clearway.live.mission import Mission, Mode, Progress
from clearway.live.outputs.explain import NOT_REACHABLE

NOTHING_SENSED = "no sensor has told anything"
NO_WAY = "no way leads to the goal as far as is seen"


@dataclass(frozen=True, slots=True)
class ModeState:
    """The mode since a decision, and why it is that one."""

    mode: Mode
    why: str
    before: Mode | None = None
    """The mode of the decision before; None at the first one."""

    @property
    def changed(self) -> bool:
        """Whether this decision changed it; the first one does."""
        return self.mode is not self.before

    @property
    def held(self) -> str | None:
        """Why the vehicle only holds; None in other modes."""
        if self.mode is not Mode.HOLD:
            return None
        if self.why.startswith(NOTHING_SENSED):
            return self.why
        return NOT_REACHABLE + self.why.removeprefix(NO_WAY)

    @property
    def transition(self) -> str:
        """The change in words; empty where there is none."""
        if not self.changed:
            return ""
        begins = "begins" if self.before is None else f"{self.before} to"
        return f"{begins} {self.mode}: {self.why}"


class ModeFacts(NamedTuple):
    """What the guards look at."""

    decision: Decision
    progress: Progress
    mission: Mission
    blind_s: float | None = None
    """For how long no sensor has told anything, where escapes rest on that; None while one does."""
    bold: bool = False
    """Whether escapes that were insisted on are asked for no more."""
    searched: str = ""
    """Where ways to the goal are looked for, in words."""


@dataclass(frozen=True, slots=True)
class Guard:
    """When a mode is entered."""

    mode: Mode
    when: str
    """In words, for the documentation."""
    why: Callable[[ModeFacts], str]
    """The reason where it holds at a decision, else empty."""


def _emergency(facts: ModeFacts) -> str:
    decision = facts.decision
    if decision.choice.basis is not Basis.EMERGENCY:
        return ""
    return f"nothing verified keeps {decision.margin_m:.2f} m, and no escape is held"


def _hold(facts: ModeFacts) -> str:
    way = facts.decision.way_out
    if facts.blind_s is not None and way is not None:
        looked = way.certain and way.unobserved_m == 0.0
        where = "where it has looked" if looked else "where it is"
        return f"{NOTHING_SENSED} for {facts.blind_s:.1f} s: it stays {where}"
    if not facts.progress.closed:
        return ""
    return f"{NO_WAY}: {facts.searched}" if facts.searched else NO_WAY


def _escape(facts: ModeFacts) -> str:
    if not facts.decision.escapes:
        return ""
    after = ", ".join(facts.decision.no_way_out)
    blind = facts.blind_s is not None and facts.decision.way_out is not None
    if blind or (facts.progress.closed and not after):
        return ""  # Where no way leads on, or nobody sees one, a way out is what it stays in.
    return f"no escape after {after}" if after else "nothing else is verified"


def _narrow(facts: ModeFacts) -> str:
    decision = facts.decision
    if facts.bold:
        return "trajectories that leave an escape make no progress: no guarantee, as allowed"
    if not decision.goes_narrow:
        return ""
    return f"no space to turn after {', '.join(decision.no_way_out)}: no guarantee, as allowed"


def _landing(facts: ModeFacts) -> str:
    return "the last waypoint is behind" if facts.progress.landing(facts.mission) else ""


def _avoidance(facts: ModeFacts) -> str:
    decision, choice = facts.decision, facts.decision.choice
    reasons = []
    if not choice.is_first:
        reasons = [f"{number} by {name}" for name, number in choice.ruled_out_by.items()]
    if choice.below_threshold:
        reasons.append(f"{choice.below_threshold} rated too low")
    if decision.no_way_out:
        reasons.append(f"no escape after {', '.join(decision.no_way_out)}")
    return f"cheaper trajectories ruled out: {', '.join(reasons)}" if reasons else ""


def _navigation(_facts: ModeFacts) -> str:
    return "the cheapest trajectory is free"


GUARDS = (
    Guard(Mode.EMERGENCY, "nothing verified keeps the margin, and no escape is held", _emergency),
    Guard(Mode.NARROW, "what leaves no escape is flown, as the mission allows", _narrow),
    Guard(Mode.ESCAPE, "the held escape is flown: nothing else leaves one", _escape),
    Guard(Mode.HOLD, f"{NO_WAY}, or nothing is seen", _hold),
    Guard(Mode.LANDING, "the last waypoint is behind", _landing),
    Guard(Mode.AVOIDANCE, "cheaper trajectories are ruled out", _avoidance),
    Guard(Mode.NAVIGATION, "the cheapest trajectory is free", _navigation),
)
"""Asked from first to last; the last always holds."""


def mode_after(before: ModeState | None, facts: ModeFacts) -> ModeState:
    """The mode that a decision puts the mission in, with its reason."""
    was = None if before is None else before.mode
    for guard in GUARDS:
        why = guard.why(facts)
        if why:
            return ModeState(guard.mode, why, was)
    raise AssertionError("the last guard always holds")
