"""The plan that is being flown: where it has the vehicle at a time, and for how long it holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.frames import FloatArray
from clearway.movement_buffer import MovementBuffer
from clearway.movements import MovementAutomaton
from clearway.system import FlightDecision


@dataclass(frozen=True, slots=True, eq=False)
class FlownPlan:
    """The movements of a decision, from the state that it was taken for."""

    automaton: MovementAutomaton
    start: FloatArray
    """[6] state at the decision."""
    buffer: MovementBuffer
    holds_until_s: float
    """Latest time for the next decision."""

    @classmethod
    def of(cls, automaton: MovementAutomaton, flight: FlightDecision) -> FlownPlan:
        buffer = MovementBuffer.of(automaton.chain(flight.movements), flight.time_s)
        holds = min(flight.time_s + flight.decision.decide_within_s, buffer.end_s)
        return cls(automaton, flight.state.vector, buffer, holds)

    def at(self, time_s: float) -> FloatArray | None:
        """State [6] at a time; None once the plan is over."""
        if time_s > self.buffer.end_s:
            return None
        flown, _ = self.buffer.split(time_s)
        return np.asarray(flown.rollout(self.automaton, self.start, np.inf).states[-1])

    def speed_at(self, time_s: float) -> float:
        """Speed of the movement flown at a time."""
        movement = self.buffer.at(time_s) or self.buffer.entries[0].movement
        return movement.speed_mps
