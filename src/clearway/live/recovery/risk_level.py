"""With `escape = "known"`: for how long escapes through seen space are insisted on.

While the goal comes nearer, or might, escapes lead through what was seen to be free, as with
`strict`. Where it has not come nearer for some full circles' time, unobserved space counts as free
and no escape is asked for, until the goal is reached or that has come to nothing as well.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.avoidance.plan.held_escape import Escape
from clearway.avoidance.plan.planner import Planner
from clearway.base.frames import measure_length
from clearway.live.knowledge import Knowledge
from clearway.live.mission import Progress
from clearway.live.recovery.dead_end import MISSED, full_circle, straight_again

PATIENCE = 1.5
LONGEST = 10.0
"""Full circles' time without success after which the other way is tried, and without the goal
coming nearer though ways to it did."""


@dataclass(frozen=True, slots=True)
class Boldness:
    """Whether escapes are insisted on no more, since when, and for which goal."""

    bold: bool = False
    since_s: float = 0.0
    goal: int = 0

    def after(self, progress: Progress, now_s: float, turn_s: float) -> Boldness:
        """At a moment; turn_s: time of a full circle."""
        if progress.goal != self.goal:
            return Boldness(since_s=now_s, goal=progress.goal)
        idle_s = now_s - max(progress.nearest_s, self.since_s)
        if progress.in_vain_s <= PATIENCE * turn_s and idle_s <= LONGEST * turn_s:
            return self
        return Boldness(not self.bold, now_s, self.goal)


class Insistence:
    """Who decides from moment to moment: a planner that insists, or one that does not."""

    def __init__(self, planner: Planner) -> None:
        self._careful = planner.with_values(escape=Escape.STRICT)
        self._bold = planner.with_values(escape=Escape.OFF)
        self._now = Boldness()

    @property
    def bold(self) -> bool:
        """Whether escapes are insisted on no more."""
        return self._now.bold

    def decides(self, knowledge: Knowledge, now_s: float, *, blind: bool = False) -> Planner:
        """Who does at a moment; where that changes, all ways are tried once more.

        blind: whether no sensor tells anything: who sees nothing waits, whatever came to nothing.
        """
        if blind:
            return self._careful
        routes = knowledge.seen_routes
        assert routes is not None  # Seen space is kept where ways out need it.
        before, (radius, turn_s) = self._now, full_circle(knowledge)
        now = self._now = before.after(knowledge.progress, now_s, turn_s)
        if now.bold != before.bold:
            knowledge.progress = self._anew(knowledge, now_s, MISSED * radius)
            routes.try_all_again()
        return self._bold if self.bold else self._careful

    def _anew(self, knowledge: Knowledge, now_s: float, near_m: float) -> Progress:
        """Return progress straight for the goal. A bold vehicle takes the best way at once: it may
        be a gap far behind, unless the goal is near."""
        before, place_m = knowledge.progress, knowledge.own_states.latest.position_m
        anew = straight_again(before, now_s)
        away_m = measure_length(knowledge.mission.goals_m[before.goal] - place_m)
        if self.bold and before.stuck_m is not None and away_m > near_m:
            return replace(anew, stuck_m=before.stuck_m, planned_s=-np.inf)
        return anew
