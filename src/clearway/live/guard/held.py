"""What the guardian holds: the leg of a wish that passed, or a decision, and an escape."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.held_escape import WayOut
from clearway.base.frames import FloatArray, world_from_body
from clearway.base.state import State
from clearway.live.guard.leg import Leg
from clearway.live.inputs.readings import TIME_TOLERANCE_S
from clearway.live.plan import MOST_ROUNDS
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.buffer import MovementBuffer
from clearway.vehicle.reference import Reference


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """Flown from `start` on if nobody says anything else: a leg, movements, and then a loop."""

    automaton: MovementAutomaton
    start: State
    leg: Leg | None
    """Of a wish that passed, flown first."""
    movements: MovementBuffer
    """After the leg; one round of the loop is among them."""
    loop: tuple[str, ...]
    """Flown again and again after those; none where there is no escape."""
    way_out: WayOut | None
    """What is flown from the end of the leg on, or from that of the first movement."""
    decision: Decision | None = None

    @classmethod
    def of_leg(cls, automaton: MovementAutomaton, leg: Leg, way: WayOut) -> Held:
        """A wish that passes, and the escape behind it."""
        begins_s = leg.start.time_s + leg.end_s
        movements = MovementBuffer.of(automaton.chain(way.movements), begins_s)
        return cls(automaton, leg.start, leg, movements, way.loop, way)

    @classmethod
    def of_decision(cls, automaton: MovementAutomaton, decision: Decision) -> Held:
        """What a decision flies in place of a wish."""
        way, names = decision.way_out, decision.movements
        if way is not None:
            names = (names[0], *way.movements)
        movements = MovementBuffer.of(automaton.chain(names), decision.state.time_s)
        loop = () if way is None else way.loop
        return cls(automaton, decision.state, None, movements, loop, way, decision)

    @property
    def renew_s(self) -> float:
        """When what was verified first ends, and the escape begins."""
        if self.leg is not None:
            return self.movements.start_s
        return self.movements.entries[0].end_s

    def escape_ends_s(self, now_s: float) -> float | None:
        """When the escape has been flown, as `Plan.escape_ends_s`; None where there is none."""
        if not self.loop:
            return None
        loop = self.automaton.chain(self.loop)
        round_s = sum(movement.duration_s for movement in loop)
        stands = all(self.automaton.stands[self.automaton.names.index(one)] for one in self.loop)
        ends_s = self.movements.end_s - round_s if stands else self.movements.end_s + round_s
        return max(ends_s, now_s if stands else now_s + round_s)

    def at(self, time_s: float) -> tuple[State, FloatArray]:
        """Where it has the vehicle at a time, and with which velocity [3]; world frame."""
        elapsed_s = time_s - self.start.time_s
        start = self.start
        if self.leg is not None:
            if elapsed_s < self.leg.end_s:
                return self.leg.at(max(0.0, elapsed_s))
            start = self.leg.end
        flown = self._extend_until(time_s)
        time_s = min(max(time_s, flown.start_s), flown.end_s)
        before, after = flown.split(time_s)
        movement = (after.entries or before.entries[-1:])[0].movement
        asked = self._reference_on(flown, start, time_s)
        if asked is not None:
            attitude = np.array([*start.attitude_rad[:2], asked.yaw_rad])
            state = replace(start, position_m=asked.position_m, attitude_rad=attitude)
            return replace(state, time_s=time_s), asked.velocity_mps
        vector = start.vector
        if before.entries:
            vector = before.rollout(self.automaton, vector, np.inf).states[-1]
        state = replace(start, position_m=vector[:3], attitude_rad=vector[3:], time_s=time_s)
        velocity = movement.speed_mps * world_from_body(vector[3:])[:, 0]
        velocity[2] += movement.climb_mps or 0.0
        return state, velocity

    def reference_at(self, time_s: float) -> Reference | None:
        """What it asks of a vehicle with inertia at a time; None during a leg, and of others."""
        start, flown = self.start, self._extend_until(time_s)
        if self.leg is not None:
            if time_s - self.start.time_s < self.leg.end_s:
                return None
            start = self.leg.end
        return self._reference_on(flown, start, min(max(time_s, flown.start_s), flown.end_s))

    def _reference_on(self, flown: MovementBuffer, start: State, time_s: float) -> Reference | None:
        if not self.automaton.has_inertia:
            return None
        vector = start.vector
        for entry in flown.entries:
            if time_s <= entry.end_s + TIME_TOLERANCE_S:
                into_s = time_s - entry.start_s
                return Reference.of(self.automaton, vector, entry.movement, into_s)
            vector = self.automaton.predict(vector, entry.movement)
        return None

    def way_out_at(self, time_s: float) -> WayOut | None:
        """What of the escape is left at a time between two movements; else None."""
        way = self.way_out
        if way is None:
            return None
        first = 0 if self.leg is not None else 1
        for entry in self._extend_until(time_s).entries[first:]:
            if abs(entry.start_s - time_s) <= TIME_TOLERANCE_S:
                return way
            way = way.after_one
        return None

    def _extend_until(self, time_s: float) -> MovementBuffer:
        """The movements, with as many rounds of the loop as reach beyond a time."""
        movements = self.movements
        if not self.loop or time_s < movements.end_s - TIME_TOLERANCE_S:
            return movements
        loop = self.automaton.chain(self.loop)
        one_s = sum(movement.duration_s for movement in loop)
        rounds = min(int((time_s - movements.end_s) / one_s) + 2, MOST_ROUNDS)
        more = MovementBuffer.of(loop * rounds, movements.end_s)
        return MovementBuffer(movements.entries + more.entries)
