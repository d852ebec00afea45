"""The plan being flown, and for how long it may be flown on without a new decision."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from clearway.avoidance.choice import Commitment, Side
from clearway.avoidance.decide import Decision
from clearway.live.planned_path import PlannedPath
from clearway.live.readings import TIME_TOLERANCE_S
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.buffer import MovementBuffer


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """What was decided last; before the first decision, nothing."""

    buffer: MovementBuffer = field(default_factory=MovementBuffer)
    goal: int = -1
    """Index of the goal flown to."""
    decide_by_s: float = -np.inf
    """Later, the vehicle could no longer turn away inside what it has seen."""
    side: Side = Side.STRAIGHT
    """On which something is being passed."""
    decision: Decision | None = None
    """That made it."""

    def due(self, now_s: float, goal: int) -> str | None:
        """Why a decision is due now, or None while the plan may be flown on to the same goal."""
        if not self.buffer.entries or now_s >= self.buffer.end_s - TIME_TOLERANCE_S:
            return "the buffer is empty"
        if goal != self.goal:
            return "a new goal"
        if now_s >= self.decide_by_s - TIME_TOLERANCE_S:
            return "the plan has to be renewed while the vehicle can still turn away"
        return None

    def commitment(self, now_s: float) -> Commitment:
        """What the next decision should stay with."""
        held = self.buffer.at(now_s + TIME_TOLERANCE_S)
        return Commitment(self.side, held.name if held else "")

    def after(
        self, decision: Decision, now_s: float, goal: int, automaton: MovementAutomaton
    ) -> Plan:
        """The plan that a decision makes, flown from `now_s` on."""
        return Plan(
            MovementBuffer.of(automaton.chain(decision.movements), now_s),
            goal,
            now_s + decision.decide_within_s,
            self._side_after(decision),
            decision,
        )

    def in_first_movement(self, now_s: float) -> bool:
        """Whether the plan's first movement has not come to its end."""
        entries = self.buffer.entries
        return bool(entries) and now_s < entries[0].end_s - TIME_TOLERANCE_S

    @property
    def path(self) -> PlannedPath | None:
        """Where it leads; None before the first decision."""
        if self.decision is None:
            return None
        return PlannedPath.of(self.decision, self.buffer.start_s)

    def _side_after(self, decision: Decision) -> Side:
        """A side once forced is kept until the way is clear."""
        choice = decision.choice
        if choice.forced:
            return choice.side
        if choice.side is not self.side and not choice.ruled_out:
            return Side.STRAIGHT
        return self.side
