"""The rest of the plan being flown, checked against what has become known since it was decided."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.clear.hazards import Cause
from clearway.avoidance.clear.verify import KEPT, Paths, path_clearance, sloping
from clearway.avoidance.decision import Decision
from clearway.avoidance.plan.evidence import gather_in_reach
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.prepared import reach_of
from clearway.avoidance.plan.situation import Situation, margin_slope
from clearway.base.frames import FloatArray
from clearway.live.inputs.readings import TIME_TOLERANCE_S
from clearway.live.plan import Plan

NEWS = {Cause.POINT: "a return", Cause.MAP: "the map", Cause.INTRUDER: "an intruder"}


def find_danger(plan: Plan, planner: Planner, situation: Situation, now_s: float) -> str | None:
    """By what the plan lacks the margin from now on; None if it keeps it, and without a plan.

    A movement that is finished only before an escape ends before there is anything to be stated."""
    if plan.decision is None or plan.decision.under_way_s is not None:
        return None  # Nothing better was found than to finish the movement under way.
    keeps_place = planner.automaton.has_inertia
    paths = rest_of(plan.decision, plan.buffer.start_s, situation, now_s, keeps_place=keeps_place)
    if not len(paths.parent):
        return None
    sloped = sloping(paths, margin_slope(planner.settings, situation))
    reach_m = reach_of(sloped, planner.grid.range_m)
    near = gather_in_reach(planner, situation, reach_m, planner.horizon_s)
    margin = near.margin_m
    # Of what intruders may do, as much as the plan was decided to keep clear of.
    share = float(plan.decision.hazards.moving.share.min(initial=1.0))
    hazards = near.hazards.keeping_clear_of(share)
    found = path_clearance(sloped, len(paths.parent) - 1, hazards)
    # The vehicle is on the path, not on its chords.
    if found.distance_m >= KEPT * margin - 2.0 * float(paths.sagitta_m[0]):
        return None
    return f"the plan comes within {found.distance_m:.2f} m of {NEWS[found.cause]}"


def rest_of(
    decision: Decision,
    decided_s: float,
    situation: Situation,
    now_s: float,
    *,
    keeps_place: bool = False,
) -> Paths:
    """What is left of a decision's path, in the grid frame of a situation.

    keeps_place: where it was planned, as a vehicle with inertia follows its plan; else moved to the
    place of the situation.

    The path is the one that was verified: samples of the reach set, at equal times within each
    movement.
    """
    reach_set = decision.prepared.reach_set
    nodes = reach_set.path(decision.choice.node)
    times = decided_s + _sample_times(reach_set.end_time_s[nodes], reach_set.samples_m.shape[1])
    left = np.flatnonzero(times > now_s + TIME_TOLERANCE_S)
    here = situation.state.position_m
    if not keeps_place:
        here = np.array([np.interp(now_s, times, decision.path_m[:, axis]) for axis in range(3)])
    ahead = decision.path_m[left] - here
    return Paths(
        np.arange(-1, len(left) - 1, dtype=np.int32),
        np.ascontiguousarray(ahead @ situation.frame.world_from_grid)[:, None],
        np.full(len(left), float(reach_set.sagitta_m[nodes].max())),
        times[left] - now_s,
    )


def _sample_times(end_s: FloatArray, samples: int) -> FloatArray:
    """[1 + movements * samples] from 0 on, from the ends [movements] of the movements."""
    ends = np.concatenate([[0.0], end_s])
    share = np.arange(1, samples + 1) / samples
    times = (ends[:-1, None] + np.diff(ends)[:, None] * share).ravel()
    return np.concatenate([[0.0], times])
