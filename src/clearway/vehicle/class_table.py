"""Classes of motion: what a movement does depends on how the vehicle moves when it begins.

A vehicle that banks before it turns, or brakes before it stands, ends a movement in a state that
the next one begins with. That state is one of few *classes*: a speed and a rate of climb, or the
movement that was flown last. It is part of the vehicle's state, and is kept where reach sets and
escapes look for it: as a roll of `LABEL_RAD` times the number of the class, too small to matter for
anything else. Roll and pitch themselves are the autopilot's business, and lead nowhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clearway.base.brief import one_line
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray

LABEL_RAD = 1e-5
"""Roll by which a class is distinguished from the next one in order."""


@dataclass(frozen=True, eq=False)
class ClassTable:
    """Per (class, movement) the way from its start, at equal times, and the class at its end.

    Raises ClearwayError for arrays that do not fit each other or are not finite.
    """

    names: tuple[str, ...]
    """Of the movements."""
    classes: tuple[str, ...]
    paths: FloatArray
    """[classes, movements, steps, 4] x, y, z (m) and yaw (rad), in axes that are level and look
    along the heading at the start."""
    following: IntArray
    """[classes, movements] class at the end; -1 where the movement cannot be flown."""
    first: int
    """The class before a flight begins."""
    tube_m: tuple[float, ...] = ()
    """Per number of movements flown since the own state estimate was known: within how far of the
    predicted position the vehicle was found nearly always (def. 13)."""
    class_tube_m: FloatArray = field(default_factory=lambda: np.zeros(0))
    """[classes] the same while a class is flown, of a vehicle that follows its plan; or none."""
    speed_mps: FloatArray = field(default_factory=lambda: np.zeros(0))
    """[classes] speed ahead, where classes are speeds; else none."""
    climb_mps: FloatArray = field(default_factory=lambda: np.zeros(0))
    """[classes] rate of climb, where classes are speeds; else none."""

    def __post_init__(self) -> None:
        shape = (len(self.classes), len(self.names))
        if self.paths.shape[:2] != shape or self.paths.shape[2:] != (self.paths.shape[2], 4):
            raise ClearwayError(f"class table: paths must be {[*shape, 'steps', 4]}")
        if self.following.shape != shape or self.following.max() >= len(self.classes):
            raise ClearwayError(f"class table: following must be {list(shape)} classes")
        if not np.all(np.isfinite(self.paths)):
            raise ClearwayError("class table: paths must be finite")
        if not 0 <= self.first < len(self.classes):
            raise ClearwayError("class table: there is no first class")
        if not all(0.0 <= radius < np.inf for radius in self.tube_m):
            raise ClearwayError("class table: radii of the tube must be numbers >= 0")

    def __repr__(self) -> str:
        facts = (f"{len(self.names)} movements in {len(self.classes)} classes",)
        return one_line("ClassTable", facts)

    @classmethod
    def of_pairs(
        cls,
        names: tuple[str, ...],
        paths: Mapping[tuple[str, str], FloatArray],
        first: str,
        tube_m: tuple[float, ...] = (),
    ) -> ClassTable:
        """Of ways [steps, 4] by (movement flown last, movement): the former is the class.

        Raises ClearwayError for unknown names and ways of the wrong shape or not finite, and where
        a movement has none after itself or after the first.
        """
        for (previous, name), path in paths.items():
            where = f"measured movements, {name} after {previous}"
            if previous not in names or name not in names:
                raise ClearwayError(f"{where}: unknown; there are {', '.join(names)}")
            if path.ndim != 2 or path.shape[1] != 4 or not len(path):
                raise ClearwayError(f"{where}: rows of four numbers are needed")
            if not np.all(np.isfinite(path)):
                raise ClearwayError(f"{where}: numbers must be finite")
        if first not in names:
            raise ClearwayError(f"measured movements: first is {first!r}, and no movement")
        number = {name: n for n, name in enumerate(names)}
        measured = [[(previous, name) in paths for name in names] for previous in names]
        ways = [[_way(paths, first, previous, name) for name in names] for previous in names]
        if len({len(way) for row in ways for way in row}) > 1:
            raise ClearwayError("measured movements: all ways need equally many rows")
        following = np.where(measured, np.arange(len(names)), -1)
        return cls(names, names, np.array(ways), following, number[first], tube_m)

    @property
    def has_speeds(self) -> bool:
        """Whether classes are speeds and rates of climb: the vehicle has inertia."""
        return bool(len(self.speed_mps))

    @property
    def forbidden(self) -> frozenset[tuple[str, str]]:
        """Pairs (movement flown last, movement) that may not follow; where classes are those."""
        if self.classes != self.names:
            return frozenset()
        never = np.argwhere(self.following < 0).tolist()
        return frozenset((self.classes[at], self.names[m]) for at, m in never)

    def label_of(self, at: int) -> float:
        """The roll (rad) that says a class."""
        return LABEL_RAD * (1 + at)

    def class_at(self, roll_rad: float) -> int:
        """The class that a roll says; the first one where it says none."""
        number = round(roll_rad / LABEL_RAD) - 1
        return number if 0 <= number < len(self.classes) else self.first

    def class_near(self, speed_mps: float, climb_mps: float) -> int:
        """The class whose speed and rate of climb are nearest; of those as near the first."""
        off = np.hypot(self.speed_mps - speed_mps, self.climb_mps - climb_mps)
        return int(np.argmin(off))

    def motion_along(self, at: int, movement: int, share: float) -> tuple[float, float]:
        """Speed and rate of climb after a share in [0, 1] of a movement: both change evenly."""
        end = self.after(at, movement)
        speed, climb = (
            float(each[at] + share * (each[end] - each[at]))
            for each in (self.speed_mps, self.climb_mps)
        )
        return speed, climb

    def classes_at(self, roll_rad: FloatArray) -> IntArray:
        """[n] `class_at` of rolls [n]."""
        number = np.rint(roll_rad / LABEL_RAD).astype(np.int64) - 1
        known = (number >= 0) & (number < len(self.classes))
        return np.where(known, number, self.first)

    @cached_property
    def _with_start(self) -> FloatArray:
        """[classes, movements, steps + 1, 4]"""
        start = np.zeros((*self.paths.shape[:2], 1, 4))
        return np.concatenate([start, self.paths], axis=2)

    def along(self, at: int, movement: int, share: float) -> FloatArray:
        """[4] x, y, z, yaw after a share in [0, 1] of a movement; linear between known times."""
        rows = self._with_start[at, movement]
        place = float(np.clip(share, 0.0, 1.0)) * (len(rows) - 1)
        before = min(int(place), len(rows) - 2)
        step: FloatArray = rows[before] + (place - before) * (rows[before + 1] - rows[before])
        return step

    def predict(self, state: npt.ArrayLike, name: str, share: float = 1.0) -> FloatArray:
        """State [6] after a share in [0, 1] of a movement, begun in the class that the roll says.

        The roll of the result says the class at the movement's end.
        """
        start = np.asarray(state, dtype=np.float64)
        if share <= 0.0:
            return start.copy()
        at, movement = self.class_at(float(start[3])), self.names.index(name)
        x, y, z, turned = self.along(at, movement, share).tolist()
        cosine, sine = np.cos(start[5]), np.sin(start[5])
        return np.array(
            [
                start[0] + cosine * x - sine * y,
                start[1] + sine * x + cosine * y,
                start[2] + z,
                self.label_of(self.after(at, movement)),
                0.0,
                start[5] + turned,
            ]
        )

    def after(self, at: int, movement: int) -> int:
        """The class after a movement; of one that cannot be flown, that of what is flown last where
        classes are movements, else the same."""
        end = int(self.following[at, movement])
        if end >= 0:
            return end
        return movement if self.classes == self.names else at

    def tube_at(self, movements: npt.ArrayLike) -> FloatArray:
        """Radius (m) after so many movements; between and beyond those measured along a line."""
        if not self.tube_m:
            return np.zeros(np.shape(movements))
        known = np.array([0.0, *self.tube_m])
        wanted = np.asarray(movements, dtype=np.float64)
        last = len(known) - 1
        slope = known[-1] - known[-2]
        beyond = known[-1] + np.maximum(wanted - last, 0.0) * max(slope, 0.0)
        within = np.interp(wanted, np.arange(len(known)), known)
        radii: FloatArray = np.where(wanted <= last, within, beyond)
        return radii

    @cached_property
    def tube_of_movements_m(self) -> FloatArray:
        """[classes, movements] the greater tube of the classes at both ends."""
        tube = self.class_tube_m
        return np.maximum(tube[:, None], tube[np.maximum(self.following, 0)])

    def along_each(self, shares: FloatArray) -> FloatArray:
        """[classes, movements, n, 4] `along` of all movements after shares [n]."""
        rows = self._with_start
        place = np.clip(shares, 0.0, 1.0) * (rows.shape[2] - 1)
        before = np.minimum(place.astype(np.int64), rows.shape[2] - 2)
        between = (place - before)[:, None]
        first, last = rows[:, :, before], rows[:, :, before + 1]
        step: FloatArray = first + between * (last - first)
        return step

    @cached_property
    def stands(self) -> BoolArray:
        """[classes, movements] whether a movement stays where it is and can be flown for ever."""
        still = ~np.any(self.paths[..., :3], axis=(2, 3))
        own = np.arange(len(self.classes))[:, None]
        return np.asarray(still & (self.following == own), dtype=np.bool_)

    @cached_property
    def steady(self) -> IntArray:
        """[n, 2] (class, movement) of those that can be flown on and on."""
        own = np.arange(len(self.classes))[:, None]
        return np.argwhere(self.following == own)

    @cached_property
    def turning_radius_m(self) -> float:
        """Smallest radius of the level turns flown on and on at the greatest speed that has any;
        inf without any."""
        radii: list[tuple[float, float]] = []
        for at, movement in self.steady.tolist():
            end = self.paths[at, movement, -1]
            away = float(np.hypot(end[0], end[1]))
            level = abs(end[2]) <= 0.1 * float(np.linalg.norm(end[:3]))
            if level and abs(end[3]) > 1e-6 and away > 0.0:
                speed = float(self.speed_mps[at]) if self.has_speeds else 0.0
                radii.append((-speed, float(away / (2.0 * abs(np.sin(0.5 * end[3]))))))
        return min(radii)[1] if radii else float("inf")


def _way(
    paths: Mapping[tuple[str, str], FloatArray], first: str, previous: str, name: str
) -> FloatArray:
    """[steps, 4]; of a pair that was not measured, the way after itself or the first movement."""
    for pair in ((previous, name), (name, name), (first, name)):
        if pair in paths:
            return paths[pair]
    raise ClearwayError(f"measured movements: {name} after {previous} was not measured")
