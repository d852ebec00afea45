"""What may be asked between decisions: what is flown, where that leads, and what is known."""

from __future__ import annotations

from dataclasses import replace

from clearway.avoidance.plan.situation import Situation
from clearway.base.state import State
from clearway.live.knowledge import Knowledge
from clearway.live.listener import Listener
from clearway.live.mission import Detour, Mission, Mode, Progress
from clearway.live.outputs.modes import ModeState
from clearway.live.plan import Plan
from clearway.live.recovery.dead_end import out_of_dead_end
from clearway.live.watch import PlanWatch
from clearway.vehicle.buffer import MovementBuffer
from clearway.vehicle.movement import Movement
from clearway.vehicle.reference import Reference


class Questions(Listener):
    """Answers by the plan that is flown and by what is known."""

    def __init__(
        self, known: Knowledge, plan: Plan, watch: PlanWatch, detour: Detour | None
    ) -> None:
        super().__init__(known)
        self._plan, self._watch, self._detour = plan, watch, detour
        self._mode: ModeState | None = None
        self._told: dict[str, int] = {}

    @property
    def progress(self) -> Progress:
        """How far along the mission own state estimates have come."""
        return self._known.progress

    @progress.setter
    def progress(self, progress: Progress) -> None:
        self._known.progress = progress

    @property
    def mission(self) -> Mission:
        """What is flown; `fly_to` puts another in its place."""
        return self._known.mission

    @property
    def followed(self) -> bool:
        """Whether the vehicle flies what is decided; a caller that knows sets it. Where a pilot
        flies, going elsewhere than decided tells nothing of the wind."""
        return self._known.followed

    @followed.setter
    def followed(self, is_so: bool) -> None:
        self._known.followed = is_so

    @property
    def ahead_s(self) -> float:
        """How long before a movement of a vehicle with inertia ends the next one is decided; a
        caller that asks at a set rate sets it, so that a question comes in time."""
        return self._watch.ahead_s

    @ahead_s.setter
    def ahead_s(self, seconds: float) -> None:
        self._watch.ahead_s = seconds if self._known.planner.automaton.has_inertia else 0.0

    @property
    def buffer(self) -> MovementBuffer:
        """The movements decided last, with their times; what is past of them is flown (6.2)."""
        buffer, clock = self._plan.buffer, self._known.clock
        return buffer.shift(clock.to_stated) if clock.shifted else buffer

    @property
    def holds_until_s(self) -> float:
        """Until when the plan may be flown without a new decision; -inf before the first one."""
        return self._known.clock.to_stated(self._plan.holds_until_s)

    def escape_ends_s(self, time_s: float) -> float | None:
        """Return when the escape held at a time has been flown.

        Parameters
        ----------
        time_s
            On the clock of the readings.

        Returns
        -------
        float or None
            As `Plan.escape_ends_s`, on the same clock.
        """
        ends_s = self._plan.escape_ends_s(self._known.clock.own(time_s))
        return None if ends_s is None else self._known.clock.to_stated(ends_s)

    def movement_at(self, time_s: float) -> Movement | None:
        """Return what to fly at a time, of the plan decided last.

        Where one movement ends, the next is flown.

        Parameters
        ----------
        time_s
            On the clock of the readings.

        Returns
        -------
        Movement or None
            None before the first decision, at times before the last one, and past the plan's end,
            where `due` has long asked for the next one.
        """
        return self._plan.movement_at(self._known.clock.own(time_s))

    def state_at(self, time_s: float) -> State | None:
        """Return where the plan has the vehicle at a time.

        Flown from the state that was decided for: a set-point, not an estimate of the own state.

        Parameters
        ----------
        time_s
            On the clock of the readings.

        Returns
        -------
        State or None
            World frame; None when `movement_at` is.
        """
        state = self._plan.state_at(self._known.clock.own(time_s))
        return replace(state, time_s=time_s) if state and self._known.clock.shifted else state

    def reference_at(self, time_s: float) -> Reference | None:
        """Return what the plan asks of the vehicle at a time.

        Parameters
        ----------
        time_s
            On the clock of the readings.

        Returns
        -------
        Reference or None
            Where to be, how fast, and how that changes, world frame; None when `movement_at` is.
        """
        return self._plan.reference_at(self._known.clock.own(time_s))

    def situation(self, now_s: float) -> tuple[Situation, float]:
        """Return all that is known at a moment.

        Parameters
        ----------
        now_s
            The present time, on the clock of the readings.

        Returns
        -------
        tuple of Situation and float
            What is known, world frame, and the age of the oldest scan used in seconds (NaN without
            any).

        Raises
        ------
        ClearwayError
            If no own state estimate has come yet, and for what is no time.
        """
        situation, scan_age = self._situation(self._known.catch_up(now_s))
        if self._known.clock.shifted:
            told = self._known.clock.to_stated
            situation = replace(
                situation,
                state=replace(situation.state, time_s=told(situation.state.time_s)),
                intruders=[replace(i, time_s=told(i.time_s)) for i in situation.intruders],
            )
        return situation, scan_age

    def _count_fresh(self) -> dict[str, int]:
        """What was left out since the last call, by reason."""
        told = self._told  # By hand: to subtract counters is slow.
        fresh = {
            why: n - told.get(why, 0) for why, n in self.counts.items() if n > told.get(why, 0)
        }
        if fresh:
            self._told = dict(self.counts)
        return fresh

    @property
    def _escapes_on(self) -> bool:
        """Whether the escape has been flown twice in a row: once is but a step to the side, from
        which the goal may lie open. Before there was a certain one, nothing had been seen yet."""
        mode = self._mode
        return mode is not None and mode.mode is Mode.ESCAPE is mode.before

    def _start(self, now: float) -> State:
        """The own state estimate that a decision is taken for.

        A vehicle with inertia that follows its plan: where the plan has it at the end of the
        movement under way. Else where it is now, as far as is known.
        """
        state, plan = self._known.own_state(now), self._plan.in_force(now)
        if not self._watch.keeps_to(self._plan):
            return state
        planned = plan.state_at(plan.next_s(now))
        if planned is None:
            return state
        return replace(
            planned,
            position_std_m=state.position_std_m,
            attitude_std_rad=state.attitude_std_rad,
        )

    def _situation(self, now: float) -> tuple[Situation, float]:
        state = self._start(now)
        if self._known.route_planner is not None:
            return self._known.with_detections(state, now)
        last = self._plan.decision
        afar = None if last is None else last.long_range
        self.progress = out_of_dead_end(
            self._known,
            state,
            now,
            self._detour,
            escaped=self._escapes_on and self._plan.had_certain,
            gives_way=afar is not None and afar.gives_way,
        )
        return self._known.with_detections(state, now)
