"""Volumes about an aircraft as rules define them, and when being on the way into one is an alert.

A volume is an upright cylinder; with a modified tau it begins sooner for those that close in fast
(DO-365). What is asked of a flight is an ordered list of them, the outermost first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum

from clearway.base.checks import above_zero_problem, collect_problems, number_problem
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.traffic.volumes.interval import find_shared_interval


class AlertLevel(IntEnum):
    """How urgent it is; the higher, the worse."""

    NONE = 0
    PREVENTIVE = 1
    """Do not manoeuvre into it."""
    CORRECTIVE = 2
    """A manoeuvre is needed, with time to arrange it."""
    WARNING = 3
    """Manoeuvre now."""
    RECOVERY = 4
    """No manoeuvre stays outside any more: leave with as much as can be kept."""


@dataclass(frozen=True, slots=True)
class AirVolume:
    """A volume that two aircraft should not share. Raises InputError for impossible numbers."""

    name: str
    radius_m: float
    half_height_m: float
    tau_s: float = 0.0
    """Modified tau at which it begins for those that converge; 0 for a plain cylinder."""
    buffer_m: float = 0.0
    """Kept beside the radius by who decides; what came of it is judged without."""
    buffer_height_m: float = 0.0
    """Kept beside the half height, likewise."""
    growth_mps: float = 0.0
    """Of the radius with the time that is looked ahead, likewise."""

    def __post_init__(self) -> None:
        names = ("tau_s", "buffer_m", "buffer_height_m", "growth_mps")
        problems = collect_problems(
            (
                above_zero_problem("radius_m", self.radius_m),
                above_zero_problem("half_height_m", self.half_height_m),
                *(number_problem(name, getattr(self, name)) for name in names),
            )
        )
        if not self.name:
            problems.append("name: must not be empty")
        if problems:
            raise InputError(f"volume {self.name or '?'}", problems)

    @property
    def kept(self) -> AirVolume:
        """The volume with its buffers, as who decides keeps it."""
        return replace(
            self,
            radius_m=self.radius_m + self.buffer_m,
            half_height_m=self.half_height_m + self.buffer_height_m,
            buffer_m=0.0,
            buffer_height_m=0.0,
        )

    def find_shared(
        self, apart_m: FloatArray, change_mps: FloatArray, within_s: float = math.inf
    ) -> tuple[float, float]:
        """(in, out) in seconds from now, (inf, -inf) if never within `within_s`; buffers count not.

        apart_m, change_mps: [3] one aircraft relative to the other, which both fly straight on.
        """
        x, y, z = (float(value) for value in apart_m)
        vx, vy, vz = (float(value) for value in change_mps)
        begins, ends = find_shared_interval(
            x, y, z, vx, vy, vz, self.radius_m, self.half_height_m, self.tau_s, self.growth_mps,
            within_s,
        )  # fmt: skip
        return float(begins), float(ends)

    def holds(self, apart_m: FloatArray) -> bool:
        """Whether the two are nearer than the plain cylinder; tau and buffers count not."""
        level = math.hypot(float(apart_m[0]), float(apart_m[1]))
        return level < self.radius_m and abs(float(apart_m[2])) < self.half_height_m


@dataclass(frozen=True, slots=True)
class AlertRule:
    """To share a volume within a time is an alert of a level."""

    level: AlertLevel
    volume: AirVolume
    within_s: float


@dataclass(frozen=True, slots=True)
class VolumeSet:
    """What is kept: volumes, the outermost first, and when to alert. Raises InputError where a
    volume does not lie inside the one before."""

    name: str
    about: str
    volumes: tuple[AirVolume, ...]
    """The outermost first; what is kept clear of in order, the innermost above all."""
    rules: tuple[AlertRule, ...]
    window_s: float = 3.0
    """An alert is taken back when too little has asked for it for so long."""
    needed: int = 1
    """Looks within that time that must ask for it; with 1 it is given at once."""

    def __post_init__(self) -> None:
        problems = []
        if not self.volumes:
            problems.append("volumes: at least one is needed")
        for outer, inner in zip(self.volumes, self.volumes[1:], strict=False):
            if inner.radius_m > outer.radius_m or inner.half_height_m > outer.half_height_m:
                problems.append(
                    f"volumes: {inner.name} must lie inside {outer.name}; the outermost comes first"
                )
        if not 0.0 <= self.window_s < math.inf:
            problems.append(f"window_s: must be a number >= 0, got {self.window_s}")
        if self.needed < 1:
            problems.append(f"needed: must be at least 1, got {self.needed}")
        for rule in self.rules:
            if not 0.0 < rule.within_s < math.inf:
                problems.append(f"alert {rule.level.name.lower()}: within_s must be above 0")
        if problems:
            raise InputError(f"volumes {self.name}", problems)

    @property
    def look_ahead_s(self) -> float:
        """Longest time that any alert looks ahead."""
        return max((rule.within_s for rule in self.rules), default=0.0)

    @property
    def outermost(self) -> AirVolume:
        return self.volumes[0]

    @property
    def innermost(self) -> AirVolume:
        return self.volumes[-1]

    @classmethod
    def of(
        cls, name: str, volumes: tuple[AirVolume, ...], about: str = "volumes of your own"
    ) -> VolumeSet:
        """With alerts at the usual times: the outermost volume within 55 s is corrective, within
        25 s a warning, and half as much again of it, within 55 s, preventive."""
        outermost = volumes[0] if volumes else None
        rules: tuple[AlertRule, ...] = ()
        if outermost is not None:
            wider = replace(
                outermost,
                name=f"{outermost.name}, half as much again",
                radius_m=1.5 * outermost.radius_m,
                half_height_m=1.5 * outermost.half_height_m,
            )
            rules = (
                AlertRule(AlertLevel.PREVENTIVE, wider, 55.0),
                AlertRule(AlertLevel.CORRECTIVE, outermost, 55.0),
                AlertRule(AlertLevel.WARNING, outermost, 25.0),
            )
        return cls(name, about, volumes, rules)
