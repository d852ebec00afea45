"""The guardian: the pilot keeps the say while what is wished leaves an escape.

A wish that is verified with an escape behind it passes unchanged. Else the nearest safe trajectory
is flown: the wish is the cost, everything else is `decide`. What was verified last stays held
and is flown on where nothing better is found, or nobody asks any more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from clearway.avoidance.plan.planner import Planner
from clearway.base.brief import one_line
from clearway.base.checks import above_zero_problem, collect_problems
from clearway.base.errors import ClearwayError, InputError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.guard.admission import Admission, Asked, Examined
from clearway.live.guard.braking import find_braking
from clearway.live.guard.check import in_calm
from clearway.live.guard.held import Held
from clearway.live.guard.holding import Holding
from clearway.live.guard.nearest import NearnessToWish, planner_towards
from clearway.live.guard.replacement import Replacement
from clearway.live.guard.wish import PathWish, VelocityWish, Wish
from clearway.live.knowledge import Knowledge
from clearway.live.link.guarded import Guarded
from clearway.live.link.set_point import SetPoint
from clearway.live.listener import Listener
from clearway.live.mission import Mission
from clearway.live.preflight.escape_plan import escape_plan
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import AnySensor

PASSES = "the wish keeps the margin and leaves an escape"
NEAREST = "; the nearest velocity that does not is flown"
WOULD_MEET = "the wish would meet an aircraft before it has passed"


class Guardian(Listener):
    """Feed it with `update`; ask it with `guard_velocity` or `guard_path` at a set rate.

    Parameters
    ----------
    planner
        Of a vehicle that has escapes; its settings say how readings are taken too.
    start
        Where it takes over, world frame.
    lidars
        As `AvoidanceSystem` takes them.
    obstacle_map
        What was known before take-off, world frame.
    hold_s
        For how long a wish counts. After that a vehicle that can stop brakes, and then the escape
        is flown, until the next call.
    acceleration_mps2
        At which a vehicle that can stop changes its velocity. None takes that of a vehicle with
        inertia, and 3 m/s2 of any other, which `braking` says.

    Raises
    ------
    ClearwayError
        For a planner that asks for no escapes, or a vehicle that has none.
    InputError
        For times and accelerations that are not above 0.

    Examples
    --------
    >>> import numpy as np
    >>> import clearway as cw
    >>> automaton = cw.MovementAutomaton.inertialess(speed_mps=1.0)
    >>> library = cw.ReachLibrary.load_or_build(automaton, cw.AvoidanceGrid.uniform())
    >>> wall = cw.ObstacleMap([cw.Obstacle.cuboid([3.0, 0.0, 0.0], [1.0, 9.0, 9.0])])
    >>> here = cw.State(np.zeros(3))
    >>> guardian = cw.Guardian(cw.Planner.of(library), here, obstacle_map=wall)
    >>> guardian.update(here)
    >>> guardian.guard_velocity([1.0, 0.0, 0.0], 0.0).passed
    True
    >>> guardian.update(cw.State(np.array([1.6, 0.0, 0.0]), time_s=1.0))
    >>> guardian.guard_velocity([1.0, 0.0, 0.0], 1.0).passed
    False
    """

    def __init__(
        self,
        planner: Planner,
        start: State,
        *,
        lidars: Sequence[AnySensor] = (),
        obstacle_map: ObstacleMap | None = None,
        hold_s: float = 0.5,
        acceleration_mps2: float | None = None,
    ) -> None:
        problems = collect_problems([above_zero_problem("hold_s", hold_s)])
        if acceleration_mps2 is not None and not acceleration_mps2 > 0.0:
            problems.append("acceleration_mps2: must be above 0")
        if problems:
            raise InputError("guardian", problems)
        self.escape = escape_plan(planner, lidars, start=start).count_unobserved_as_free()
        """Which escapes are held, and why."""
        nearness = NearnessToWish()
        self.planner = planner_towards(self.escape.adapt_planner(planner), nearness)
        if self.planner.escapes is None:
            raise ClearwayError(f"guardian: needs escapes; {self.escape.why}")
        if planner.automaton.table is not None and not planner.automaton.has_inertia:
            raise ClearwayError("guardian: where wishes lead is not known of measured movements")
        self.hold_s = hold_s
        brakes = find_braking(planner, acceleration_mps2)
        self.acceleration_mps2, self.braking = brakes.acceleration_mps2, brakes.why
        """Of the vehicle, and in words where that is from."""
        self.obstacle_map = obstacle_map
        ahead = start.position_m + planner.grid.range_m * start.world_from_body[:, 0]
        mission = Mission("guarded", start, waypoints_m=ahead[None])
        super().__init__(Knowledge(self.planner, mission, lidars, obstacle_map))
        self._holding = Holding(self.planner, self._known, brakes.late_s)
        self._admission = Admission(self.planner, hold_s, brakes)
        self._replacement = Replacement(
            self.planner, nearness, self._holding, self._known, hold_s, self.acceleration_mps2
        )

    def __repr__(self) -> str:
        sensors = ", ".join(self._known.sensing.sensors) or "no sensor"
        flown = "no escape held" if self.held is None else "an escape held"
        return one_line("Guardian", (sensors, flown, f"{self.counts.total()} data left out"))

    # --- wishes ---------------------------------------------------------------------------

    def guard_velocity(
        self,
        velocity_mps: npt.ArrayLike,
        now_s: float,
        *,
        yaw_rate_rps: float = 0.0,
        own_velocity_mps: npt.ArrayLike | None = None,
    ) -> Guarded:
        """Return what is to be flown in place of a wished velocity, or the same.

        Parameters
        ----------
        velocity_mps
            [3] the wish, world frame.
        now_s
            The present time, on the clock of the readings.
        yaw_rate_rps
            Wished rate of yaw, left positive.
        own_velocity_mps
            [3] as measured, world frame; by default as was reported last.

        Returns
        -------
        Guarded
            What to fly, whether that is the wish, and why.

        Raises
        ------
        ClearwayError
            Before the first own state estimate.
        InputError
            For what is not finite.
        """
        wish = VelocityWish(np.asarray(velocity_mps, dtype=np.float64), yaw_rate_rps)
        return self.guard(wish, now_s, own_velocity_mps=own_velocity_mps)

    def guard_path(
        self,
        places_m: npt.ArrayLike,
        now_s: float,
        *,
        speed_mps: float | None = None,
        own_velocity_mps: npt.ArrayLike | None = None,
    ) -> Guarded:
        """Return what is to be flown in place of a wished path, or the same.

        Parameters
        ----------
        places_m
            [n, 3] the wish, world frame.
        now_s
            The present time, on the clock of the readings.
        speed_mps
            At which the path is flown; by default the vehicle's.
        own_velocity_mps
            [3] as measured, world frame; by default as was reported last.

        Returns
        -------
        Guarded
            What to fly, whether that is the wish, and why.

        Raises
        ------
        ClearwayError
            Before the first own state estimate.
        InputError
            For a path of no places, what is not finite, and no speed.
        """
        speed = self.planner.speed_mps if speed_mps is None else speed_mps
        wish = PathWish(np.asarray(places_m, dtype=np.float64), speed)
        return self.guard(wish, now_s, own_velocity_mps=own_velocity_mps)

    def guard(
        self, wish: Wish | None, now_s: float, *, own_velocity_mps: npt.ArrayLike | None = None
    ) -> Guarded:
        """Return what is to be flown in place of a wish, or the same.

        Parameters
        ----------
        wish
            A velocity or a path; None where nobody wishes anything: what is held is flown on then.
        now_s
            The present time, on the clock of the readings.
        own_velocity_mps
            [3] as measured, world frame; by default as was reported last.

        Returns
        -------
        Guarded
            What to fly, whether that is the wish, and why.

        Raises
        ------
        ClearwayError
            Before the first own state estimate.
        InputError
            For a velocity that is not finite.
        """
        guarded = self._guard(wish, now_s, own_velocity_mps)
        if wish is None:
            return guarded
        return replace(guarded, changed_mps=self._measure_change_mps(wish, guarded))

    def _measure_change_mps(self, wish: Wish, guarded: Guarded) -> float:
        """By how much what is flown is off a wish when that ends to count: what replaces it begins
        with the own velocity."""
        if guarded.passed or self.held is None:
            return 0.0
        wished = wish.velocity_from(guarded.set_point.position_m, self.hold_s)
        _, flown = self.held.at(self._known.clock.own(guarded.time_s) + self.hold_s)
        if guarded.is_velocity:
            flown = guarded.velocity_mps
        if not self.planner.automaton.can_stop and wished.any():
            wished = wished * (self.planner.speed_mps / float(np.linalg.norm(wished)))
        return float(np.linalg.norm(flown - wished))

    def _guard(
        self, wish: Wish | None, now_s: float, own_velocity_mps: npt.ArrayLike | None
    ) -> Guarded:
        now = self._known.catch_up(now_s)
        state = replace(self._known.own_state(now), time_s=now)
        velocity = self._own_velocity(own_velocity_mps, now)
        around = in_calm(self._known.around(state, now))
        asked = Asked(state, velocity, around, bool(self._known.news))
        evades = self._admission.evade(wish, asked)
        if evades is not None:
            wish, why = evades, WOULD_MEET
            examined = self._admission.examine(evades, asked)
            if examined.passes:
                answer = self._take(examined, now, now_s, why)
                return replace(answer, slowed=False, evades=True)
        elif wish is not None:
            wished, fastest = wish, self.planner.speed_mps
            if self.planner.automaton.can_stop:
                wish = wish.slow_to(fastest)
            examined = self._admission.examine(wish, asked)
            if examined.passes:
                same = wish is wished
                why = PASSES if same else f"slowed to {fastest:g} m/s; {PASSES}"
                return self._take(examined, now, now_s, why, unchanged=same)
            why = f"the wish {examined.checked.flaw}"
            stands = self._holding.stands(now)
            near = self._admission.find_nearest(wish, asked, stands=stands)
            if near is not None:
                answer = self._take(near, now, now_s, why + NEAREST)
                return replace(answer, slowed=False, nearest=True)
        else:
            why = "nobody wishes anything"
        begins = asked._replace(state=self._holding.begin_decision(state, now))
        decision, more = self._replacement.find(wish, begins, self.obstacle_map)
        return self._replacement.answer(now, now_s, why + more, decision)

    def _take(
        self, examined: Examined, now: float, now_s: float, why: str, *, unchanged: bool = False
    ) -> Guarded:
        """Hold what passes, and say so."""
        way = examined.checked.way_out
        assert way is not None
        self._holding.take_leg(examined.leg, way, now)
        return self._admission.answer(examined, now_s, why, unchanged=unchanged)

    def _own_velocity(self, told_mps: npt.ArrayLike | None, now: float) -> FloatArray:
        """[3], where anything depends on it."""
        if told_mps is not None:
            told = np.asarray(told_mps, dtype=np.float64)
            if told.shape != (3,) or not np.all(np.isfinite(told)):
                raise InputError("guardian", ["own_velocity_mps: must be three finite numbers"])
            return told
        counts = self.planner.automaton.can_stop or math.isfinite(self.acceleration_mps2)
        return self._holding.velocity_at(now) if counts else np.zeros(3)

    # --- what is held ---------------------------------------------------------------------

    @property
    def held(self) -> Held | None:
        """What is flown if nobody asks any more."""
        return self._holding.held

    def state_at(self, time_s: float) -> State | None:
        """Return where what is held has the vehicle at a time.

        Parameters
        ----------
        time_s
            On the clock of the readings.

        Returns
        -------
        State or None
            World frame; None before anything is held.
        """
        return self._holding.state_at(time_s)

    def escape_ends_s(self, time_s: float) -> float | None:
        """Return when the escape held at a time has been flown.

        Parameters
        ----------
        time_s
            On the clock of the readings.

        Returns
        -------
        float or None
            As `AvoidanceSystem.escape_ends_s`.
        """
        return self._holding.escape_ends_s(time_s)

    def set_point_at(self, time_s: float) -> SetPoint | None:
        """Return what is held as a set-point of a time.

        Parameters
        ----------
        time_s
            On the clock of the readings.

        Returns
        -------
        SetPoint or None
            World frame; None before anything is held.
        """
        return self._holding.set_point_at(time_s)

    def let_go(self) -> None:
        """Forget what is held: nobody flies it."""
        self._holding.let_go()
