"""Trajectories that are clear of what moves for as long as any is looked at.

Every trajectory of a vehicle with inertia counts as complete, brief ones too: what stands does not
come nearer after its end. What moves does. A turn on the spot of one movement would else be better
than any way out of the path of what comes in two.
"""

from __future__ import annotations

import numpy as np

from clearway.avoidance.choose.candidates import Candidates, among
from clearway.avoidance.clear.hazards import MovingHazards
from clearway.avoidance.clear.onward import clear_standing
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.vehicle.automaton import MovementAutomaton

TOLERANCE_S = 1e-9
"""By which times that are alike may differ."""
AHEAD = 2.5
"""Of the time that trajectories last, for which a place to stand at is looked at: who leaves it has
to turn first, by half a turn at most, and gains speed only then."""


def stands_for_s(prepared: PreparedReachSet) -> float:
    """For how long a place to stand at is to stay clear of what moves."""
    return AHEAD * float(prepared.reach_set.end_time_s.max())


def lasting_among(
    candidates: Candidates,
    automaton: MovementAutomaton,
    prepared: PreparedReachSet,
    moving: MovingHazards,
    margin_m: float,
) -> Candidates | None:
    """Return the candidates that end at rest where nothing that moves comes nearer than the margin
    for a while, and the others that last as long as the longest.

    Parameters
    ----------
    candidates
    automaton
    prepared
        The trajectories that the candidates are of.
    moving
        In the frame of the trajectories.
    margin_m

    Returns
    -------
    Candidates | None
        None for a vehicle without inertia, and where nothing moves.
    """
    classes = automaton.classes
    if classes is None or not automaton.has_inertia or not len(moving.radius_m):
        return None
    reach_set, nodes = prepared.reach_set, candidates.nodes
    lasts = reach_set.end_time_s[nodes] >= float(reach_set.end_time_s.max()) - TOLERANCE_S
    at = classes.classes_at(reach_set.states[nodes, 3])
    rests = np.flatnonzero((classes.speed_mps[at] == 0.0) & (classes.climb_mps[at] == 0.0))
    ends = nodes[rests]
    lasts[rests] = clear_standing(
        np.ascontiguousarray(reach_set.samples_m[ends, -1]),
        reach_set.end_time_s[ends],
        stands_for_s(prepared),
        prepared.paths.sagitta_m[ends],
        moving,
        margin_m,
    )
    return among(candidates, lasts)
