"""Pilots: who wishes what, by a seed. All wish level velocities, and see the truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple, Protocol

import numpy as np

from benchmarks.filters.protocol import TICK_S, Own
from benchmarks.filters.worlds import SPEED_MPS, Course
from clearway.base.frames import FloatArray

SLOWS_PER_S = 1.0
"""Towards the goal a pilot is no faster than this for each metre that is left."""
PROBE_M = 1e-3


class Pilot(Protocol):
    """One flight's pilot: it may remember."""

    def wish(self, own: Own, /) -> FloatArray:
        """Return the velocity [3] that is wished now; asked once a tick."""
        ...


class StraightPilot:
    """Flies straight to the goal, whatever stands there."""

    def __init__(self, course: Course, _rng: np.random.Generator) -> None:
        self._goal_m = course.goal_m

    def wish(self, own: Own) -> FloatArray:
        """Return the velocity towards the goal."""
        return towards(self._goal_m, own.position_m, SPEED_MPS)


class RandomPilot:
    """Flies in random directions at random speeds, each for a while."""

    LASTS_S = (1.0, 4.0)

    def __init__(self, _course: Course, rng: np.random.Generator) -> None:
        self._rng, self._until_s = rng, 0.0
        self._wish = np.zeros(3)

    def wish(self, own: Own) -> FloatArray:
        """Return what was drawn last."""
        if own.time_s >= self._until_s:
            self._until_s = own.time_s + float(self._rng.uniform(*self.LASTS_S))
            angle, speed = self._rng.uniform(-np.pi, np.pi), self._rng.uniform(0.4, 1.0) * SPEED_MPS
            self._wish = speed * np.array([np.cos(angle), np.sin(angle), 0.0])
        return self._wish


class AdversarialPilot:
    """Flies at whatever is nearest, at full speed."""

    def __init__(self, course: Course, _rng: np.random.Generator) -> None:
        self._course = course

    def wish(self, own: Own) -> FloatArray:
        """Return the level velocity down the slope of the distance to the nearest surface."""
        world, here = self._course.world, own.position_m
        probes = here + PROBE_M * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
        near = world.distance_m(np.ascontiguousarray(probes))
        slope = np.array([near[0] - near[1], near[2] - near[3], 0.0])
        size = float(np.linalg.norm(slope))
        if not np.isfinite(size) or size < 1e-9:
            return towards(self._course.goal_m, here, SPEED_MPS)
        down: FloatArray = slope * (-SPEED_MPS / size)
        return down


class Habits(NamedTuple):
    """Of pilots that know a way."""

    speed_mps: float
    ahead_m: float
    """They look so far along the way: corners are cut."""
    late_s: float
    """They see where they were so long ago."""
    smooth_s: float
    """Time constant with which the stick follows."""
    foresees_s: float = 0.0
    """They fly by where they will be so much later."""
    slows: bool = False
    """Whether they slow down where the way turns."""
    wanders_mps: float = 0.0
    """Standard deviation of a velocity across, which comes and goes."""
    wanders_s: float = 1.5


HUMAN = Habits(speed_mps=4.5, ahead_m=2.5, late_s=0.2, smooth_s=0.3, foresees_s=0.7, slows=True)
CARELESS = Habits(speed_mps=5.0, ahead_m=6.0, late_s=0.4, smooth_s=0.4, wanders_mps=0.5)
"""Crashes in about seven of ten unfiltered flights among obstacles, on the tuning seeds."""


