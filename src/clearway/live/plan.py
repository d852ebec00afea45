"""The plan being flown: what is held when, where it has the vehicle, and for how long it holds."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from clearway.avoidance.choose.candidates import Commitment, Side
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.held_escape import UnderWay, WayOut
from clearway.base.state import State
from clearway.live.inputs.readings import TIME_TOLERANCE_S
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.buffer import BufferedMovement, MovementBuffer
from clearway.vehicle.reference import Reference

MOST_ROUNDS = 1000
"""Rounds of an escape after which nobody flies on without a decision."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """What was decided last, flown from then on; before the first decision, nothing.

    Nobody else keeps a copy: the pilot asks `movement_at` and `state_at`.
    """

    automaton: MovementAutomaton
    buffer: MovementBuffer = field(default_factory=MovementBuffer)
    decision: Decision | None = None
    """That made it."""
    goal: int = -1
    """Index of the goal flown to."""
    decide_by_s: float = -np.inf
    """Later, the vehicle could no longer turn away inside what it has seen."""
    side: Side = Side.STRAIGHT
    """On which something is being passed."""
    intended: MovementBuffer = field(default_factory=MovementBuffer)
    """What the decision would fly if every later one agreed."""
    way_out: WayOut | None = None
    """What the buffer ends with, flown for ever if no later decision comes."""
    had_certain: bool = False
    """Whether a certain escape was held at any time of the flight."""
    stood: int = 0
    """How many decisions in a row led nowhere."""
    before: Plan | None = None
    """What is flown until this one begins, where it was made ahead of its time."""

    def after(self, decision: Decision, now_s: float, goal: int, *, ahead: bool = False) -> Plan:
        """The plan that a decision makes, flown from `now_s` on; `ahead`: this one until then."""
        intended = self._fly_from(decision.movements, now_s, decision.under_way_s)
        flown, way = intended, decision.way_out
        first_s = intended.entries[0].duration_s
        if way is not None and decision.decide_within_s > first_s + TIME_TOLERANCE_S:
            way = None  # Nothing is near: it is not needed yet.
        if way is not None:
            movements = (decision.movements[0], *way.movements)
            flown = self._fly_from(movements, now_s, decision.under_way_s)
        return Plan(
            self.automaton,
            flown,
            decision,
            goal,
            now_s + decision.decide_within_s,
            self._side_after(decision),
            intended,
            way,
            self.had_certain or (decision.way_out is not None and decision.way_out.certain),
            self.stood + 1 if self._leads_nowhere(decision.movements[0]) else 0,
            replace(self, before=None) if ahead else None,
        )

    def _leads_nowhere(self, movement: str) -> bool:
        return bool(self.automaton.stands[self.automaton.names.index(movement)])

    def _fly_from(
        self, names: tuple[str, ...], now_s: float, under_way_s: float | None
    ) -> MovementBuffer:
        """Movements from now on, of the first only what is left where it is under way."""
        chain = self.automaton.chain(names)
        if under_way_s is None:
            return MovementBuffer.of(chain, now_s)
        first = BufferedMovement(chain[0], now_s, under_way_s)
        rest = MovementBuffer.of(chain[1:], first.end_s)
        return MovementBuffer((first, *rest.entries))

    # --- what is flown --------------------------------------------------------------------

    def in_force(self, time_s: float) -> Plan:
        """The plan that is flown at a time: the one before, until this one begins."""
        before = self.before
        if before is None or time_s >= self.buffer.start_s - TIME_TOLERANCE_S:
            return self
        return before

    def next_s(self, now_s: float) -> float:
        """When the movement under way ends; now between two of them, and where nothing is flown."""
        for entry in self.fly_until(now_s).entries:
            if entry.start_s + TIME_TOLERANCE_S < now_s < entry.end_s - TIME_TOLERANCE_S:
                return entry.end_s
        return now_s

    def movement_at(self, time_s: float) -> Movement | None:
        """What to fly at a time, the movement that begins where two meet; None outside the plan."""
        if self.in_force(time_s) is not self:
            return self.in_force(time_s).movement_at(time_s)
        return self.fly_until(time_s).find_held(time_s, TIME_TOLERANCE_S)

    def state_at(self, time_s: float) -> State | None:
        """Where the plan has the vehicle at a time, from the state that was decided for (4.16).

        None outside the plan. World frame; what was measured since is not in it.
        """
        if self.in_force(time_s) is not self:
            return self.in_force(time_s).state_at(time_s)
        if self.decision is None or self.movement_at(time_s) is None:
            return None
        start = self.decision.state
        flown, _ = self.fly_until(time_s).split(time_s)
        vector = flown.rollout(self.automaton, start.vector, np.inf).states[-1]
        carried_m = self.decision.wind_mps * (time_s - self.buffer.start_s)
        return replace(
            start, position_m=vector[:3] + carried_m, attitude_rad=vector[3:], time_s=time_s
        )

    def reference_at(self, time_s: float) -> Reference | None:
        """What it asks of the vehicle at a time: also how fast, and how that changes; None outside
        the plan."""
        if self.in_force(time_s) is not self:
            return self.in_force(time_s).reference_at(time_s)
        entry = self._entry_at(time_s)
        start = None if entry is None else self.state_at(entry.start_s)
        if entry is None or start is None or self.decision is None:
            return None
        into_s = time_s - entry.start_s
        asked = Reference.of(self.automaton, start.vector, entry.movement, into_s)
        wind = self.decision.wind_mps
        if not wind.any():
            return asked
        return replace(
            asked,
            position_m=asked.position_m + wind * into_s,
            velocity_mps=asked.velocity_mps + wind,
        )

    def _entry_at(self, time_s: float) -> BufferedMovement | None:
        """The movement flown at a time with when it begins; the last one at the plan's end."""
        entries = self.fly_until(time_s).entries
        begun = [e for e in entries if e.start_s <= time_s + TIME_TOLERANCE_S]
        return begun[-1] if begun and time_s <= begun[-1].end_s + TIME_TOLERANCE_S else None

    def fly_until(self, time_s: float) -> MovementBuffer:
        """The buffer, with as many rounds of the escape as reach beyond a time."""
        buffer = self.buffer
        if self.way_out is None or time_s < buffer.end_s - TIME_TOLERANCE_S:
            return buffer
        loop = self.automaton.chain(self.way_out.loop)
        one = MovementBuffer.of(loop)
        rounds = int((time_s - buffer.end_s) / one.end_s) + 2
        if rounds > MOST_ROUNDS:
            return buffer
        more = MovementBuffer.of(loop * rounds, buffer.end_s)
        return MovementBuffer(buffer.entries + more.entries)

    def measure_strayed_m(self, state: State) -> float:
        """By how much an own state estimate lies beyond the tube of the plan (4.2.2); 0 within it.

        Also where nothing was measured of the vehicle, outside the plan, and at its start.
        """
        if self.in_force(state.time_s) is not self:
            return self.in_force(state.time_s).measure_strayed_m(state)
        planned = self.state_at(state.time_s)
        flown_s = state.time_s - self.buffer.start_s
        if planned is None or self.automaton.classes is None or flown_s <= TIME_TOLERANCE_S:
            return 0.0
        off_m = float(np.linalg.norm(planned.position_m - state.position_m))
        return max(0.0, off_m - self._tube_m(state.time_s, flown_s))

    def _tube_m(self, time_s: float, flown_s: float) -> float:
        """Radius of the tube at a time: that of the class flown, or of so many movements."""
        classes, entry = self.automaton.classes, self._entry_at(time_s)
        if classes is not None and classes.has_speeds and entry is not None:
            start = self.state_at(entry.start_s)
            at = classes.first if start is None else classes.class_at(float(start.attitude_rad[0]))
            return float(classes.tube_of_movements_m[at, classes.names.index(entry.movement.name)])
        ends = [entry.end_s - self.buffer.start_s for entry in self.fly_until(time_s).entries]
        movements = float(np.interp(flown_s, [0.0, *ends], np.arange(len(ends) + 1)))
        return float(self.automaton.tube_m(movements))

    # --- for how long ---------------------------------------------------------------------

    @property
    def holds_until_s(self) -> float:
        """Until when it may be flown without a new decision; -inf before the first one."""
        return min(self.decide_by_s, self.buffer.end_s)

    def escape_ends_s(self, now_s: float) -> float | None:
        """When its escape has been flown: at its stop, or after two rounds of its loop, the first
        one verified and the next one alike. None where there is no escape."""
        way = self.way_out
        if way is None:
            # Nothing is near: the plan itself can be flown until then.
            is_free = self.decision is not None and self.decision.way_out is not None
            return max(now_s, self.holds_until_s) if is_free else None
        loop = self.automaton.chain(way.loop)
        round_s = sum(movement.duration_s for movement in loop)
        stands = all(self._leads_nowhere(movement) for movement in way.loop)
        ends_s = self.buffer.end_s - round_s if stands else self.buffer.end_s + round_s
        return max(ends_s, now_s if stands else now_s + round_s)

    def due(self, now_s: float, goal: int) -> str | None:
        """Why a decision is due now, or None while the plan may be flown on to the same goal."""
        if not self.buffer.entries or now_s >= self.buffer.end_s - TIME_TOLERANCE_S:
            return "the buffer is empty"
        if goal != self.goal:
            return "a new goal"
        if now_s >= self.decide_by_s - TIME_TOLERANCE_S:
            if self.way_out is not None:
                return "the escape is to be renewed"
            return "the plan has to be renewed while the vehicle can still turn away"
        return None

    def in_first_movement(self, now_s: float) -> bool:
        """Whether the plan's first movement has not come to its end."""
        entries = self.buffer.entries
        return bool(entries) and now_s < entries[0].end_s - TIME_TOLERANCE_S

    # --- what the next decision stays with ------------------------------------------------

    def commitment(
        self, now_s: float, certain_within: int | None = None, *, blind: bool = False
    ) -> Commitment:
        """What the next decision should stay with; `certain_within` and `blind` as it says."""
        held = self.intended.at(now_s + TIME_TOLERANCE_S)
        passings = () if self.decision is None else self.decision.passings
        way, under_way = self._way_out_at(now_s)
        afar = None if self.decision is None else self.decision.long_range
        return Commitment(
            self.side,
            held.name if held else "",
            self._list_planned(now_s),
            passings,
            way,
            under_way,
            certain_within=certain_within,
            had_certain=self.had_certain,
            long_range=afar,
            stood=self.stood,
            blind=blind,
        )

    def _list_planned(self, now_s: float) -> tuple[str, ...]:
        """Movements that the last plan has yet, of a vehicle that goes on with it."""
        if not self.automaton.has_inertia:
            return ()
        entries = self.intended.entries
        return tuple(e.movement.name for e in entries if e.end_s > now_s + TIME_TOLERANCE_S)

    def _way_out_at(self, now_s: float) -> tuple[WayOut | None, UnderWay | None]:
        """What of the escape is left at a time, and in the middle of a movement that movement,
        after which it begins."""
        way = self.way_out
        for flown, entry in enumerate(self.fly_until(now_s).entries):
            if entry.start_s + TIME_TOLERANCE_S < now_s < entry.end_s - TIME_TOLERANCE_S:
                left = None if way is None else way.after(flown)
                return left, UnderWay(entry.movement.name, entry.end_s - now_s)
            if way is not None and abs(entry.end_s - now_s) <= TIME_TOLERANCE_S:
                return way.after(flown), None
        return None, None

    def _side_after(self, decision: Decision) -> Side:
        """A side once forced is kept until the way is clear."""
        choice = decision.choice
        if choice.forced:
            return choice.side
        if choice.side is not self.side and choice.is_first:
            return Side.STRAIGHT
        return self.side
