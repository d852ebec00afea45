"""A decision as flight has it: with the mission's mode, in words, and with what was left out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from clearway.avoidance.decision import Decision
from clearway.base.brief import one_line, runs
from clearway.base.notebook import html_table
from clearway.base.state import State
from clearway.live.mission import Mode
from clearway.live.outputs.alarms import MOST_FALSE, Alarm, say_false
from clearway.live.outputs.alerting import TrafficPicture
from clearway.live.outputs.explain import explanation
from clearway.live.outputs.kept_clearance import KeptClearance
from clearway.live.outputs.modes import NOTHING_SENSED, ModeState
from clearway.obstacles.obstacle_map import ObstacleMap


@dataclass(frozen=True, eq=False)
class FlightDecision:
    """A decision with the mission's mode and an explanation in words."""

    time_s: float
    mode_state: ModeState
    """The mode, why it is that one, and which one it was before."""
    goal: int
    """Index of the goal flown to."""
    decision: Decision
    obstacle_map: ObstacleMap | None
    """That obstacles are called by in words."""
    in_doubt: bool
    """Whether the clock has jumped, and no own state estimate has come since."""
    scan_age_s: float
    """Age of the oldest scan used; NaN without any."""
    counts: dict[str, int]
    """Data left out since the last decision, by reason."""
    traffic: TrafficPicture | None = None
    """Alerts and bands; None where no volumes are asked for."""
    blind_s: float | None = None
    """For how long no range sensor has told anything; None while one does, or where there is
    none."""
    alarms: tuple[Alarm, ...] = ()
    """What is wrong with the flight: a promise not kept, a goal that is left."""
    false_share: float = 0.0
    """Estimated share of the beams of a LiDAR with false returns; 0 where none stand out."""
    kept: KeptClearance | None = None
    """The clearance that is kept with 95 % until the next decision."""

    @cached_property
    def explanation(self) -> str:
        """One line for the log and for people."""
        held = self.mode_state.held
        words = explanation(self.decision, self.mode, self.obstacle_map, held, self.kept)
        if self.blind_s is not None and self.mode is not Mode.HOLD:
            words += f"; {NOTHING_SENSED} for {self.blind_s:.1f} s"
        if self.in_doubt:
            words += "; the clock jumped: the position is in doubt until the next state estimate"
        if 0.0 < self.false_share <= MOST_FALSE:
            words += f"; {say_false(self.false_share)}"
        if self.traffic is not None and self.traffic.alerts.level:
            words += f"; {self.traffic.in_words}"
        return "; ".join([words, *(f"ALARM: {alarm.why}" for alarm in self.alarms)])

    def __repr__(self) -> str:
        return one_line(
            "FlightDecision",
            (f"{self.time_s:g} s", f"{self.mode}", f"goal {self.goal}", runs(self.movements)),
        )

    def _repr_html_(self) -> str:
        """For notebooks: the decision, with its explanation."""
        return html_table(f"{self.time_s:g} s, {self.mode}", self._reasons) + (
            self.decision._repr_html_()
        )

    @property
    def _reasons(self) -> dict[str, str]:
        changed = self.mode_state.transition
        return ({"mode": changed} if changed else {}) | {"why": self.explanation}

    @property
    def mode(self) -> Mode:
        """What the vehicle is doing."""
        return self.mode_state.mode

    @property
    def state(self) -> State:
        """Own state estimate that was decided for."""
        return self.decision.state

    @property
    def movements(self) -> tuple[str, ...]:
        """The movement buffer to execute."""
        return self.decision.movements
