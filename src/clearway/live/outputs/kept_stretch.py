"""The clearance of the body over what is flown until the next decision, predicted and measured.

A decision predicts it from what it knows; the next one measures it from what later scans have
shown. Unobserved space counts as free in both: how often that is wrong, and by how much, is what
flights of the study have shown (`kept_clearance`).
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.hazards import CAUSES, Cause, Hazards
from clearway.avoidance.clear.verify import Paths, nearest_within
from clearway.avoidance.decision import Decision
from clearway.base.frames import FloatArray

MARGINS_TOLD = 5.0
"""Clearances are told up to so many safety margins: what is farther changes no decision."""
STAYS_M = 0.01
"""A vehicle that flies less until the next decision stays where it is."""
TOLERANCE_S = 1e-6
"""Within which two times are one."""


class Predicted(NamedTuple):
    """Clearance of the stretch that is flown until the next decision, as a decision knows it."""

    clearance_m: float
    """Between the body and what is nearest, up to `most_m`."""
    gap_m: float
    """Radius of the ball that the nearest return stands for: half the beam spacing, and noise; 0
    where no return limits."""
    stretch_m: float
    """Length of the stretch."""
    most_m: float
    """Clearances are told up to here."""


def predict_clearance(decision: Decision) -> Predicted:
    """Return what a decision knows of the clearance until the next decision is due.

    The stretch is the chosen trajectory up to the end of the movement in which
    `Decision.decide_within_s` ends. Its distance is taken to returns themselves, to map shapes and
    to intruders as reported, from the centre, less the body's radius.
    """
    body_m, most_m = _body_and_limit_m(decision)
    nodes, hazards, paths = _stretch(decision), decision.hazards, decision.prepared.paths
    exact = paths._replace(sagitta_m=_zeros(len(paths.parent)))
    distance_m, cause, index = _nearest(exact, nodes[-1], hazards, body_m + most_m)
    gap_m = float(hazards.points.radius_m[index]) if cause is Cause.POINT else 0.0
    return Predicted(min(distance_m - body_m, most_m), gap_m, _length_m(decision, nodes), most_m)


def measure_clearance(before: Decision, now: Decision) -> float | None:
    """Return the clearance that a decision kept up to the next one, by what that one knows.

    None where the next one takes effect before the first did, and where the vehicle stayed where it
    was: that shows nothing new. What moves is taken to have come straight to where it now is.
    """
    nodes = _stretch(before)
    lasted_s = now.state.time_s - before.state.time_s
    if lasted_s <= TOLERANCE_S or _length_m(before, nodes) < STAYS_M:
        return None
    body_m, most_m = _body_and_limit_m(before)
    flown, there = _fly_back(before, nodes, now, lasted_s), now.hazards
    if len(there.moving.radius_m):
        there = _backwards(there)
    distance_m, _, _ = _nearest(flown, len(flown.parent) - 1, there, body_m + most_m)
    return min(distance_m - body_m, most_m)


def moves(decision: Decision) -> bool:
    """Return whether a decision leads away until the next one is due."""
    return _length_m(decision, _stretch(decision)) >= STAYS_M


def _body_and_limit_m(decision: Decision) -> tuple[float, float]:
    """Radius of the body, and up to which clearance is told."""
    settings = decision.found_again.planner.settings
    return settings.body_radius_m, MARGINS_TOLD * settings.safety_margin_m


def _stretch(decision: Decision) -> list[int]:
    """Nodes of the chosen trajectory up to the one in which the next decision is due."""
    reach_set = decision.prepared.reach_set
    path = reach_set.path(decision.choice.node)
    due_s = decision.decide_within_s - TOLERANCE_S
    for k, node in enumerate(path):
        if reach_set.end_time_s[node] >= due_s:
            return path[: k + 1]
    return path


def _length_m(decision: Decision, nodes: list[int]) -> float:
    return float(decision.prepared.reach_set.length_m[nodes].sum())


def _fly_back(before: Decision, nodes: list[int], now: Decision, lasted_s: float) -> Paths:
    """What was flown of a decision's stretch up to the next one, in the grid frame of that one and
    backwards, as the origin is where it ends.

    The planned way, bent evenly so that it ends where the own state is now.
    """
    reach_set = before.prepared.reach_set
    samples_m = reach_set.samples_m[nodes]
    ends_s, samples = [0.0, *reach_set.end_time_s[nodes].tolist()], samples_m.shape[1]
    share = np.arange(len(nodes) * samples + 1) / samples
    times_s = np.interp(share, range(len(ends_s)), ends_s)
    in_grid_m = np.zeros((len(times_s), 3))
    in_grid_m[1:] = samples_m.reshape(-1, 3)
    planned_m = before.frame.world_points(in_grid_m)
    lasted_s = min(lasted_s, float(times_s[-1]))
    last = int(np.searchsorted(times_s, lasted_s - TOLERANCE_S))
    part = (lasted_s - times_s[last - 1]) / (times_s[last] - times_s[last - 1])
    end_m = planned_m[last - 1] + part * (planned_m[last] - planned_m[last - 1])
    way_m, at_s = planned_m[:last][::-1], times_s[:last][::-1]
    bent_m = (now.state.position_m - end_m) * (at_s / lasted_s)[:, None]
    return Paths(
        np.arange(-1, last - 1, dtype=np.int32),
        np.ascontiguousarray(now.frame.grid_points(way_m + bent_m))[:, None],
        np.zeros(last),
        lasted_s - at_s,
    )


def _backwards(hazards: Hazards) -> Hazards:
    """The same with all that moves on its way back to where it came from, and sure of it."""
    moving = hazards.moving
    none = np.zeros(len(moving.radius_m))
    back = moving._replace(velocity_mps=-moving.velocity_mps, growth_mps=none, manoeuvre_mps2=none)
    there = Hazards(hazards.points, hazards.shapes, back)
    there.__dict__["bins"] = hazards.bins
    return there


def _nearest(
    paths: Paths, node: int, hazards: Hazards, within_m: float
) -> tuple[float, Cause, int]:
    """What comes nearest to the path to a node, within a distance: returns as points."""
    points = hazards.bins._replace(radius_m=_zeros(len(hazards.bins.radius_m)), largest_m=0.0)
    distance_m, cause, index = nearest_within(paths, node, points, hazards, within_m)
    return distance_m, CAUSES[cause], index


def _zeros(number: int) -> FloatArray:
    """[number], of which most of a decision's time went into the making."""
    return _make_zeros(number.bit_length())[:number]


@cache
def _make_zeros(bits: int) -> FloatArray:
    return np.zeros(1 << bits)
