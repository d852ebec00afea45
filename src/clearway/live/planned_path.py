"""The path of the plan being flown, held against what has become known since it was decided."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.avoidance.decide import Decision, in_reach
from clearway.avoidance.hazards import Cause
from clearway.avoidance.planner import Planner
from clearway.avoidance.situation import Situation, grid_frame, margin_m, margin_slope
from clearway.avoidance.verify import ROUNDING_M, Paths, path_clearance, sloping
from clearway.base.frames import FloatArray
from clearway.live.readings import TIME_TOLERANCE_S

NEWS = {Cause.POINT: "a return", Cause.MAP: "the map", Cause.INTRUDER: "an intruder"}


@dataclass(frozen=True, slots=True, eq=False)
class PlannedPath:
    """Where a decision's movements lead, if they are flown as predicted."""

    points_m: FloatArray
    """[points, 3] world frame, from the place of the decision on."""
    time_s: FloatArray
    """[points]"""
    sagitta_m: float
    """How far the path may lie off the chords between them."""

    @classmethod
    def of(cls, decision: Decision, decided_s: float) -> PlannedPath:
        """Of the trajectory chosen, its samples at equal times within each movement."""
        reach_set = decision.prepared.reach_set
        nodes = reach_set.path(decision.choice.node)
        ends = np.concatenate([[0.0], reach_set.end_time_s[nodes]])
        share = np.arange(1, reach_set.samples_m.shape[1] + 1) / reach_set.samples_m.shape[1]
        times = (ends[:-1, None] + np.diff(ends)[:, None] * share).ravel()
        return cls(
            decision.path_m,
            decided_s + np.concatenate([[0.0], times]),
            float(reach_set.sagitta_m[nodes].max()),
        )

    def from_now(self, situation: Situation, now_s: float) -> Paths:
        """What is left of it, in the grid frame of a situation and moved to start at its place."""
        left = np.flatnonzero(self.time_s > now_s + TIME_TOLERANCE_S)
        here = [np.interp(now_s, self.time_s, self.points_m[:, axis]) for axis in range(3)]
        _, world_from_grid = grid_frame(situation.state)
        return Paths(
            np.arange(-1, len(left) - 1, dtype=np.int32),
            np.ascontiguousarray((self.points_m[left] - here) @ world_from_grid)[:, None],
            np.full(len(left), self.sagitta_m),
            self.time_s[left] - now_s,
        )

    def endangered(self, planner: Planner, situation: Situation, now_s: float) -> str | None:
        """By what it lacks the margin from now on; None if it keeps it."""
        paths = self.from_now(situation, now_s)
        if not len(paths.parent):
            return None
        paths = sloping(paths, margin_slope(planner.settings, situation))
        margin = margin_m(planner.settings, situation)
        hazards = in_reach(planner, situation, margin).hazards
        found = path_clearance(paths, len(paths.parent) - 1, hazards)
        # The vehicle is on the path, not on its chords.
        if found.distance_m >= margin - 2.0 * self.sagitta_m - ROUNDING_M:
            return None
        return f"the plan comes within {found.distance_m:.2f} m of {NEWS[found.cause]}"
