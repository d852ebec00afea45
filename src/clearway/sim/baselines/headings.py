"""From a wished direction of flight to the movement that turns into it."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray
from clearway.sim.baselines.routes import Routes

LOOK_AHEAD = 0.4
"""How far along the cheapest way the carrot hangs, in ranges of the grid."""


def carrot(ways: Routes) -> FloatArray:
    """[3] unit vector to a point on the cheapest way if nothing stood there, level frame.

    Aiming at it rather than at the waypoint turns the same arcs as clearway would, so that no
    baseline circles a waypoint for want of guidance.
    """
    reach_set = ways.prepared.reach_set
    samples = reach_set.samples_m[reach_set.path(int(ways.nodes[0]))].reshape(-1, 3)
    distance = np.linalg.norm(samples, axis=1)
    reached = np.flatnonzero(distance >= LOOK_AHEAD * reach_set.grid.range_m)
    point = samples[reached[0]] if len(reached) else samples[-1]
    return _level(point / np.linalg.norm(point), reach_set.start_pitch_rad)


def movement_towards(ways: Routes, direction: FloatArray) -> str:
    """The movement after which the nose is nearest to a direction [3] of the level frame."""
    reach_set = ways.prepared.reach_set
    first = np.flatnonzero(reach_set.parent < 0)
    pitch, yaw = reach_set.states[first, 4], reach_set.states[first, 5]
    nose = np.stack(
        [np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)], axis=1
    )
    best = int(np.argmax(np.round(nose @ direction, 9)))
    return reach_set.movement_names[int(reach_set.movement[first[best]])]


def _level(vector: FloatArray, pitch_rad: float) -> FloatArray:
    """A vector of the grid frame in the level frame."""
    cos, sin = np.cos(pitch_rad), np.sin(pitch_rad)
    x, y, z = vector
    return np.array([cos * x + sin * z, y, -sin * x + cos * z])
