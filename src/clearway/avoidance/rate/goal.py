"""Where to go, and which trajectories get there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from clearway.avoidance.rate.route_field import PlacedRoute
from clearway.base.arrays import Bools, Floats, Floats3, Int32s
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray, measure_length
from clearway.base.state import BoolArray
from clearway.reach.tree import ReachSet

# Rounding along a path is far below one part in a million.
ROUNDED_UP = 1.0 + 1e-6
"""Factor on how far paths lead, so that rounding cannot matter."""


class Goal(NamedTuple):
    """Where to go, in the level frame: origin at the vehicle, x along its heading, z up."""

    target_m: Floats
    """[3] the waypoint."""
    next_m: Floats
    """[3] the one after it; the target again if there is none."""
    reach_radius_m: float
    final: bool
    """No waypoint follows."""

    def __repr__(self) -> str:
        return brief(self)


@dataclass(frozen=True, eq=False)
class Arrival:
    """Which paths pass the goal, by node; measured when first asked for."""

    reach_set: ReachSet
    goal: Goal
    reach_m: float
    """How far from the vehicle its paths lead; none comes to a goal that is farther."""
    route: PlacedRoute | None = None
    """The time to go round what is known, where that is kept."""
    planned: int = -1
    """The node to which the rest of the last plan leads; -1 where there is none."""

    __repr__ = brief

    @cached_property
    def reached(self) -> BoolArray:
        """[nodes] the path to the node's end comes within the reach radius of the target."""
        return self._nowhere if self.is_beyond else self._measured[0]

    @cached_property
    def first(self) -> BoolArray:
        """[nodes] it does so in this movement."""
        return self._nowhere if self.is_beyond else self._measured[1]

    @property
    def miss_m(self) -> FloatArray:
        """[nodes] closest approach to the target on the path so far."""
        return self._measured[2]

    @cached_property
    def is_beyond(self) -> bool:
        """Whether the goal is farther than any path leads."""
        within_m = self.reach_m + self.goal.reach_radius_m
        return measure_length(self.goal.target_m) > ROUNDED_UP * within_m

    @cached_property
    def _nowhere(self) -> BoolArray:
        return np.zeros(self.reach_set.nodes, dtype=np.bool_)

    @cached_property
    def _measured(self) -> tuple[BoolArray, BoolArray, FloatArray]:
        one, goal = self.reach_set, self.goal
        return _arrival(
            one.parent, one.samples_m, one.start_pitch_rad, goal.target_m, goal.reach_radius_m
        )


def arrival(
    reach_set: ReachSet, goal: Goal, reach_m: float = np.inf, route: PlacedRoute | None = None
) -> Arrival:
    """Return which paths come within the reach radius of the goal, checked along chords.

    Parameters
    ----------
    reach_set
        The paths.
    goal
        In the level frame.
    reach_m
        How far from the vehicle paths lead at most, where that is known.
    route
        The time to go round what is known; None where it is not kept.
    """
    return Arrival(reach_set, goal, reach_m, route)


@compiled
def _arrival(
    parent: Int32s,
    samples: Floats3,
    start_pitch: float,
    target: Floats,
    reach_radius: float,
) -> tuple[Bools, Bools, Floats]:
    nodes, count = samples.shape[0], samples.shape[1]
    reached = np.zeros(nodes, dtype=np.bool_)
    first = np.zeros(nodes, dtype=np.bool_)
    miss = np.empty(nodes)
    # The target in the grid frame: the level frame pitched by the start pitch.
    cos, sin = np.cos(start_pitch), np.sin(start_pitch)
    tx = cos * target[0] - sin * target[2]
    ty = target[1]
    tz = sin * target[0] + cos * target[2]
    for n in range(nodes):
        p = parent[n]
        ax, ay, az = 0.0, 0.0, 0.0
        nearest2 = tx * tx + ty * ty + tz * tz
        if p >= 0:
            ax, ay, az = (
                samples[p, count - 1, 0],
                samples[p, count - 1, 1],
                samples[p, count - 1, 2],
            )
            nearest2 = miss[p] * miss[p]
            reached[n] = reached[p]
        for q in range(count):
            bx, by, bz = samples[n, q, 0], samples[n, q, 1], samples[n, q, 2]
            ux, uy, uz = bx - ax, by - ay, bz - az
            length2 = ux * ux + uy * uy + uz * uz
            ahead = (tx - ax) * ux + (ty - ay) * uy + (tz - az) * uz
            share = 0.0
            if ahead >= length2 and length2 > 0.0:
                share = 1.0
            elif ahead > 0.0:
                share = ahead / length2
            dx, dy, dz = tx - ax - share * ux, ty - ay - share * uy, tz - az - share * uz
            nearest2 = min(nearest2, dx * dx + dy * dy + dz * dz)
            ax, ay, az = bx, by, bz
        miss[n] = np.sqrt(nearest2)
        if not reached[n] and miss[n] <= reach_radius:
            reached[n], first[n] = True, True
    return reached, first, miss
