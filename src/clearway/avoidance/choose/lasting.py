"""Trajectories that are clear of what moves for as long as any is looked at.

Every trajectory of a vehicle with inertia counts as complete, brief ones too: what stands does not
come nearer after its end. What moves does. A turn on the spot of one movement would else be better
than any way out of the path of what comes in two.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.choose.candidates import Candidates, among
from clearway.avoidance.clear.hazards import MovingHazards
from clearway.avoidance.clear.loiter import LoiterCircles
from clearway.avoidance.clear.onward import clear_standing
from clearway.avoidance.plan.prepared import PreparedReachSet
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray

TOLERANCE_S = 1e-9
"""By which times that are alike may differ."""
AHEAD = 2.5
"""Of the time that trajectories of a vehicle with inertia last, for which a place to stand at is
looked at: to leave it, it has to turn first, by half a turn at most, and gains speed only then."""


def stands_for_s(prepared: PreparedReachSet) -> float:
    """For how long a place to stand at is to stay clear of what moves."""
    ahead = AHEAD if len(prepared.loiter.stops.at) else 1.0
    return ahead * float(prepared.reach_set.end_time_s.max())


class Lasting(NamedTuple):
    """Candidates that end well where something moves."""

    stops: Candidates
    """The vehicle may stop after them: nothing that moves comes near there for a while."""
    goes_on: Candidates
    """They last as long as the longest, and end in motion."""


def lasting_among(
    candidates: Candidates,
    prepared: PreparedReachSet,
    moving: MovingHazards,
    margin_m: float,
) -> Lasting | None:
    """Return the candidates that are clear of what moves for as long as any is looked at.

    Parameters
    ----------
    candidates
    prepared
        The trajectories that the candidates are of.
    moving
        In the frame of the trajectories.
    margin_m

    Returns
    -------
    Lasting | None
        None for a vehicle without inertia, and where nothing moves.
    """
    stops = prepared.loiter.stops
    if not len(stops.at) or not len(moving.radius_m):
        return None
    nodes, end_s = candidates.nodes, prepared.reach_set.end_time_s
    lasts = end_s[nodes] >= float(end_s.max()) - TOLERANCE_S
    rests = np.all(stops.ways_m[:, 0, -1] == 0.0, axis=1)[stops.at[nodes]]
    clear = clear_standing(
        _stopping_places_m(prepared.loiter, nodes),
        end_s[nodes],
        stands_for_s(prepared),
        prepared.paths.sagitta_m[nodes],
        moving,
        margin_m,
    )
    return Lasting(among(candidates, clear), among(candidates, lasts & ~rests))


def _stopping_places_m(loiter: LoiterCircles, nodes: IntArray) -> FloatArray:
    """[n, 3] where the vehicle stands once it has braked straight on from the ends of nodes [n]."""
    brakes_m = loiter.stops.ways_m[loiter.stops.at[nodes], 0, -1]
    left = loiter.left[nodes]
    axes = np.stack([np.cross(left, loiter.up), left, np.broadcast_to(loiter.up, left.shape)], 1)
    places: FloatArray = loiter.end_m[nodes] + np.einsum("na,nai->ni", brakes_m, axes)
    return places
