"""Crossing ahead of intruders: what the future-movement rule (6.8) holds against a trajectory.

A path that crosses the vertical plane through an intruder's way where the intruder has yet to come
forces it to pass behind; (6.8) halves its chances, so that the vehicle passes behind instead. Here
each such crossing has a cost.
"""

from __future__ import annotations

import numpy as np

from clearway.avoidance.clear.hazards import MovingHazards
from clearway.base.arrays import Floats, Floats3, Int32s, Ints
from clearway.base.compiled import compiled
from clearway.base.state import IntArray
from clearway.reach.tree import ReachSet


def crossings_ahead(reach_set: ReachSet, moving: MovingHazards) -> IntArray:
    """[nodes] number of intruders that the path to each node crosses ahead of.

    Those count that come to the crossing within the time that the reach set looks ahead. moving: in
    the grid frame. One that hovers, or moves straight up or down, has no way to cross.
    """
    pitch = reach_set.start_pitch_rad
    up = np.array([-np.sin(pitch), 0.0, np.cos(pitch)])
    return _crossings(reach_set.parent, reach_set.samples_m, reach_set.end_time_s, moving, up)


@compiled
def _crossings(
    parent: Int32s,
    samples: Floats3,
    end_time_s: Floats,
    moving: MovingHazards,
    up: Floats,
) -> Ints:
    nodes, count = samples.shape[0], samples.shape[1]
    horizon_s = np.max(end_time_s)
    crossed = np.zeros(nodes, dtype=np.int64)
    ahead = np.zeros(nodes, dtype=np.bool_)
    for k in range(len(moving.radius_m)):
        p, u = moving.position_m[k], moving.velocity_mps[k]
        nx, ny = up[1] * u[2] - up[2] * u[1], up[2] * u[0] - up[0] * u[2]
        nz = up[0] * u[1] - up[1] * u[0]
        speed2 = u[0] ** 2 + u[1] ** 2 + u[2] ** 2
        aside0 = -(nx * p[0] + ny * p[1] + nz * p[2])
        for n in range(nodes):
            at, start_s, aside = parent[n], 0.0, aside0
            along = -(u[0] * p[0] + u[1] * p[1] + u[2] * p[2])
            ahead[n] = False
            if at >= 0:
                start_s, ahead[n] = end_time_s[at], ahead[at]
                aside, along = _project_on_way(samples[at, count - 1], start_s, p, u, nx, ny, nz)
            for q in range(count):
                if ahead[n]:
                    break
                time_s = start_s + (end_time_s[n] - start_s) * (q + 1) / count
                aside1, along1 = _project_on_way(samples[n, q], time_s, p, u, nx, ny, nz)
                if aside * aside1 < 0.0:
                    share = aside / (aside - aside1)
                    # Square of the speed, times the time by which the intruder comes later.
                    lead = along + share * (along1 - along)
                    ahead[n] = 0.0 < lead <= (horizon_s - time_s) * speed2
                aside, along = aside1, along1
            crossed[n] += ahead[n]
    return crossed


@compiled
def _project_on_way(
    place: Floats,
    time_s: float,
    p: Floats,
    u: Floats,
    nx: float,
    ny: float,
    nz: float,
) -> tuple[float, float]:
    """How far a place is to the side of an intruder's way, and ahead of it, times its speed."""
    x = place[0] - p[0] - u[0] * time_s
    y = place[1] - p[1] - u[1] * time_s
    z = place[2] - p[2] - u[2] * time_s
    return nx * x + ny * y + nz * z, u[0] * x + u[1] * y + u[2] * z
