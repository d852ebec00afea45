"""What a pilot or another planner wishes: a velocity, or a path."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.base.brief import brief
from clearway.base.checks import above_zero_problem, array_problem, collect_problems, vector_problem
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray

MOST_RPS = 100.0
"""Nobody turns faster."""
SAME = 1e-6
"""Share by which a speed may be off by rounding: links carry numbers of 32 bits."""


@dataclass(frozen=True, slots=True, eq=False)
class VelocityWish:
    """To fly with a velocity from now on. Raises InputError for what is not finite.

    A vehicle that cannot stop flies at its own speed: of its velocity the direction counts.
    """

    velocity_mps: FloatArray
    """[3] world frame."""
    yaw_rate_rps: float = 0.0
    """Of the nose, left positive, where it need not point where the vehicle flies."""

    __repr__ = brief

    def __post_init__(self) -> None:
        velocity = np.array(self.velocity_mps, dtype=np.float64)
        object.__setattr__(self, "velocity_mps", velocity)
        problems = collect_problems([vector_problem("velocity_mps", velocity, 3)])
        if not abs(self.yaw_rate_rps) <= MOST_RPS:
            problems.append(f"yaw_rate_rps: must be a number within {MOST_RPS:g}")
        if problems:
            raise InputError("wish", problems)

    @property
    def fastest_mps(self) -> float:
        """How fast it wants to fly."""
        return float(np.linalg.norm(self.velocity_mps))

    def velocity_from(self, _place_m: FloatArray, _hold_s: float) -> FloatArray:
        """[3] where it leads, world frame."""
        return self.velocity_mps

    def slow_to(self, fastest_mps: float) -> VelocityWish:
        """The same way, no faster; itself where it is not."""
        fast = self.fastest_mps
        if fast <= fastest_mps * (1.0 + SAME):
            return self
        return replace(self, velocity_mps=self.velocity_mps * (fastest_mps / fast))


@dataclass(frozen=True, slots=True, eq=False)
class PathWish:
    """To fly along places, from the one that is nearest to the vehicle; it ends at the last.

    Raises InputError for fewer than one place, what is not finite, and no speed.
    """

    places_m: FloatArray
    """[n, 3] world frame."""
    speed_mps: float

    __repr__ = brief

    def __post_init__(self) -> None:
        places = np.array(self.places_m, dtype=np.float64)
        object.__setattr__(self, "places_m", places)
        problems = collect_problems(
            [
                array_problem("places_m", places, (None, 3)),
                above_zero_problem("speed_mps", self.speed_mps),
            ]
        )
        if not problems and len(places) < 1:
            problems.append("places_m: at least one place is needed")
        if problems:
            raise InputError("wish", problems)

    @property
    def fastest_mps(self) -> float:
        """How fast it wants to fly."""
        return self.speed_mps

    def velocity_from(self, place_m: FloatArray, hold_s: float) -> FloatArray:
        """[3] where it leads from a place in a time, world frame."""
        end = self.ahead_of(place_m, self.speed_mps * hold_s)[-1]
        velocity: FloatArray = (end - place_m) / hold_s
        return velocity

    def slow_to(self, fastest_mps: float) -> PathWish:
        """The same way, no faster; itself where it is not."""
        if self.speed_mps <= fastest_mps * (1.0 + SAME):
            return self
        return replace(self, speed_mps=fastest_mps)

    def ahead_of(self, place_m: FloatArray, length_m: float) -> FloatArray:
        """[k, 3] from a place on to the path, and along it: corners, up to a length of way."""
        corners = self.places_m
        if len(corners) > 1:
            begins, ways = corners[:-1], np.diff(corners, axis=0)
            squared = np.maximum((ways**2).sum(axis=1), 1e-18)
            share = np.clip(((place_m - begins) * ways).sum(axis=1) / squared, 0.0, 1.0)
            nearest = begins + share[:, None] * ways
            at = int(np.argmin(((nearest - place_m) ** 2).sum(axis=1)))
            corners = np.concatenate([nearest[at : at + 1], corners[at + 1 :]])
        way = np.concatenate([place_m[None], corners])
        gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
        if gone[-1] <= length_m:
            return way
        last = int(np.searchsorted(gone, length_m))
        share_left = (length_m - gone[last - 1]) / (gone[last] - gone[last - 1])
        end = way[last - 1] + share_left * (way[last] - way[last - 1])
        return np.concatenate([way[:last], end[None]])


Wish = VelocityWish | PathWish
