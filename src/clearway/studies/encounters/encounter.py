"""Random encounters: an intruder on a true collision course with straight flight.

The ownship starts level at the origin of the world, flies along x, and hears of the intruder at a
decision instant. Lengths and speeds are multiples of `scale`; at scale 1 the ownship flies 1 m/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from clearway.base.checks import collect_problems, number_problem
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.state import freeze_array

SPEEDS = (0.5, 1.0)
"""Speed of intruders as a share of the ownship's."""
STEEPEST_SIGHT_RAD = math.radians(30.0)
"""Intruders appear at most this far above or below."""
SLOWEST_CLOSING = 0.2
"""Least closing speed as a share of the ownship's: slower conflicts are a minute away."""
FASTEST_CLOSING = 1.0 + SPEEDS[1]
"""Closing speed head on."""
VALID = {
    "detected_at_m": (0.1, 1e3),
    "scale": (1e-3, 1e4),
    "position_noise_m": (0.0, 1e3),
    "velocity_noise_mps": (0.0, 1e3),
    "late_s": (0.0, 1e3),
    "miss_m": (0.0, 1e3),
}
"""From and to, at scale 1: half an hour of flight before the encounter is the most."""


@dataclass(frozen=True, slots=True)
class EncounterSettings:
    """One kind of encounter."""

    detected_at_m: float = 10.0
    """Distance at which the ownship first hears of the intruder, at scale 1."""
    deviates: bool = False
    """Whether the intruder flies anywhere inside its stated spread, with reports each second."""
    spread_rad: tuple[float, float] = (math.pi / 16, math.pi / 24)
    """Horizontal and vertical; stated where the intruder deviates, else it flies straight."""
    position_noise_m: float = 0.0
    """Standard deviation of reported positions at scale 1; with noise a tracker is used."""
    velocity_noise_mps: float = 0.0
    late_s: float = 0.0
    """Straight flight goes on for so long after the detection, before the first decision."""
    miss_m: float = 0.0
    """Largest distance at which straight flight is passed, at scale 1; 0 collides exactly."""
    scale: float = 1.0

    def __post_init__(self) -> None:
        problems = collect_problems(
            number_problem(name, getattr(self, name), low, high)
            for name, (low, high) in VALID.items()
        )
        if not self.miss_m < self.nearest_m:
            problems.append(
                f"miss_m, late_s: the first decision may come {self.nearest_m:g} m from the "
                f"intruder, and straight flight misses it by up to {self.miss_m:g} m"
            )
        for spread in self.spread_rad:
            if not 0.0 <= spread < math.pi / 2:
                problems.append(f"spread: must be within [0, 90) degrees, got {spread} rad")
        if problems:
            raise InputError("encounters", problems)

    @property
    def nearest_m(self) -> float:
        """Least distance at the first decision, at scale 1."""
        return self.detected_at_m - self.late_s * FASTEST_CLOSING

    @property
    def noisy(self) -> bool:
        return self.position_noise_m > 0.0 or self.velocity_noise_mps > 0.0

    @property
    def in_words(self) -> str:
        """One line for tables."""
        parts = [f"detected at {self.detected_at_m:g} m"]
        if self.late_s:
            parts.append(f"{self.late_s:g} s late")
        if self.deviates:
            horizontal, vertical = (math.degrees(spread) for spread in self.spread_rad)
            parts.append(f"deviating by up to {horizontal:g} x {vertical:g} deg")
        if self.noisy:
            parts.append(
                f"noise {self.position_noise_m:g} m, {self.velocity_noise_mps:g} m/s, tracked"
            )
        if self.miss_m:
            parts.append(f"missing by up to {self.miss_m:g} m")
        if self.scale != 1.0:
            parts.append(f"{self.scale:g} times the scale")
        return ", ".join(parts)


