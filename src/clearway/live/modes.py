"""What the vehicle is doing: the mode that each decision puts it in, and why it changed.

One small state machine. Every decision asks the guards below in their order, and the first that
holds gives the mode, whatever the mode before was: no mode can be entered that cannot be left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from clearway.avoidance.chosen import Basis
from clearway.avoidance.decide import Decision
from clearway.live.mission import Mission, Mode, Progress


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
    def transition(self) -> str:
        """The change in words; empty where there is none."""
        if not self.changed:
            return ""
        begins = "begins" if self.before is None else f"{self.before} to"
        return f"{begins} {self.mode}: {self.why}"


@dataclass(frozen=True, slots=True)
class Guard:
    """When a mode is entered."""

    mode: Mode
    when: str
    """In words, for the documentation."""
    why: Callable[[Decision, Progress, Mission], str]
    """The reason where it holds at a decision, else empty."""


def _emergency(decision: Decision, _progress: Progress, _mission: Mission) -> str:
    if decision.choice.basis is not Basis.EMERGENCY:
        return ""
    return f"nothing verified keeps {decision.margin_m:.2f} m, nor is a way out in hand"


def _hold(_decision: Decision, progress: Progress, _mission: Mission) -> str:
    return "no way leads to the goal as far as is seen" if progress.closed else ""


def _escape(decision: Decision, _progress: Progress, _mission: Mission) -> str:
    if not decision.escapes:
        return ""
    after = ", ".join(decision.no_way_out)
    return f"no way out after {after}" if after else "nothing else is verified"


def _narrow(decision: Decision, _progress: Progress, _mission: Mission) -> str:
    if not decision.goes_narrow:
        return ""
    return f"no room to turn after {', '.join(decision.no_way_out)}: no guarantee, as allowed"


def _landing(_decision: Decision, progress: Progress, mission: Mission) -> str:
    return "the last waypoint is behind" if progress.landing(mission) else ""


def _avoidance(decision: Decision, _progress: Progress, _mission: Mission) -> str:
    choice = decision.choice
    reasons = [f"{number} by {name}" for name, number in choice.ruled_out_by.items()]
    if choice.below_threshold:
        reasons.append(f"{choice.below_threshold} rated too low")
    if decision.no_way_out:
        reasons.append(f"no way out after {', '.join(decision.no_way_out)}")
    return f"cheaper trajectories ruled out: {', '.join(reasons)}" if reasons else ""


def _navigation(_decision: Decision, _progress: Progress, _mission: Mission) -> str:
    return "the cheapest trajectory is free"


GUARDS = (
    Guard(Mode.EMERGENCY, "nothing verified keeps the margin, no way out is in hand", _emergency),
    Guard(Mode.NARROW, "no room to turn is left, as the mission allows", _narrow),
    Guard(Mode.ESCAPE, "the way out is flown: nothing else leaves one", _escape),
    Guard(Mode.HOLD, "no way leads to the goal as far as is seen", _hold),
    Guard(Mode.LANDING, "the last waypoint is behind", _landing),
    Guard(Mode.AVOIDANCE, "cheaper trajectories are ruled out", _avoidance),
    Guard(Mode.NAVIGATION, "the cheapest trajectory is free", _navigation),
)
"""Asked from first to last; the last always holds."""


def mode_after(
    before: ModeState | None, decision: Decision, progress: Progress, mission: Mission
) -> ModeState:
    """The mode that a decision puts the mission in, with its reason."""
    was = None if before is None else before.mode
    for guard in GUARDS:
        why = guard.why(decision, progress, mission)
        if why:
            return ModeState(guard.mode, why, was)
    raise AssertionError("the last guard always holds")
