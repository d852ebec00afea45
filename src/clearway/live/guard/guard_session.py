"""A session in which somebody else commands: wishes in, what the guardian lets through out."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray, world_from_body
from clearway.live.guard.aircraft_ahead import LOOKS_S
from clearway.live.guard.guardian import Guardian
from clearway.live.guard.wish import VelocityWish, Wish
from clearway.live.link.guarded import Guarded
from clearway.live.link.hearing import Hearing, SessionTerms
from clearway.live.link.lead import OwnSpeed
from clearway.live.link.link_state import LinkState, link_state
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.own_motion import OwnMotion
from clearway.live.link.set_point import SetPoint
from clearway.sensors import Lidar

OFF_HAND_S = 1.0
"""At the own speed: farther off what is held, no vehicle flies it."""
NO_GOALS = np.zeros((0, 3))
NO_PLACE = "wish: no own position yet"

WishMaker = Callable[[OwnMotion], Wish]
"""Own motion -> the wish: commands in the body are to be read anew as the nose turns."""


class Wished(NamedTuple):
    """The newest wish."""

    wish_of: WishMaker
    message: object
    """As it came."""
    heard_s: float
    """By the vehicle's clock."""


def looking_past(terms: SessionTerms) -> SessionTerms:
    """Terms by which aircraft are reported as early as wishes are checked against them."""
    seconds = max(terms.traffic.horizon_s, LOOKS_S)
    return replace(terms, traffic=replace(terms.traffic, horizon_s=seconds))


class GuardSession(Hearing):
    """Feed it with the `hear_` methods, and ask it with `tick` at a set rate.

    guardian: with `sensor` as its only LiDAR (None where there is none). wish_s: for how
    long a wish counts after it came; after that what is held is flown on. Before the first wish
    nothing is sent.
    """

    def __init__(
        self,
        guardian: Guardian,
        sensor: Lidar | None,
        terms: SessionTerms,
        counts: Counter[str],
        *,
        wish_s: float = 0.5,
    ) -> None:
        super().__init__(guardian, sensor, terms, counts)
        self.guardian, self.wish_s = guardian, wish_s
        self._own_speed = OwnSpeed(self.speed_mps)
        self.tally: Counter[str] = Counter()
        """Wishes that came, and ticks: passed, slowed, nearest, replaced, without a wish."""
        self.changed_mps = self.most_changed_mps = 0.0
        """By how much wishes were changed: the sum of all ticks with one, and the most."""
        self._wished: Wished | None = None
        self._is_new = False  # Whether a wish has come since the last tick.
        self._now_s = 0.0  # Of the last tick.

    # --- in -------------------------------------------------------------------------------

    def hear_wish(self, wish_of: WishMaker, message: object, wall_s: float) -> None:
        """What somebody wishes from now on; raises InputError for what is no wish."""
        if self.motion is None:
            self.counts[NO_PLACE] += 1
            return
        wish_of(self.motion)
        self._wished = Wished(wish_of, message, self.clock.now(wall_s))
        self._is_new = True
        self.tally["wishes"] += 1

    @property
    def pressing(self) -> bool:
        """A wish, or a scan."""
        return self._is_new or super().pressing

    def hear_goal(self, _place_m: FloatArray, _wall_s: float) -> str | None:
        """A guardian has no goals of its own."""
        return "a guardian has no goals: send them to what commands it"

    # --- out ------------------------------------------------------------------------------

    @property
    def refusal(self) -> str | None:
        """Why the vehicle may not be led; None if it may."""
        return self.terms.floor.refusal(self._ground_m, NO_GOALS, 0.0)

    def tick(self, wall_s: float) -> TickOutcome:
        """Hold the newest wish against all that is known, and say what is to be flown."""
        now, self._is_new = self.clock.now(wall_s), False
        self._now_s = now
        self.guardian.floor_m = self.floor_m
        self._note_hand_over()
        self._take_scans()
        if self._is_led != self._led or self._is_off_hand():
            self.guardian.let_go()
            self._following.begin()
        self._led = self._is_led
        refusal = self.refusal
        facts = self._facts(now, wall_s, arrived=False, refused=refusal is not None)
        self.state = link_state(facts, self.terms.limits)
        started = time.perf_counter()
        wished = self._fresh(now)
        guarded = self._guard(wished, now)
        elapsed_s = time.perf_counter() - started
        unchanged = None
        if guarded is not None and guarded.passed and wished is not None:
            unchanged = wished.message
        point = self._pick_set_point(now, self._leading(guarded, now))
        return TickOutcome(
            now,
            self.state,
            None,
            "",
            elapsed_s,
            point,
            (),
            self._why_state(refusal),
            guarded=guarded,
            wished=unchanged,
        )

    def _fresh(self, now: float) -> Wished | None:
        """The newest wish while it counts; a sensor that is lost cannot vouch for any."""
        wished = self._wished
        if wished is None or not self.state.decides or now - wished.heard_s > self.wish_s:
            return None
        return wished

    def _guard(self, wished: Wished | None, now: float) -> Guarded | None:
        """What the guardian says; None before the first wish, and where it cannot say anything."""
        asked = self.state.decides or self.state is LinkState.SENSOR_LOST
        if not asked or self.motion is None:
            return None
        self._take_reports()
        if wished is None and self.guardian.held is None:
            return None
        wish = None if wished is None else self._turning(wished.wish_of(self.motion))
        guarded = self.guardian.guard(wish, now, own_velocity_mps=self.motion.velocity_mps)
        self.tally["without a wish" if wish is None else guarded.what] += 1
        if guarded.changed_mps is not None:
            self.changed_mps += guarded.changed_mps
            self.most_changed_mps = max(self.most_changed_mps, guarded.changed_mps)
        return guarded

    def _turning(self, wish: Wish) -> Wish:
        """Of a vehicle that cannot stop a direction counts: the one that it turns to meanwhile."""
        if self.guardian.planner.automaton.can_stop or not isinstance(wish, VelocityWish):
            return wish
        turned = world_from_body([0.0, 0.0, wish.yaw_rate_rps * self.guardian.hold_s])
        return replace(wish, velocity_mps=turned @ wish.velocity_mps)

    def _is_off_hand(self) -> bool:
        if self._own is None or self.guardian.held is None:
            return False
        held = self.guardian.state_at(self._own.time_s)
        if held is None:
            return False
        off = float(np.linalg.norm(held.position_m - self._own.position_m))
        return off > OFF_HAND_S * self.speed_mps

    def _leading(self, guarded: Guarded | None, now: float) -> SetPoint | None:
        if self._own is None or self.motion is None:
            return None
        if guarded is not None and guarded.is_velocity:
            return guarded.set_point
        if guarded is None and self.state is not LinkState.STALE:
            return None
        ahead = self.guardian.set_point_at(now + self.terms.lead_s)
        if ahead is None:
            return None
        counts_s = now + self.terms.lead_s
        return self._own_speed.limit(ahead, self._own, self.motion.velocity_mps, counts_s)

    def _escape_lasts_s(self) -> float | None:
        begins_s = self._now_s + self.terms.lead_s
        ends_s = self.guardian.escape_ends_s(begins_s)
        return None if ends_s is None else ends_s - begins_s

    def _on_escape(self, later_s: float) -> SetPoint | None:
        return self.guardian.set_point_at(self._now_s + self.terms.lead_s + later_s)
