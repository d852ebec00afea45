"""A baseline in the closed loop: clearway's own sensing, memory and mission, another's rule."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from clearway.avoidance.plan.planner import Planner
from clearway.base.brief import brief
from clearway.base.state import State
from clearway.live import AvoidanceSystem, Reading
from clearway.live.inputs.readings import TIME_TOLERANCE_S
from clearway.live.mission import Mission, Mode
from clearway.sim.baselines.manoeuvre import Manoeuvre, ManoeuvreRule
from clearway.vehicle.automaton import Movement
from clearway.vehicle.buffer import MovementBuffer


@dataclass(frozen=True, slots=True, eq=False)
class BaselineDecision:
    """What a baseline flies next; a `pilot.Steering`."""

    time_s: float
    mode: Mode
    goal: int
    state: State
    movements: tuple[str, ...]
    explanation: str
    counts: dict[str, int]

    __repr__ = brief


class BaselinePilot:
    """Flies by a rule, asked anew after every movement.

    knowledge: takes the readings, remembers points and follows the mission's progress as it does
    for clearway itself, so that planners differ in their rule only. It is not asked to decide.
    """

    def __init__(self, knowledge: AvoidanceSystem, rule: ManoeuvreRule) -> None:
        self._knowledge = knowledge
        self._rule = rule
        self._last: Manoeuvre | None = None
        self._buffer = MovementBuffer()
        self._reported: Counter[str] = Counter()

    @property
    def planner(self) -> Planner:
        return self._knowledge.planner

    @property
    def mission(self) -> Mission:
        return self._knowledge.mission

    @property
    def counts(self) -> Counter[str]:
        """Data left out, by reason."""
        return self._knowledge.counts

    def update(self, reading: Reading) -> None:
        """Take one reading."""
        self._knowledge.update(reading)

    def due(self, now_s: float) -> str | None:
        """A rule is asked whenever a movement has ended."""
        entries = self._buffer.entries
        ended = not entries or now_s >= entries[0].end_s - TIME_TOLERANCE_S
        return "the movement has ended" if ended else None

    def decide(self, now_s: float) -> BaselineDecision:
        """Decide for the present moment; raises ClearwayError if no own state estimate has come
        yet."""
        situation, _ = self._knowledge.situation(now_s)
        self._last = self._rule(situation, self._last)
        movements = self.planner.automaton.chain(self._last.movements)
        self._buffer = MovementBuffer.of(movements, now_s)
        fresh = self.counts - self._reported
        self._reported = Counter(self.counts)
        return BaselineDecision(
            now_s,
            self._last.mode,
            self._knowledge.progress.goal,
            situation.state,
            self._last.movements,
            self._last.reason,
            dict(fresh),
        )

    def movement_at(self, time_s: float) -> Movement | None:
        """What to fly at a time, from the last decision on; None outside what it says."""
        return self._buffer.find_held(time_s, TIME_TOLERANCE_S)
