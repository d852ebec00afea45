"""The air that a plant flies in: steady wind, and Dryden gusts by MIL-F-8785C.

Gusts are white noise through the forming filters of the specification's low-altitude model (3.7.3):
one for the gust along the flight, one each across and up. They are stepped exactly, for any step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray

FT = 0.3048
LEAST_HEIGHT_M = 10.0 * FT
MOST_HEIGHT_M = 1000.0 * FT
"""Between which the low-altitude model holds; beyond, its values at the end are taken."""
LEAST_AIRSPEED_MPS = 1.0
"""Gusts pass by what hovers as they do by what flies slowly: in still air they would stand."""
_ROOT3 = float(np.sqrt(3.0))


@dataclass(frozen=True)
class GustScales:
    """What MIL-F-8785C says of a height above ground."""

    along_m: float
    """Scale length of the gusts along and across, L_u = L_v."""
    up_m: float
    """Of those up and down, L_w."""
    up_share: float
    """Their standard deviation as a share of that along and across, sigma_w / sigma_u."""

    @classmethod
    def at(cls, height_m: float) -> GustScales:
        """L_w = h, L_u = h / (0.177 + 0.000823 h)^1.2, sigma_w / sigma_u = (...)^0.4; h in feet."""
        height_ft = float(np.clip(height_m, LEAST_HEIGHT_M, MOST_HEIGHT_M)) / FT
        shear = 0.177 + 0.000823 * height_ft
        return cls(height_ft / shear**1.2 * FT, height_ft * FT, shear**0.4)


class Air:
    """Air that moves: world frame, the way that it goes.

    wind_mps: [3] steady. gusts_mps: standard deviation of gusts along and across the flight; those
    up and down follow from the height. ground_m: height of the ground in the world, which gusts go
    by. The same seed gives the same gusts. Raises ClearwayError for what is no finite number.
    """

    def __init__(
        self,
        wind_mps: Sequence[float] = (0.0, 0.0, 0.0),
        gusts_mps: float = 0.0,
        seed: int = 0,
        ground_m: float = -50.0,
    ) -> None:
        self.wind_mps = np.array(wind_mps, dtype=np.float64)
        if self.wind_mps.shape != (3,) or not np.all(np.isfinite(self.wind_mps)):
            raise ClearwayError(f"wind_mps: must be three finite numbers, got {wind_mps}")
        if not 0.0 <= gusts_mps < np.inf:
            raise ClearwayError(f"gusts_mps: must be a number >= 0, got {gusts_mps}")
        self.gusts_mps = gusts_mps
        self.seed = seed
        self._ground_m = ground_m
        self._rng = np.random.default_rng([seed, 77])
        self._along = self._rng.normal()
        # Each pair of filter states begins as it will go on: variances 1/2 and 1/4, covariance 1/4.
        begin = np.array([[np.sqrt(0.5), 0.0], [np.sqrt(0.125), np.sqrt(0.125)]])
        self._across, self._up = begin @ self._rng.normal(size=2), begin @ self._rng.normal(size=2)

    def step(
        self, duration_s: float, airspeed_mps: float, height_m: float, heading_rad: float
    ) -> FloatArray:
        """[3] how the air moves a moment later, where the vehicle then is; world frame."""
        if self.gusts_mps == 0.0:
            return self.wind_mps
        speed = max(airspeed_mps, LEAST_AIRSPEED_MPS)
        scales = GustScales.at(height_m - self._ground_m)
        passed_m = speed * duration_s
        decay = float(np.exp(-passed_m / scales.along_m))
        self._along = decay * self._along + np.sqrt(1.0 - decay * decay) * self._rng.normal()
        self._across = _second_order(self._across, passed_m / scales.along_m, self._rng)
        self._up = _second_order(self._up, passed_m / scales.up_m, self._rng)
        sigma = self.gusts_mps
        along, across = sigma * self._along, sigma * _shape(self._across)
        cosine, sine = np.cos(heading_rad), np.sin(heading_rad)
        gust = np.array(
            [
                cosine * along - sine * across,
                sine * along + cosine * across,
                sigma * scales.up_share * _shape(self._up),
            ]
        )
        moving: FloatArray = self.wind_mps + gust
        return moving


def _second_order(state: FloatArray, lags: float, rng: np.random.Generator) -> FloatArray:
    """The two lags of H(s) = (1 + sqrt(3) T s) / (1 + T s)^2 a time of `lags` T later, exactly.

    x1' = -x1 + w, x2' = x1 - x2 in units of T; in the long run their covariance P is
    [[1/2, 1/4], [1/4, 1/4]], so a step from x by M = exp(-lags) [[1, 0], [lags, 1]] adds noise of
    covariance P - M P M^T.
    """
    decay = float(np.exp(-lags))
    a, b = decay, decay * lags
    moved = np.array([a * state[0], b * state[0] + a * state[1]])
    first = 0.5 * (1.0 - a * a)
    both = 0.25 - a * (0.5 * b + 0.25 * a)
    second = 0.25 - (0.5 * b * b + 0.5 * a * b + 0.25 * a * a)
    scale = np.sqrt(max(first, 0.0))
    low = both / scale if scale > 0.0 else 0.0
    n1, n2 = rng.normal(size=2)
    added = [scale * n1, low * n1 + np.sqrt(max(second - low * low, 0.0)) * n2]
    result: FloatArray = moved + np.array(added)
    return result


def _shape(state: FloatArray) -> float:
    """The filter's output: sqrt(3) of the first lag, 1 - sqrt(3) of the second; variance 1."""
    return float(_ROOT3 * state[0] + (1.0 - _ROOT3) * state[1])
