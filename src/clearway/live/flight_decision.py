"""A decision as flight has it: with the mission's mode, in words, and with what was left out."""

from __future__ import annotations

from dataclasses import dataclass

from clearway.avoidance.chosen import Basis
from clearway.avoidance.decide import Decision
from clearway.base.brief import one_line, runs
from clearway.base.notebook import html_table
from clearway.base.state import State
from clearway.live.mission import Mode


@dataclass(frozen=True, eq=False)
class FlightDecision:
    """A decision with the mission's mode and an explanation in words."""

    time_s: float
    mode: Mode
    goal: int
    """Index of the goal flown to."""
    decision: Decision
    explanation: str
    scan_age_s: float
    """Age of the oldest scan used; NaN without any."""
    counts: dict[str, int]
    """Data left out since the last decision, by reason."""

    def __repr__(self) -> str:
        return one_line(
            "FlightDecision",
            (f"{self.time_s:g} s", f"{self.mode}", f"goal {self.goal}", runs(self.movements)),
        )

    def _repr_html_(self) -> str:
        """For notebooks: the decision, with its explanation."""
        return html_table(f"{self.time_s:g} s", {"why": self.explanation}) + (
            self.decision._repr_html_()
        )

    @property
    def state(self) -> State:
        """Own state that was decided for."""
        return self.decision.state

    @property
    def movements(self) -> tuple[str, ...]:
        """The movement buffer to execute."""
        return self.decision.movements


def mode_of(decision: Decision, *, landing: bool, closed: bool = False) -> Mode:
    """The mode that a decision puts the mission in.

    landing: on the points of that sequence. closed: no way leads to the goal as far as is seen.
    """
    if decision.choice.basis is Basis.EMERGENCY:
        return Mode.EMERGENCY
    if decision.escapes:
        return Mode.ESCAPE
    if closed:
        return Mode.HOLD
    if landing:
        return Mode.LANDING
    if decision.choice.ruled_out or decision.choice.below_threshold:
        return Mode.AVOIDANCE
    return Mode.NAVIGATION
