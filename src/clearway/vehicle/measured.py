"""Movements measured one after the other: where each leads depends on the one flown before it.

A vehicle that banks before it turns, or brakes before it stands, ends a movement in a state that
the next one begins with. What was flown last is therefore part of its state, as its bank is; reach
sets and ways out ask for roll and pitch, and so it is kept there: as a roll of `LABEL_RAD` times
the movement's number, too small to matter for anything else. Roll and pitch themselves are the
vehicle's own business, and lead nowhere.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clearway.base.brief import one_line
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray

LABEL_RAD = 1e-5
"""Roll by which a movement that was flown last is told from the next one in order."""


@dataclass(frozen=True, eq=False)
class PairTable:
    """Per (previous movement, movement) the way from its start, at equal times until its end.

    paths: [steps, 4] x, y, z and yaw in axes that are level and look along the heading at the
    start. first: the movement that counts as flown before a flight begins. spread_m: standard
    deviation of each pair's end, spread_yaw_rad of its heading there. tube_m: per number of
    movements flown since the own state was known, within how far of the predicted place the vehicle
    was found nearly always. Raises ClearwayError for ways of the wrong shape or not finite, and
    where a movement has none after itself or after the first.
    """

    names: tuple[str, ...]
    paths: Mapping[tuple[str, str], FloatArray]
    first: str
    spread_m: Mapping[tuple[str, str], float]
    spread_yaw_rad: Mapping[tuple[str, str], float] = field(default_factory=dict)
    tube_m: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for (previous, name), path in self.paths.items():
            where = f"measured movements, {name} after {previous}"
            if previous not in self.names or name not in self.names:
                raise ClearwayError(f"{where}: unknown; there are {', '.join(self.names)}")
            if path.ndim != 2 or path.shape[1] != 4 or not len(path):
                raise ClearwayError(f"{where}: rows of four numbers are needed")
            if not np.all(np.isfinite(path)):
                raise ClearwayError(f"{where}: numbers must be finite")
        if self.first not in self.names:
            raise ClearwayError(f"measured movements: first is {self.first!r}, and no movement")
        if not all(0.0 <= radius < np.inf for radius in self.tube_m):
            raise ClearwayError("measured movements: radii of the tube must be numbers >= 0")

    def __repr__(self) -> str:
        pairs = f"{len(self.paths)} pairs of {len(self.names)} movements"
        return one_line("PairTable", (pairs, f"{len(self.tube_m)} radii of its tube"))

    @property
    def forbidden(self) -> frozenset[tuple[str, str]]:
        """Pairs that were not measured."""
        every = {(a, b) for a in self.names for b in self.names}
        return frozenset(every - set(self.paths))

    def label_of(self, previous: str) -> float:
        """The roll that says what was flown last."""
        return LABEL_RAD * (1 + self.names.index(previous))

    def previous(self, roll_rad: float) -> str:
        """What was flown last, by that roll."""
        number = round(roll_rad / LABEL_RAD) - 1
        return self.names[number] if 0 <= number < len(self.names) else self.first

    def path(self, previous: str, name: str) -> FloatArray:
        """[steps, 4]; of a pair that was not measured, the way after the first movement."""
        found = self.paths.get((previous, name))
        if found is None:
            found = self.paths.get((name, name), self.paths.get((self.first, name)))
        if found is None:
            raise ClearwayError(f"measured movements: {name} after {previous} was not measured")
        return found

    @cached_property
    def _with_start(self) -> dict[tuple[str, str], FloatArray]:
        return {
            (previous, name): np.concatenate([np.zeros((1, 4)), self.path(previous, name)])
            for previous in self.names
            for name in self.names
        }

    def along(self, previous: str, name: str, share: float) -> FloatArray:
        """[4] x, y, z, yaw after a share in [0, 1] of a movement; linear between known times."""
        rows = self._with_start[previous, name]
        at = float(np.clip(share, 0.0, 1.0)) * (len(rows) - 1)
        before = min(int(at), len(rows) - 2)
        step: FloatArray = rows[before] + (at - before) * (rows[before + 1] - rows[before])
        return step

    def predict(self, state: npt.ArrayLike, name: str, share: float = 1.0) -> FloatArray:
        """State [6] after a share in [0, 1] of the movement, flown after what the roll says."""
        start = np.asarray(state, dtype=np.float64)
        if share <= 0.0:
            return start.copy()
        x, y, z, turned = self.along(self.previous(start[3]), name, share).tolist()
        cosine, sine = np.cos(start[5]), np.sin(start[5])
        return np.array(
            [
                start[0] + cosine * x - sine * y,
                start[1] + sine * x + cosine * y,
                start[2] + z,
                self.label_of(name),
                0.0,
                start[5] + turned,
            ]
        )

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

    @property
    def turning_radius_m(self) -> float:
        """Smallest radius of the level turns that were flown on and on; inf without any."""
        radii = [np.inf]
        for name in self.names:
            if (name, name) in self.paths:
                end = self.path(name, name)[-1]
                level = abs(end[2]) <= 0.1 * float(np.linalg.norm(end[:3]))
                if level and abs(end[3]) > 1e-6 and np.hypot(*end[:2]) > 0.0:
                    radii.append(float(np.hypot(*end[:2]) / (2.0 * abs(np.sin(0.5 * end[3])))))
        return float(min(radii))


def with_exact_rounds(
    paths: Mapping[tuple[str, str], FloatArray],
    spread_m: Mapping[tuple[str, str], float],
    level: Collection[str],
) -> dict[tuple[str, str], FloatArray]:
    """The same ways, those of a movement repeated made exact where they nearly stand or circle.

    What stays within its spread stands, also after something else that stands; a level turn over
    and over is one circle. So they can be flown for ever: what the measurement missed by is in the
    spread. level: names of the movements that are asked to keep their height; no other is made to,
    however much its climb spreads.
    """

    def stays(pair: tuple[str, str]) -> bool:
        if pair not in paths:
            return False
        return float(np.abs(paths[pair][:, :3]).max()) <= 3.0 * spread_m.get(pair, 0.0)

    stand = {name for name in level if stays((name, name))}
    exact = dict(paths)
    for (previous, name), path in paths.items():
        end, near = path[-1], 3.0 * spread_m.get((previous, name), 0.0)
        shares = np.arange(1, len(path) + 1)[:, None] / len(path)
        # Off by a hair at the tip of the grid, it would lead out of it through its side.
        if previous in stand and name in stand and stays((previous, name)):
            turned = end[3] if abs(end[3]) > 0.02 else 0.0
            exact[previous, name] = shares * np.array([0.0, 0.0, 0.0, turned])
        elif previous != name or name not in level:
            continue
        elif abs(end[3]) > 0.02 and abs(end[2]) <= max(near, 0.02 * float(np.hypot(*end[:2]))):
            angle = shares[:, 0] * end[3]
            chord = float(np.hypot(end[0], end[1]))
            heading = float(np.arctan2(end[1], end[0])) - 0.5 * end[3]
            radius = chord / (2.0 * np.sin(0.5 * end[3]))
            x = radius * (np.sin(heading + angle) - np.sin(heading))
            y = radius * (np.cos(heading) - np.cos(heading + angle))
            exact[previous, name] = np.stack([x, y, np.zeros(len(path)), angle], axis=1)
    return exact
