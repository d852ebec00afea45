"""The guardian: whoever flies keeps the say while what is wished leaves a way out.

A wish that is verified with a way out behind it passes unchanged. Else the nearest safe trajectory
is flown: the wish is the cost, everything else is `decide`. What was verified last stays in hand
and is flown on where nothing better is found, or nobody asks any more.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.avoidance.choose.candidates import STANDING_IS_WANTED, Commitment
from clearway.avoidance.choose.chosen import Basis
from clearway.avoidance.choose.passing import Passing
from clearway.avoidance.decide import decide
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.held_escape import WayOut
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Situation, margin_m
from clearway.base.brief import one_line
from clearway.base.checks import above_zero_problem, collect_problems
from clearway.base.errors import ClearwayError, InputError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.guard.aircraft_ahead import AircraftAhead
from clearway.live.guard.braking import find_braking
from clearway.live.guard.check import Checked, check_leg, in_calm, is_endangered
from clearway.live.guard.held import Held
from clearway.live.guard.leg import Leg, leg_of, off_kept_pitch
from clearway.live.guard.nearby import velocities_near
from clearway.live.guard.nearest import NearnessToWish, overshoot_m, planner_towards
from clearway.live.guard.wish import PathWish, VelocityWish, Wish
from clearway.live.inputs.own_states import split_velocity
from clearway.live.inputs.readings import Reading
from clearway.live.knowledge import Knowledge
from clearway.live.link.guarded import Guarded
from clearway.live.link.set_point import SetPoint
from clearway.live.mission import Mission, Mode
from clearway.live.outputs.explain import explanation
from clearway.live.preflight.escape_plan import escape_plan
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import AnySensor

LEVEL_RAD = math.radians(2.0)
"""A pitch that is no farther off counts as one that movements keep."""
PASSES = "the wish keeps the margin and leaves an escape"
WOULD_MEET = "the wish would meet an aircraft before it has passed"
NEAR_M = 0.3
"""Off what is in hand, at most half a margin: a vehicle that follows it is nearer."""
NOT_GOOD = (Basis.EMERGENCY, Basis.NO_LOITER)


class Guardian:
    """Feed it with `update`; ask it with `guard_velocity` or `guard_path` at a set rate.

    start: where it takes over. lidars, obstacle_map: as of `AvoidanceSystem`. hold_s: for how long
    a wish counts; after that a vehicle that can stop brakes, and then the way out is flown, until
    the next call.
    acceleration_mps2: at which a vehicle that can stop changes its velocity; None takes that of a
    vehicle with inertia, and 3 m/s2 of any other, which `braking` says. Raises ClearwayError for a
    planner that asks for no ways out, or a vehicle that has none.

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
        """Which ways out are kept in hand, and why."""
        self._nearness = NearnessToWish()
        self.planner = planner_towards(self.escape.adapt_planner(planner), self._nearness)
        escapes = self.planner.escapes
        if escapes is None:
            raise ClearwayError(f"guardian: needs escapes; {self.escape.why}")
        if planner.automaton.table is not None and not planner.automaton.has_inertia:
            raise ClearwayError("guardian: where wishes lead is not known of measured movements")
        self._escapes = escapes
        self.hold_s = hold_s
        self.acceleration_mps2, self.braking = find_braking(planner, acceleration_mps2)
        """Of the vehicle, and in words where that is from."""
        self.obstacle_map = obstacle_map
        ahead = start.position_m + planner.grid.range_m * start.world_from_body[:, 0]
        self._mission = Mission("guarded", start, waypoints_m=ahead[None])
        self._lidars = tuple(lidars)
        self._known = Knowledge(self.planner, self._mission, lidars, obstacle_map)
        self.held: Held | None = None
        """What is flown if nobody asks any more."""
        self._why = ""
        self._passings: tuple[Passing, ...] = ()
        self._had_certain = False
        self._aloof = True  # Whether ways out that keep the margin from the unseen are looked for.

    def __repr__(self) -> str:
        sensors = ", ".join(self._known.sensing.sensors) or "no sensor"
        flown = "no escape held" if self.held is None else "an escape held"
        return one_line("Guardian", (sensors, flown, f"{self.counts.total()} data left out"))

    @property
    def counts(self) -> Counter[str]:
        """Data left out, by reason."""
        return self._known.counts

    def begin_at(self, place_m: FloatArray) -> None:
        """As `AvoidanceSystem.begin_at`."""
        self._known.sensing.begin_at(place_m)

    def forget_free_space(self) -> None:
        """Count nothing as seen to be free any more: the own position has jumped."""
        self._known.sensing.forget_free_space()

    @property
    def floor_m(self) -> float:
        """Height of the world that nothing leads below."""
        return self._known.floor_m

    @floor_m.setter
    def floor_m(self, height_m: float) -> None:
        self._known.floor_m = height_m

    # --- readings -------------------------------------------------------------------------

    def update(self, reading: Reading) -> None:
        """Take an own state, a scan or an intruder, as `AvoidanceSystem.update` does."""
        self._known.put(reading)

    def receive(self, kind: type[Reading], *values: Any, **named: Any) -> bool:
        """Make a reading of raw values and take it; returns whether it could be made."""
        return self._known.receive(kind, *values, **named)

    def catch_up(self, now_s: float) -> None:
        """Take in what has come, held against the time; every question does so itself. For whoever
        has time before the next wish: a scan then costs that wish nothing."""
        self._known.catch_up(now_s)

    # --- wishes ---------------------------------------------------------------------------

    def guard_velocity(
        self,
        velocity_mps: npt.ArrayLike,
        now_s: float,
        *,
        yaw_rate_rps: float = 0.0,
        own_velocity_mps: npt.ArrayLike | None = None,
    ) -> Guarded:
        """A wished velocity [3], world frame: what is to be flown instead, or the same.

        own_velocity_mps: [3] as measured; default: as was told last. Raises ClearwayError before
        the first own state, InputError for what is not finite.
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
        """A wished path [n, 3], world frame, at a speed; by default the vehicle's."""
        speed = self.planner.speed_mps if speed_mps is None else speed_mps
        wish = PathWish(np.asarray(places_m, dtype=np.float64), speed)
        return self.guard(wish, now_s, own_velocity_mps=own_velocity_mps)

    def guard(
        self, wish: Wish | None, now_s: float, *, own_velocity_mps: npt.ArrayLike | None = None
    ) -> Guarded:
        """A wish, or None where nobody wishes anything: what is in hand is flown on then."""
        guarded = self._guard(wish, now_s, own_velocity_mps)
        if wish is None:
            return guarded
        return replace(guarded, changed_mps=self._changed_mps(wish, guarded))

    def _changed_mps(self, wish: Wish, guarded: Guarded) -> float:
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
        evades = self._evades(wish, state, velocity, around)
        if evades is not None:
            wish, self._why = evades, WOULD_MEET
            leg, checked = self._checked(evades, state, velocity, around)
            if not checked.flaw and checked.way_out is not None:
                self._hold_leg(leg, checked.way_out, now)
                passes = self._passes(evades, leg, checked, now_s, unchanged=False)
                return replace(passes, slowed=False, evades=True)
        elif wish is not None:
            wished, fastest = wish, self.planner.speed_mps
            if self.planner.automaton.can_stop:
                wish = wish.slowed_to(fastest)
            leg, checked = self._checked(wish, state, velocity, around)
            if not checked.flaw and checked.way_out is not None:
                self._hold_leg(leg, checked.way_out, now)
                same = wish is wished
                self._why = PASSES if same else f"slowed to {fastest:g} m/s; {PASSES}"
                return self._passes(wish, leg, checked, now_s, unchanged=same)
            self._why = f"the wish {checked.flaw}"
            near = self._nearest(wish, state, velocity, around, now)
            if near is not None:
                return replace(near, time_s=now_s)
        else:
            self._why = "nobody wishes anything"
        decision = self._instead(wish, self._from_held(state, now), velocity, around, now)
        return self._replaced(now, now_s, decision)

    def _hold_leg(self, leg: Leg, way: WayOut, now: float) -> None:
        self.held = Held.of_leg(self.planner.automaton, leg, way)
        self._known.flown.until(now)
        self._settle()

    def _evades(
        self, wish: Wish | None, state: State, velocity: FloatArray, around: Situation
    ) -> VelocityWish | None:
        """What to fly in place of a wish that would meet an aircraft until that has passed; None
        where it would not, and for vehicles that cannot stop."""
        automaton, settings = self.planner.automaton, self.planner.settings
        if not around.intruders or not automaton.can_stop:
            return None
        wished = np.zeros(3) if wish is None else wish.velocity_from(state.position_m, self.hold_s)
        ahead = AircraftAhead(
            state.position_m,
            velocity,
            [one.at(state.time_s) for one in around.intruders],
            margin_m(settings, around),
            settings.sigmas,
            self.acceleration_mps2,
        )
        clear = ahead.nearest_clear(wished, automaton)
        return None if clear is None else VelocityWish(clear)

    def _nearest(
        self, wish: Wish, state: State, velocity: FloatArray, around: Situation, now: float
    ) -> Guarded | None:
        """The velocity nearest to a wished one that keeps the margin and leaves a way out; None
        where there is none, for paths, and for vehicles that cannot stop."""
        if not self.planner.automaton.can_stop or not isinstance(wish, VelocityWish):
            return None
        held = self.held
        stands = held is not None and held.leg is None and not held.at(now)[1].any()
        for near in velocities_near(wish.velocity_mps, stands=stands):
            other = replace(wish, velocity_mps=near)
            leg, checked = self._checked(other, state, velocity, around)
            if checked.flaw or checked.way_out is None:
                continue
            if self._evades(other, state, velocity, around) is not None:
                continue
            self._hold_leg(leg, checked.way_out, now)
            self._why += "; the nearest velocity that does not is flown"
            passes = self._passes(other, leg, checked, now, unchanged=False)
            return replace(passes, slowed=False, nearest=True)
        return None

    def _from_held(self, state: State, now: float) -> State:
        """The own state that a decision starts from: on what is in hand while the vehicle is near
        it, so that it neither creeps where it holds nor starts anew in the middle of a movement."""
        held, automaton = self.held, self.planner.automaton
        if held is None or not automaton.can_stop:
            return state
        there, velocity = held.at(now)
        stands = not velocity.any()
        off_m = float(np.linalg.norm(there.position_m - state.position_m))
        near_m = min(NEAR_M, 0.5 * self.planner.settings.safety_margin_m)
        if off_m > near_m or not (stands or (automaton.has_inertia and held.leg is None)):
            return state
        kept = replace(state, position_m=there.position_m, attitude_rad=there.attitude_rad)
        if automaton.classes is None:
            return kept
        return automaton.in_class(kept, automaton.classes.class_near(*split_velocity(velocity)))

    def state_at(self, time_s: float) -> State | None:
        """Where what is in hand has the vehicle at a time; None before anything is."""
        own = self._known.clock.own(time_s)
        return None if self.held is None else replace(self.held.at(own)[0], time_s=time_s)

    def escape_ends_s(self, time_s: float) -> float | None:
        """When the way out held at a time has been flown, as `AvoidanceSystem.escape_ends_s`."""
        clock = self._known.clock
        ends_s = None if self.held is None else self.held.escape_ends_s(clock.own(time_s))
        return None if ends_s is None else clock.to_stated(ends_s)

    def set_point_at(self, time_s: float) -> SetPoint | None:
        """What is in hand as a set-point of a time; None before anything is."""
        if self.held is None:
            return None
        own_s = self._known.clock.own(time_s)
        asked = self.held.reference_at(own_s)
        if asked is not None:
            return SetPoint.of_reference(asked)
        state, velocity = self.held.at(own_s)
        return SetPoint(state.position_m, velocity, float(state.attitude_rad[2]))

    def let_go(self) -> None:
        """Forget what is in hand: nobody flies it."""
        if self.held is not None:
            self._known.flown.until(self.held.start.time_s)
        self.held, self._passings = None, ()

    # --- how ------------------------------------------------------------------------------

    def _own_velocity(self, told_mps: npt.ArrayLike | None, now: float) -> FloatArray:
        """[3], where anything depends on it."""
        if told_mps is not None:
            told = np.asarray(told_mps, dtype=np.float64)
            if told.shape != (3,) or not np.all(np.isfinite(told)):
                raise InputError("guardian", ["own_velocity_mps: must be three finite numbers"])
            return told
        counts = self.planner.automaton.can_stop or math.isfinite(self.acceleration_mps2)
        return self.held.at(now)[1] if counts and self.held is not None else np.zeros(3)

    def _checked(
        self, wish: Wish, state: State, velocity: FloatArray, around: Situation
    ) -> tuple[Leg, Checked]:
        automaton = self.planner.automaton
        leg = leg_of(wish, state, velocity, automaton, self.hold_s, self.acceleration_mps2)
        if not automaton.can_stop and not wish.fastest_mps > 0.0:
            return leg, Checked("stands still, which the vehicle cannot", math.nan)
        # Where there was none, there is none a moment later, until more has been seen.
        aloof = self._aloof or bool(self._known.news)
        checked = check_leg(self.planner, self._escapes, around, leg, aloof=aloof)
        self._aloof = checked.aloof
        return leg, checked

    def _instead(
        self,
        wish: Wish | None,
        state: State,
        velocity: FloatArray,
        around: Situation,
        now: float,
    ) -> Decision | None:
        """Decide if what is in hand does not go on; None where it does."""
        held = self.held
        threat = held is not None and self._threat(held, around, now)
        goes_on = held is not None and held.leg is None and now < held.renew_s - 1e-6
        if goes_on and not threat:
            return None
        if held is not None and held.loop and not threat and self._between_pitches(state):
            self._why += "; the held escape is flown on to a pitch that movements keep"
            return None
        decision = self._decide(wish, state, velocity, now)
        good = decision.choice.basis not in NOT_GOOD and _certain(decision.way_out)
        at_end = held is not None and held.way_out_at(now) is not None
        if held is not None and held.loop and not good and not at_end:
            # Between two movements a decision falls back on the way out in hand by itself.
            beside = threat and _certain(decision.way_out)
            if not beside:
                self._why += "; the held escape is flown on"
                return None
        self.held = Held.of_decision(self.planner.automaton, decision)
        classes, at = self.planner.automaton.classes, None
        if classes is not None:
            at = classes.class_at(float(decision.state.attitude_rad[0]))
        self._known.flown.then(self.held.movements, at)
        self._passings = decision.passings
        self._settle()
        self._why += f"; {explanation(decision, Mode.AVOIDANCE, self.obstacle_map)}"
        return decision

    def _between_pitches(self, state: State) -> bool:
        """Whether movements from here would climb or sink for ever."""
        if self.planner.automaton.keeps_attitude:
            return False
        return abs(off_kept_pitch(float(state.attitude_rad[1]), self.planner.automaton)) > LEVEL_RAD

    def _settle(self) -> None:
        held = self.held
        self._had_certain = self._had_certain or (held is not None and _certain(held.way_out))
        self._known.news, self._known.unchecked = "", False

    def _decide(
        self, wish: Wish | None, state: State, velocity: FloatArray, now: float
    ) -> Decision:
        situation, _ = self._known.with_detections(state, now)
        wished = np.zeros(3) if wish is None else wish.velocity_from(state.position_m, self.hold_s)
        unsure_m = overshoot_m(self.planner.automaton, state, velocity, self.acceleration_mps2)
        held = None if self.held is None else self.held.way_out_at(now)
        return decide(
            self.planner,
            self._nearness.towards(wished, in_calm(situation), self.planner, unsure_m),
            commitment=Commitment(
                stood=STANDING_IS_WANTED,
                passings=self._passings,
                way_out=held,
                had_certain=self._had_certain,
            ),
        )

    def _threat(self, held: Held, around: Situation, now: float) -> bool:
        """Whether anything new comes nearer to what is in hand than the margin."""
        if self._known.unchecked:
            self._known.unchecked = is_endangered(held, self.planner, around, now)
        return self._known.unchecked

    # --- what is told ---------------------------------------------------------------------

    def _passes(
        self, wish: Wish, leg: Leg, checked: Checked, now_s: float, *, unchanged: bool
    ) -> Guarded:
        velocity = wish.velocity_from(leg.start.position_m, self.hold_s)
        state = leg.start
        rate = wish.yaw_rate_rps if isinstance(wish, VelocityWish) else 0.0
        if not self.planner.automaton.can_stop:
            rate = float(leg.end.attitude_rad[2] - state.attitude_rad[2]) / leg.end_s
        point = SetPoint(state.position_m, velocity, float(state.attitude_rad[2]))
        return Guarded(
            now_s,
            unchanged,
            point,
            velocity,
            rate,
            self._why,
            checked.margin_m,
            checked.way_out,
            slowed=not unchanged,
        )

    def _replaced(self, now: float, now_s: float, decision: Decision | None) -> Guarded:
        held = self.held
        assert held is not None  # A decision always ends in something to fly.
        state, velocity = held.at(now)
        soon, _ = held.at(now + 0.1)
        turned = float(soon.attitude_rad[2] - state.attitude_rad[2]) / 0.1
        point = SetPoint(state.position_m, velocity, float(state.attitude_rad[2]))
        margin = self.planner.settings.safety_margin_m if decision is None else decision.margin_m
        way, why = held.way_out, self._why
        return Guarded(now_s, False, point, velocity, turned, why, margin, way, decision=decision)


def _certain(way: WayOut | None) -> bool:
    return way is not None and way.certain
