"""What a guardian holds: the last that was verified, flown on if nobody asks any more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clearway.avoidance.choose.passing import Passing
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.held_escape import WayOut
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Situation
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.guard.check import is_endangered
from clearway.live.guard.held import Held
from clearway.live.guard.leg import Leg
from clearway.live.inputs.own_states import split_velocity
from clearway.live.knowledge import Knowledge
from clearway.live.link.set_point import SetPoint

NEAR_M = 0.3
"""Off what is held, at most half a margin: a vehicle that follows it is nearer."""


class Holding:
    """A leg or a decision with the escape behind it, kept in step with what is known.

    late_s: by which the vehicle answers later than it is commanded.
    """

    def __init__(self, planner: Planner, known: Knowledge, late_s: float) -> None:
        self.planner, self._late_s = planner, late_s
        self._known = known
        self.held: Held | None = None
        self.passings: tuple[Passing, ...] = ()
        """Of aircraft, as the decision that is held has them."""
        self.had_certain = False
        """Whether there ever was an escape that is certain."""

    # --- changes --------------------------------------------------------------------------

    def take_leg(self, leg: Leg, way: WayOut, now: float) -> None:
        """Hold the leg of a wish that passed."""
        self.held = Held.of_leg(self.planner.automaton, leg, way)
        self._known.flown.until(now)
        self._settle(self.held)

    def take_decision(self, decision: Decision) -> None:
        """Hold what a decision flies in place of a wish."""
        self.held = Held.of_decision(self.planner.automaton, decision)
        classes, at = self.planner.automaton.classes, None
        if classes is not None:
            at = classes.class_at(float(decision.state.attitude_rad[0]))
        self._known.flown.then(self.held.movements, at)
        self.passings = decision.passings
        self._settle(self.held)

    def let_go(self) -> None:
        """Forget what is held: nobody flies it."""
        if self.held is not None:
            self._known.flown.until(self.held.start.time_s)
        self.held, self.passings = None, ()

    def _settle(self, held: Held) -> None:
        self.had_certain = self.had_certain or is_certain(held.way_out)
        self._known.news, self._known.unchecked = "", False

    # --- questions ------------------------------------------------------------------------

    def is_threatened(self, around: Situation, now: float) -> bool:
        """Whether anything new comes nearer to what is held than the margin."""
        if self.held is None:
            return False
        if self._known.unchecked:
            self._known.unchecked = is_endangered(self.held, self.planner, around, now)
        return self._known.unchecked

    def stands(self, now: float) -> bool:
        """Whether a place is held in place of a wish."""
        held = self.held
        return held is not None and held.leg is None and not held.at(now)[1].any()

    def velocity_at(self, now: float) -> FloatArray:
        """[3] that the vehicle flies at; zero before anything is held."""
        return np.zeros(3) if self.held is None else self.held.at(now)[1]

    def begin_decision(self, state: State, now: float) -> State:
        """The own state that a decision starts from: on what is held while the vehicle is near it,
        so that it neither creeps where it holds nor starts anew in the middle of a movement."""
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

    # --- by the time of the caller ------------------------------------------------------

    def state_at(self, time_s: float) -> State | None:
        """Where it has the vehicle at a time; None before anything is held."""
        own = self._known.clock.own(time_s)
        return None if self.held is None else replace(self.held.at(own)[0], time_s=time_s)

    def escape_ends_s(self, time_s: float) -> float | None:
        """When the escape held at a time has been flown, as `AvoidanceSystem.escape_ends_s`."""
        clock = self._known.clock
        ends_s = None if self.held is None else self.held.escape_ends_s(clock.own(time_s))
        return None if ends_s is None else clock.to_stated(ends_s)

    def set_point_at(self, time_s: float) -> SetPoint | None:
        """What is held as a set-point of a time; None before anything is."""
        if self.held is None:
            return None
        own_s = self._known.clock.own(time_s)
        asked = self.held.reference_at(own_s)
        if asked is not None:
            return SetPoint.of_reference(asked)
        return self.command_at(own_s)[0]

    def command_at(self, own_s: float) -> tuple[SetPoint, FloatArray]:
        """Place, velocity and yaw of an own time, and the velocity [3]; something is held.

        A vehicle that answers late is commanded its velocity early.
        """
        assert self.held is not None
        state, _ = self.held.at(own_s)
        _, velocity = self.held.at(own_s + self._late_s)
        return SetPoint(state.position_m, velocity, float(state.attitude_rad[2])), velocity


def is_certain(way: WayOut | None) -> bool:
    """Whether there is an escape, and it keeps the margin for certain."""
    return way is not None and way.certain
