"""Why a decision is due: the plan says so, the vehicle has left its tube, or something is new.

In the middle of a movement news counts only if it endangers the plan: decided anew with every scan,
from between two movements, the vehicle would waver for ever.
"""

from __future__ import annotations

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.situation import Situation, widest_margin_m
from clearway.base.state import State
from clearway.live.danger import find_danger
from clearway.live.knowledge import Knowledge
from clearway.live.plan import Plan

GROWN = 0.01
"""Share of the safety margin by which the margin must have grown to be news."""


class PlanWatch:
    """Holds a plan against what is known, as often as anybody asks."""

    def __init__(self, planner: Planner, known: Knowledge) -> None:
        self._planner, self._known = planner, known
        self._kept_m = np.inf  # The margin that the plan was last held against, at its widest.
        self._held_against: State | None = None  # The own state last held against the plan's tube.
        self._astray = False  # Whether that state left it.
        self.ahead_s = 0.0
        """How long before a movement ends the next one is decided."""

    def note_decision(self, situation: Situation) -> None:
        """A plan was made for a situation: the margin kept there is no news."""
        self._astray = False
        self._kept_m = widest_margin_m(self._planner, situation)

    def due(self, plan: Plan, now: float) -> str | None:
        """Why a decision is due now, or None while the plan may be flown on."""
        known = self._known
        strayed = self._find_strayed(plan)  # Counted also where a decision is due anyway.
        due = plan.due(now + self.ahead_s, known.progress.goal)
        if self._planner.automaton.has_inertia:
            due = strayed or due  # The margin grows by it: the log says so.
        due = due or strayed
        if due or not (known.news or self._margin_has_grown(plan, now)):
            return due
        if known.news and not (
            self._planner.settings.verify and plan.in_first_movement(now + self.ahead_s)
        ):
            return known.news
        if not known.unchecked:
            return None
        danger = self.find_danger_at(plan, now)
        known.unchecked = danger is not None
        return danger

    def find_danger_at(self, plan: Plan, now: float) -> str | None:
        """By what the plan being flown lacks the margin, as far as is known now."""
        around = self._known.around(self._known.own_states.at(now), now)
        return find_danger(plan, self._planner, around, now)

    def _find_strayed(self, plan: Plan) -> str | None:
        """Whether the latest own state estimate left the tube of the plan; each is looked at
        once."""
        known = self._known
        if self._planner.automaton.classes is None or not known.own_states.reach_back_to(np.inf):
            return None
        latest = known.own_states.latest
        if latest is self._held_against:
            return None
        self._held_against = latest
        beyond_m = self._beyond_m(plan)
        if beyond_m <= 0.0:
            return None
        known.counts["state: outside the tube of its plan"] += 1
        if not self._planner.automaton.has_inertia:
            strayed_m = plan.measure_strayed_m(latest)
            return f"the vehicle is {strayed_m:.2f} m outside the tube of its plan"
        widened_m = known.tracking.excess_m(latest.time_s)
        if known.followed:
            known.tracking.take(latest.time_s, beyond_m)
        self._astray = beyond_m > widened_m
        if not self._astray:
            return None
        return (
            f"the vehicle is {beyond_m:.2f} m outside the tube of its plan; the margin grows by "
            f"{known.tracking.excess_m(latest.time_s):.2f} m"
        )

    def _beyond_m(self, plan: Plan) -> float:
        """By how much the latest own state estimate lies outside the tube, beyond what is unsure of
        it."""
        known = self._known
        latest = known.own_states.latest
        settings, flown_s = self._planner.settings, latest.time_s - plan.buffer.start_s
        unsure_mps = known.wind.sigma_mps if known.wind.wind_mps.any() else 0.0
        unsure_m = settings.sigmas * (latest.position_std_m + unsure_mps * max(flown_s, 0.0))
        return plan.measure_strayed_m(latest) - unsure_m

    def keeps_to(self, plan: Plan) -> bool:
        """Whether a vehicle with inertia follows the plan: it then stays what is asked of it."""
        if not (self._planner.automaton.has_inertia and self._known.followed):
            return False
        self._find_strayed(plan)
        return not self._astray

    def _margin_has_grown(self, plan: Plan, now: float) -> bool:
        """Whether more must be kept now than the plan has been checked against; it then is anew."""
        if plan.decision is None:
            return False
        here = self._known.here(self._known.own_states.latest, now)
        needed_m = widest_margin_m(self._planner, here)
        if needed_m <= self._kept_m + GROWN * self._planner.settings.safety_margin_m:
            return False
        self._kept_m, self._known.unchecked = needed_m, True
        return True
