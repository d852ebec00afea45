"""The plan being flown, and for how long it may be flown on without a new decision."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from clearway.avoidance import Decision
from clearway.decision import Commitment, Side
from clearway.movement_buffer import MovementBuffer
from clearway.movements import MovementAutomaton


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
    turning: Side = Side.STRAIGHT
    """Where the trajectory leads."""
    turns_until_s: float = -np.inf
    """End of its first movement."""

    def due(self, now_s: float, goal: int) -> str | None:
        """Why a decision is due now, or None while the plan may be flown on to the same goal."""
        if not self.buffer.entries or now_s >= self.buffer.end_s - 1e-9:
            return "the buffer is empty"
        if goal != self.goal:
            return "a new goal"
        if now_s >= self.decide_by_s - 1e-9:
            return "the plan has to be renewed while the vehicle can still turn away"
        return None

    def commitment(self, now_s: float) -> Commitment:
        """What the next decision should stay with.

        In the middle of a movement the vehicle has turned by less than any movement does, so that
        the other way round always looks shorter: decided over and over, it would never turn.
        """
        held = self.buffer.at(now_s + 1e-6)
        in_a_movement = now_s < self.turns_until_s - 1e-6
        side = self.turning if in_a_movement and self.side is Side.STRAIGHT else self.side
        return Commitment(side, held.name if held else "")

    def after(
        self, decision: Decision, now_s: float, goal: int, automaton: MovementAutomaton
    ) -> Plan:
        """The plan that a decision makes, flown from `now_s` on."""
        buffer = MovementBuffer.of(automaton.chain(decision.movements), now_s)
        return Plan(
            buffer,
            goal,
            now_s + decision.decide_within_s,
            self._side_after(decision),
            decision.choice.side,
            buffer.entries[0].end_s,
        )

    def _side_after(self, decision: Decision) -> Side:
        """A side once forced is kept until the way is clear."""
        choice = decision.choice
        if choice.forced:
            return choice.side
        if choice.side is not self.side and not choice.ruled_out:
            return Side.STRAIGHT
        return self.side
