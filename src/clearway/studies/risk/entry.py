"""Where aircraft enter the encounter cylinder, those that come near the ownship drawn more often.

Evenly spread traffic enters through a patch of the cylinder's surface in proportion to the area
times the speed at which it is crossed. Few of those aircraft come near, and which ones depends on
their turns. So most are drawn backwards: a moment of the track, a place inside a small cylinder at
that moment, and the place of entry that leads there. The weight is the density of even traffic
over that of what was drawn, so that weighted sums are those of even traffic, for any shares.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from clearway.base.frames import FloatArray, wrap_angle
from clearway.studies.risk.cylinder import Cylinder


@dataclass(frozen=True, slots=True)
class Shells:
    """The encounter cylinder and small ones inside, with how many entries aim at each."""

    outer: Cylinder
    inner: tuple[Cylinder, ...]
    shares: tuple[float, ...]
    """[inner] of the entries that lead into each; the rest is drawn as even traffic is."""


@dataclass(frozen=True, eq=False)
class Entries:
    """All ways in which one track may enter."""

    shells: Shells
    velocity_mps: FloatArray
    """[3] relative to the ownship, on entry."""
    drift_m: FloatArray
    """[n, 3] relative to the ownship from entry on, at times evenly apart."""

    def draw(self, rng: np.random.Generator) -> tuple[FloatArray, float]:
        """Place [3] of an entry, and its weight in cubic metres a second.

        The weight is 0 for a place where this velocity leads out, not in: count it, or draw anew
        with another track.
        """
        chances = np.append(self.shares, 1.0 - sum(self.shares))
        chosen = int(rng.choice(len(chances), p=chances))
        if chosen == len(self._windows):
            point = self.shells.outer.entry(self.velocity_mps, rng)
        else:
            point = self._windows[chosen].draw(self.shells.outer, rng)
        return point, self.weight(point)

    def weight(self, point_m: FloatArray) -> float:
        """Of an entry at a place [3] of the surface."""
        outer = self.shells.outer
        on_end = abs(abs(point_m[2]) - outer.half_height_m) < 1e-6
        if on_end:
            crossed = abs(float(self.velocity_mps[2]))
            inside = np.hypot(point_m[0], point_m[1]) <= outer.radius_m
            crossed *= float(inside and self.velocity_mps[2] * point_m[2] < 0.0)
        else:
            # Per radian and metre of height.
            crossed = max(0.0, -float(self.velocity_mps[:2] @ point_m[:2]))
        if crossed == 0.0:
            return 0.0
        density = (1.0 - sum(self.shares)) * crossed / outer.flux(self.velocity_mps)
        for share, windows in zip(self.shares, self._windows, strict=True):
            density += share * windows.density(point_m, on_end=on_end)
        return crossed / density

    @cached_property
    def _windows(self) -> tuple[_Windows, ...]:
        return tuple(
            _windows_of(self.shells.outer, one, self.velocity_mps, self.drift_m)
            for one in self.shells.inner
        )

    @cached_property
    def shares(self) -> tuple[float, ...]:
        """Shares of the inner cylinders; 0 of those that this track cannot lead into."""
        return tuple(
            share if len(windows) else 0.0
            for share, windows in zip(self.shells.shares, self._windows, strict=True)
        )


@dataclass(frozen=True, eq=False)
class _Windows:
    """Parts of the surface from which one cylinder is reached, a window for each moment."""

    angle: FloatArray
    """[sides] middles, and half widths."""
    half_angle: FloatArray
    low_m: FloatArray
    """[sides] lowest and highest heights."""
    high_m: FloatArray
    centre_m: FloatArray
    """[discs, 2] middles of discs on the end that is entered."""
    radius_m: float
    """Of the discs."""
    end_m: float
    """Height of that end."""

    def __len__(self) -> int:
        return len(self.angle) + len(self.centre_m)

    def draw(self, outer: Cylinder, rng: np.random.Generator) -> FloatArray:
        """A place of any window."""
        at = int(rng.integers(len(self)))
        if at < len(self.angle):
            angle = self.angle[at] + self.half_angle[at] * rng.uniform(-1.0, 1.0)
            height = rng.uniform(self.low_m[at], self.high_m[at])
            return np.array(
                [outer.radius_m * np.cos(angle), outer.radius_m * np.sin(angle), height]
            )
        radius, angle = self.radius_m * np.sqrt(rng.random()), 2.0 * np.pi * rng.random()
        x, y = self.centre_m[at - len(self.angle)]
        return np.array([x + radius * np.cos(angle), y + radius * np.sin(angle), self.end_m])

    def density(self, point_m: FloatArray, *, on_end: bool) -> float:
        """Of `draw` at a place: per square metre on an end, else per radian and metre."""
        if not len(self):
            return 0.0
        if on_end:
            off = np.hypot(*(point_m[:2] - self.centre_m).T)
            hits = float(np.count_nonzero(off <= self.radius_m))
            return hits / (np.pi * self.radius_m**2) / len(self)
        turned = np.abs(wrap_angle(np.arctan2(point_m[1], point_m[0]) - self.angle))
        inside = (turned <= self.half_angle) & (self.low_m <= point_m[2])
        inside &= point_m[2] <= self.high_m
        area = 2.0 * self.half_angle[inside] * (self.high_m - self.low_m)[inside]
        return float((1.0 / area).sum()) / len(self)


def _windows_of(
    outer: Cylinder, aim: Cylinder, velocity: FloatArray, drift: FloatArray
) -> _Windows:
    """Where entries lead into a cylinder at some moment of a drift [n, 3]."""
    away = np.maximum(np.hypot(drift[:, 0], drift[:, 1]), 1e-9)
    cosine = (outer.radius_m**2 + away**2 - aim.radius_m**2) / (2.0 * outer.radius_m * away)
    low = np.maximum(-outer.half_height_m, -aim.half_height_m - drift[:, 2])
    high = np.minimum(outer.half_height_m, aim.half_height_m - drift[:, 2])
    side = (cosine < 1.0) & (high > low)
    end = -float(np.sign(velocity[2])) * outer.half_height_m
    disc = (np.abs(end + drift[:, 2]) <= aim.half_height_m) & (end != 0.0)
    return _Windows(
        angle=np.arctan2(-drift[side, 1], -drift[side, 0]),
        half_angle=np.arccos(np.maximum(cosine[side], -1.0)),
        low_m=low[side],
        high_m=high[side],
        centre_m=-drift[disc, :2],
        radius_m=aim.radius_m,
        end_m=end,
    )