class WayPilot:
    """Follows a known way to the goal, late and smoothly; a careless one wanders."""

    def __init__(self, habits: Habits, course: Course, rng: np.random.Generator) -> None:
        self._habits, self._rng = habits, rng
        self._goal_m = course.goal_m
        self._way_m = _points_along(course.way_m)
        self._seen: list[FloatArray] = []
        self._stick, self._across = np.zeros(3), 0.0
        self._at = 0

    def wish(self, own: Own) -> FloatArray:
        """Return the stick as it has come to be."""
        habits = self._habits
        self._seen.append(own.position_m)
        late = round(habits.late_s / TICK_S)
        place = self._seen[max(0, len(self._seen) - 1 - late)]
        place = place + habits.foresees_s * own.velocity_mps
        wanted = self._towards_way(place)
        share = 1.0 - np.exp(-TICK_S / habits.smooth_s)
        self._stick = self._stick + share * (wanted - self._stick)
        speed = float(np.linalg.norm(self._stick))
        if not habits.wanders_mps or speed < 1e-6:
            return self._stick
        keeps = np.exp(-TICK_S / habits.wanders_s)
        drawn = float(self._rng.normal()) * habits.wanders_mps * np.sqrt(1.0 - keeps**2)
        self._across = keeps * self._across + drawn
        aside = np.array([-self._stick[1], self._stick[0], 0.0]) / speed
        wish = self._stick + self._across * aside
        return np.asarray(wish * min(1.0, SPEED_MPS / max(float(np.linalg.norm(wish)), 1e-9)))

    def _towards_way(self, place_m: FloatArray) -> FloatArray:
        """The velocity towards a point ahead on the way, from where the way is nearest."""
        # Never back, and no farther on than a look ahead: ways may pass by themselves.
        on = self._way_m[self._at : self._at + round(2.0 * self._habits.ahead_m / STEP_M)]
        self._at += int(((on - place_m) ** 2).sum(axis=1).argmin())
        ahead = min(self._at + round(self._habits.ahead_m / STEP_M), len(self._way_m) - 1)
        if ahead == len(self._way_m) - 1:
            return towards(self._goal_m, place_m, self._habits.speed_mps)
        off = self._way_m[ahead] - place_m
        off /= max(float(np.linalg.norm(off)), 1e-9)
        speed = self._habits.speed_mps
        if self._habits.slows:
            begins, turns = self._way_m[self._at], self._way_m[ahead:][: round(AFTER_M / STEP_M)]
            after = turns[-1] - begins
            straight = float(off @ after) / max(float(np.linalg.norm(after)), 1e-9)
            speed *= max(SLOWEST, max(straight, 0.0) ** SLOWING)
        return np.asarray(speed * off)


STEP_M = 0.25
"""Between points of a way."""
AFTER_M = 4.0
"""Beyond the point that a pilot flies to, who slows down where the way turns within it."""
SLOWEST, SLOWING = 0.35, 6
"""Least share of its speed, and the power of the cosine of the turn by which it slows."""


def _points_along(corners_m: FloatArray) -> FloatArray:
    lengths = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(corners_m, axis=0), axis=1)))
    at = np.append(np.arange(0.0, lengths[-1], STEP_M), lengths[-1])
    return np.column_stack([np.interp(at, lengths, column) for column in corners_m.T])


def towards(goal_m: FloatArray, place_m: FloatArray, speed_mps: float) -> FloatArray:
    """Return the level velocity towards a goal, slower near to it."""
    off = (goal_m - place_m) * [1.0, 1.0, 0.0]
    far = float(np.linalg.norm(off))
    return np.asarray(off * (min(speed_mps, SLOWS_PER_S * far) / max(far, 1e-9)))


def _human(course: Course, rng: np.random.Generator) -> Pilot:
    return WayPilot(HUMAN, course, rng)


def _careless(course: Course, rng: np.random.Generator) -> Pilot:
    return WayPilot(CARELESS, course, rng)


MakePilot = Callable[[Course, np.random.Generator], Pilot]
PILOTS: Mapping[str, MakePilot] = MappingProxyType(
    {
        "straight": StraightPilot,
        "random": RandomPilot,
        "adversarial": AdversarialPilot,
        "human": _human,
        "careless": _careless,
    }
)
HEADS_FOR_GOAL = ("straight", "human", "careless")
"""Pilots whose missions count."""
