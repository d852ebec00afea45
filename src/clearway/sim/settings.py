"""What the simulated truth is like."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass

import numpy as np

from clearway.base.brief import brief
from clearway.base.checks import fits_float, vector_problem
from clearway.base.errors import ClearwayError
from clearway.sim.faults import NO_FAULTS, Faults

LARGEST_STEP_S = 0.05
"""Truth is never coarser than this."""


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """What the simulated truth is like.

    >>> import clearway as cw
    >>> cw.SimulationSettings(seed=3, wind_mps=(0.0, 1.0, 0.0))
    SimulationSettings(seed=3, wind_mps=(0, 1, 0))
    """

    seed: int = 0
    step_s: float = LARGEST_STEP_S
    _: KW_ONLY
    scan_rate_hz: float | None = None
    """Scans a second of every sensor, between decisions too; None for one with each decision."""
    scan_latency_s: float = 0.0
    """Age of a scan when it reaches the system."""
    state_noise_mps: float = 0.0
    """Bound of w (3.20) on each axis of velocity."""
    input_noise: float = 0.0
    """Bound of v (3.20) as a share of the speed, and of the largest turn rate."""
    wind_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Steady wind that carries the vehicle, world frame."""
    gusts_mps: float = 0.0
    """Standard deviation of gusts along and across the flight, as of MIL-F-8785C."""
    position_sigma_m: float = 0.0
    """Standard deviation of the own position as measured, stated to the system."""
    attitude_sigma_rad: float = 0.0
    """Standard deviation of the own pitch and yaw as measured, stated to the system."""
    time_limit_s: float | None = None
    """None allows six times the straight flight and a minute."""
    adversary_m: float = 0.0
    """Thickness of balls that an adversary puts in the way, least, where no beam has been; 0 for no
    adversary."""
    faults: Faults = NO_FAULTS

    __repr__ = brief

    def __post_init__(self) -> None:
        if not (fits_float(self.step_s) and 0.0 < self.step_s <= LARGEST_STEP_S):
            raise ClearwayError(f"step_s: must be within (0, {LARGEST_STEP_S}], got {self.step_s}")
        most, rate_hz = 1.0 / self.step_s, self.scan_rate_hz
        if rate_hz is not None and not (fits_float(rate_hz) and 0.0 < rate_hz <= most):
            raise ClearwayError(
                f"scan_rate_hz: must be within (0, {most:g}], at most one a step_s, got {rate_hz}"
            )
        noises = (
            "state_noise_mps",
            "input_noise",
            "gusts_mps",
            "position_sigma_m",
            "attitude_sigma_rad",
        )
        for name in ("scan_latency_s", "adversary_m", *noises):
            value = getattr(self, name)
            if not (fits_float(value) and 0.0 <= value < np.inf):
                raise ClearwayError(f"{name}: must be a number >= 0, got {value}")
        if problem := vector_problem("wind_mps", self.wind_mps, 3):
            raise ClearwayError(problem)
