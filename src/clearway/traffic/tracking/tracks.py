"""Reports of intruders, tracks made of them, and the filter between: straight flight with noise.

A track's state is position and velocity in the world frame; between reports it is predicted as
straight flight disturbed by random accelerations, so what is not reported grows uncertain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import freeze_array
from clearway.traffic.intruder import Intruder

SUREST = 1e-3
"""Metres, and metres a second: no report is taken to be more exact, or a filter has no noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """One report of one intruder, world frame; screening finds out whether it makes sense."""

    time_s: float
    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray | None = None
    """[3] None where the report has none."""
    address: str = ""
    """Transponder address; empty where the sensor does not know."""
    position_std_m: float = 0.3
    velocity_std_mps: float = 0.1
    radius_m: float = 0.0
    spread_rad: FloatArray = field(default_factory=lambda: np.zeros(2))

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_m", freeze_array(self.position_m, (3,)))
        object.__setattr__(self, "spread_rad", freeze_array(self.spread_rad, (2,)))
        if self.velocity_mps is not None:
            object.__setattr__(self, "velocity_mps", freeze_array(self.velocity_mps, (3,)))

    @classmethod
    def of(cls, intruder: Intruder) -> Report:
        """What an intruder told of itself, as a report; its name stands in for an address."""
        return cls(
            intruder.time_s,
            intruder.position_m,
            intruder.velocity_mps,
            intruder.address or intruder.name,
            max(SUREST, intruder.position_std_m),
            max(SUREST, intruder.velocity_std_mps),
            intruder.radius_m,
            intruder.spread_rad,
        )

    @property
    def measured(self) -> FloatArray:
        """[3] position, or [6] position and velocity."""
        if self.velocity_mps is None:
            return self.position_m
        return np.concatenate([self.position_m, self.velocity_mps])

    @property
    def noise(self) -> FloatArray:
        """Covariance of `measured`, [3, 3] or [6, 6]."""
        stds = np.full(len(self.measured), self.position_std_m)
        stds[3:] = self.velocity_std_mps
        return np.diag(stds**2)


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """What is believed of one intruder at a time: of its last report, or predicted; world frame."""

    identity: int
    """Counts up from 1 and is never used twice."""
    time_s: float
    mean: FloatArray
    """[6] position and velocity."""
    covariance: FloatArray
    """[6, 6]"""
    reports: int = 1
    address: str = ""
    radius_m: float = 0.0
    spread_rad: FloatArray = field(default_factory=lambda: np.zeros(2))
    namesake: int = 1
    """Counts the aircraft that report by the same address."""

    def at(self, time_s: float, acceleration_std_mps2: float) -> Track:
        """The track predicted to a time; to an earlier one it grows uncertain just the same."""
        elapsed = time_s - self.time_s
        if elapsed == 0.0:
            return self
        eye = np.eye(3)
        move = np.block([[eye, elapsed * eye], [np.zeros((3, 3)), eye]])
        push = np.vstack([0.5 * elapsed**2 * eye, elapsed * eye])
        noise = acceleration_std_mps2**2 * push @ push.T
        return replace(
            self,
            time_s=time_s,
            mean=move @ self.mean,
            covariance=move @ self.covariance @ move.T + noise,
        )

    def surprise(self, report: Report) -> float:
        """Squared Mahalanobis distance of a report at the track's time."""
        residual, spread = self._innovation(report)
        return float(residual @ np.linalg.solve(spread, residual))

    def update(self, report: Report) -> Track:
        """The track after a report at its time (Kalman, in Joseph's symmetric form)."""
        residual, spread = self._innovation(report)
        size = len(residual)
        gain = np.linalg.solve(spread, self.covariance[:size]).T
        keep = np.eye(6)
        keep[:, :size] -= gain
        return replace(
            self,
            mean=self.mean + gain @ residual,
            covariance=keep @ self.covariance @ keep.T + gain @ report.noise @ gain.T,
            reports=self.reports + 1,
            address=report.address or self.address,
            radius_m=report.radius_m or self.radius_m,
            spread_rad=report.spread_rad if np.any(report.spread_rad) else self.spread_rad,
        )

    def _innovation(self, report: Report) -> tuple[FloatArray, FloatArray]:
        size = len(report.measured)
        residual: FloatArray = report.measured - self.mean[:size]
        return residual, self.covariance[:size, :size] + report.noise

    @property
    def position_std_m(self) -> float:
        """Along its least certain axis."""
        return math.sqrt(float(np.linalg.eigvalsh(self.covariance[:3, :3])[-1]))

    @property
    def velocity_std_mps(self) -> float:
        return math.sqrt(float(np.linalg.eigvalsh(self.covariance[3:, 3:])[-1]))

    @property
    def _name(self) -> str:
        if not self.address:
            return f"track {self.identity}"
        return self.address if self.namesake == 1 else f"{self.address} ({self.namesake})"

    def intruder(self) -> Intruder:
        """The track as an intruder at its time, world frame."""
        return Intruder(
            self.mean[:3],
            self.mean[3:],
            spread_rad=self.spread_rad,
            radius_m=self.radius_m,
            name=self._name,
            time_s=self.time_s,
            position_std_m=self.position_std_m,
            velocity_std_mps=self.velocity_std_mps,
            address=self.address,
        )


def begin_heard_track(identity: int, report: Report, unknown_velocity_std_mps: float) -> Track:
    """The track that a first report makes."""
    mean = np.zeros(6)
    mean[: len(report.measured)] = report.measured
    stds = np.full(6, report.position_std_m)
    known = report.velocity_mps is not None
    stds[3:] = report.velocity_std_mps if known else unknown_velocity_std_mps
    return Track(
        identity=identity,
        time_s=report.time_s,
        mean=mean,
        covariance=np.diag(stds**2),
        address=report.address,
        radius_m=report.radius_m,
        spread_rad=report.spread_rad,
    )
