"""The plan that is being flown: where it has the vehicle at a time, and for how long it holds."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from clearway.base.frames import FloatArray, wrap_angle
from clearway.base.state import State
from clearway.live import FlightDecision
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.buffer import MovementBuffer

ON_PLAN_RAD = math.radians(45.0)
"""While the direction of flight is so close to the plan's, the vehicle is turning into it."""


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

    def turned_onto(self, state: State, counts: Counter[str]) -> State:
        """The state with the plan's direction of flight, while the vehicle follows the plan.

        It does so with lag: a decision that started from its own direction would ask for the
        beginning of a turn, over and over. counts grows where it does not follow.
        """
        planned = self.at(state.time_s)
        if planned is None:
            return state
        off = wrap_angle(state.attitude_rad - planned[3:])
        if math.hypot(float(off[1]), float(off[2])) > ON_PLAN_RAD:
            counts["plan: not followed"] += 1
            return state
        attitude = np.array([0.0, planned[4], wrap_angle(planned[5])])
        return replace(state, attitude_rad=attitude)

    def speed_at(self, time_s: float) -> float:
        """Speed of the movement flown at a time."""
        movement = self.buffer.at(time_s) or self.buffer.entries[0].movement
        return movement.speed_mps