@dataclass(frozen=True, slots=True, eq=False)
class Encounter:
    """One intruder met, world frame; the ownship is at the origin and flies along x."""

    seed: int
    position_m: FloatArray
    """[3] of the intruder at the first decision."""
    velocity_mps: FloatArray
    """[3]"""
    own_speed_mps: float

    def __post_init__(self) -> None:
        for name in ("position_m", "velocity_mps"):
            object.__setattr__(self, name, freeze_array(getattr(self, name), (3,)))

    @property
    def closing_mps(self) -> FloatArray:
        """[3] velocity of the intruder relative to straight flight."""
        closing: FloatArray = self.velocity_mps - np.array([self.own_speed_mps, 0.0, 0.0])
        return closing

    @property
    def collision_s(self) -> float:
        """Time of the closest approach of straight flight."""
        closing = self.closing_mps
        return max(0.0, float(-self.position_m @ closing) / max(float(closing @ closing), 1e-12))

    @property
    def straight_miss_m(self) -> float:
        """How near straight flight comes."""
        return float(np.linalg.norm(self.position_m + self.collision_s * self.closing_mps))

    @property
    def bearing_rad(self) -> float:
        """Azimuth at which the intruder appears, left positive."""
        return math.atan2(self.position_m[1], self.position_m[0])


def random_encounter(seed: int, settings: EncounterSettings | None = None) -> Encounter:
    """The encounter of a seed: any speed of SPEEDS, any bearing that admits a collision course.

    For an intruder slower than the ownship two headings lead to a collision from one bearing: it
    comes head on, or it is caught up with; either is taken.
    """
    settings = settings or EncounterSettings()
    rng = np.random.default_rng([seed, 41])
    while True:
        ratio = float(rng.uniform(*SPEEDS))
        azimuth = float(rng.uniform(-0.5, 0.5) * math.pi)
        elevation = float(rng.uniform(-1.0, 1.0) * STEEPEST_SIGHT_RAD)
        approaching = bool(rng.random() < 0.5)
        sight = np.array(
            [
                math.cos(elevation) * math.cos(azimuth),
                math.cos(elevation) * math.sin(azimuth),
                math.sin(elevation),
            ]
        )
        closing = closing_speed(float(sight[0]), ratio, approaching)
        if closing is not None and closing >= SLOWEST_CLOSING:
            break
    velocity = np.array([1.0, 0.0, 0.0]) - closing * sight
    position = (settings.detected_at_m - settings.late_s * closing) * sight
    if settings.miss_m > 0.0:
        position = _turn_off(position, settings.miss_m, rng)
    return Encounter(
        seed, settings.scale * position, settings.scale * velocity, settings.scale * 1.0
    )


def closing_speed(ahead: float, ratio: float, approaching: bool) -> float | None:
    """Speed along the line of sight at which |velocity| is `ratio`; None where no heading collides.

    ahead: cosine of the angle between the line of sight and the course. All speeds are shares of
    the ownship's.
    """
    root2 = ahead * ahead - 1.0 + ratio * ratio
    if root2 < 0.0:
        return None
    return ahead + math.sqrt(root2) if approaching else ahead - math.sqrt(root2)


def _turn_off(position: FloatArray, miss_m: float, rng: np.random.Generator) -> FloatArray:
    """The place at the same distance from which straight flight is missed by up to `miss_m`."""
    distance = float(np.linalg.norm(position))
    sight = position / distance
    across = np.cross(sight, rng.normal(size=3))
    across /= np.linalg.norm(across)
    off = math.asin(miss_m * math.sqrt(rng.random()) / distance)
    turned: FloatArray = distance * (math.cos(off) * sight + math.sin(off) * across)
    return turned


STANDARD_KINDS = tuple(
    replace(kind, scale=scale)
    for scale in (1.0, 15.0)
    for kind in (
        EncounterSettings(),
        EncounterSettings(deviates=True),
        EncounterSettings(position_noise_m=0.3, velocity_noise_mps=0.1),
        EncounterSettings(detected_at_m=6.0),
        EncounterSettings(detected_at_m=6.0, late_s=1.5),
        EncounterSettings(detected_at_m=4.0),
    )
)
"""What the project is held to; from 6 m on all can be avoided, so later ones are flown besides."""
