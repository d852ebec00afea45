"""Which wishes may pass, and which velocity near one may where it may not."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Situation, margin_m
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.guard.aircraft_ahead import AircraftAhead
from clearway.live.guard.braking import Braking
from clearway.live.guard.check import Checked, check_leg
from clearway.live.guard.leg import Leg, leg_of
from clearway.live.guard.nearby import velocities_near
from clearway.live.guard.wish import PathWish, VelocityWish, Wish
from clearway.live.link.guarded import Guarded
from clearway.live.link.set_point import SetPoint


class Asked(NamedTuple):
    """What a wish is checked against."""

    state: State
    velocity_mps: FloatArray
    """[3] of the vehicle, world frame."""
    around: Situation
    has_news: bool
    """Whether anything has been seen since what is held was verified."""


class Examined(NamedTuple):
    """A wish, where it leads, and what was found out."""

    wish: Wish
    leg: Leg
    checked: Checked

    @property
    def passes(self) -> bool:
        """Whether it keeps the margin and leaves an escape."""
        return not self.checked.flaw and self.checked.way_out is not None


class Admission:
    """Examines wishes for one vehicle.

    hold_s: for how long a wish counts. brakes: how the vehicle changes its velocity.
    """

    def __init__(self, planner: Planner, hold_s: float, brakes: Braking) -> None:
        if planner.escapes is None:
            raise ClearwayError("guardian: needs escapes")
        self.planner, self.hold_s = planner, hold_s
        self._escapes, self._brakes = planner.escapes, brakes
        self._aloof = (
            True  # Whether escapes that keep the margin from unobserved space are looked for.
        )

    def examine(self, wish: Wish, asked: Asked) -> Examined:
        """Hold a wish against all that is known."""
        automaton = self.planner.automaton
        leg = leg_of(wish, asked.state, asked.velocity_mps, automaton, self.hold_s, self._brakes)
        if not automaton.can_stop and not wish.fastest_mps > 0.0:
            flaw = Checked("stands still, which the vehicle cannot", math.nan)
            return Examined(wish, leg, flaw)
        # Where there was none, there is none a moment later, until more has been seen.
        aloof = self._aloof or asked.has_news
        checked = check_leg(self.planner, self._escapes, asked.around, leg, aloof=aloof)
        self._aloof = checked.aloof
        examined = Examined(wish, leg, checked)
        return self._examine_eager(examined, asked) if examined.passes else examined

    def _examine_eager(self, examined: Examined, asked: Asked) -> Examined:
        """Hold a wish that passes against an autopilot that comes to it sooner than is planned, and
        brakes later: also at the wished velocity, where nothing is gained any more."""
        automaton, brakes, own = self.planner.automaton, self._brakes, asked.velocity_mps
        if not automaton.has_inertia:
            return examined
        leg = leg_of(
            examined.wish, asked.state, own, automaton, self.hold_s, brakes.late, brakes.eager
        )
        checked = check_leg(self.planner, self._escapes, asked.around, leg, aloof=self._aloof)
        if checked.flaw or checked.way_out is None:
            return examined._replace(checked=checked)
        return examined

    def evade(self, wish: Wish | None, asked: Asked) -> VelocityWish | None:
        """What to fly in place of a wish that would meet an aircraft until that has passed; None
        where it would not, and for vehicles that cannot stop."""
        automaton, settings = self.planner.automaton, self.planner.settings
        state, around = asked.state, asked.around
        if not around.intruders or not automaton.can_stop:
            return None
        wished = np.zeros(3) if wish is None else wish.velocity_from(state.position_m, self.hold_s)
        ahead = AircraftAhead(
            state.position_m,
            asked.velocity_mps,
            [one.at(state.time_s) for one in around.intruders],
            margin_m(settings, around),
            settings.sigmas,
            self._brakes.acceleration_mps2,
        )
        clear = ahead.nearest_clear(wished, automaton)
        return None if clear is None else VelocityWish(clear)

    def find_nearest(self, wish: Wish, asked: Asked, *, stands: bool) -> Examined | None:
        """The velocity nearest to a wished one that passes; None where there is none, for paths,
        and for vehicles that cannot stop.

        stands: whether the vehicle holds a place.
        """
        if not self.planner.automaton.can_stop or not isinstance(wish, VelocityWish):
            return None
        for near in velocities_near(wish.velocity_mps, stands=stands):
            other = self.examine(replace(wish, velocity_mps=near), asked)
            if other.passes and self.evade(other.wish, asked) is None:
                return other
        return None

    def answer(self, examined: Examined, now_s: float, why: str, *, unchanged: bool) -> Guarded:
        """What a guardian says of a wish that passes."""
        wish, leg, checked = examined
        velocity = wish.velocity_from(leg.start.position_m, self.hold_s)
        state = leg.start
        rate = 0.0 if isinstance(wish, PathWish) else wish.yaw_rate_rps
        if not self.planner.automaton.can_stop:
            rate = float(leg.end.attitude_rad[2] - state.attitude_rad[2]) / leg.end_s
        point = SetPoint(state.position_m, velocity, float(state.attitude_rad[2]))
        return Guarded(
            now_s,
            unchanged,
            point,
            velocity,
            rate,
            why,
            checked.margin_m,
            checked.way_out,
            slowed=not unchanged,
        )
