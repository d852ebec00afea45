"""The quadrotor of `quadrotor` with the loops of `cascade`, as a plant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from clearway.base.frames import FloatArray
from clearway.sim.plants.air import Air
from clearway.sim.plants.cascade import Gains, Led, fly_held, fly_led
from clearway.sim.plants.led import Asked, LedGains, LedWay
from clearway.sim.plants.quadrotor import ROTOR_SIDES, Airframe, rotate_by_quaternion
from clearway.vehicle.automaton import Movement

STEPS_PER_S = 500
LED = LedGains((14.0, 20.0), (6.5, 9.0), sum_per_s3=8.0, most_sum_mps2=6.0, drag_per_s=0.5)
LEAD_S = (0.1, 0.0)
"""By how much an acceleration is asked for before its time: what attitude lags."""
LED_TILT_RAD = 1.05
"""Of a vehicle that follows a reference: it flies faster, and leans into more drag."""


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations of what is reported to the loops, drawn anew 20 times a second."""

    velocity_mps: float = 0.02
    attitude_rad: float = 0.002
    rates_rps: float = 0.01


@dataclass
class QuadrotorPlant:
    """A quadrotor with six degrees of freedom, motor lag and drag, held by a cascade of loops."""

    start: FloatArray
    speed_mps: float
    air: Air
    frame: Airframe = field(default_factory=Airframe)
    gains: Gains = field(default_factory=Gains)
    noise: SensorNoise = field(default_factory=SensorNoise)

    def __post_init__(self) -> None:
        yaw = float(self.start[5])
        ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        half = 0.5 * yaw
        turned = [np.cos(half), 0.0, 0.0, np.sin(half)]
        self._x = np.concatenate(
            [self.start[:3], self.speed_mps * ahead, turned, np.zeros(3)]
        ).astype(np.float64)
        self._rotors = np.full(4, self.frame.hover_rps)
        self._led = Led(float(self.speed_mps), 0.0, yaw, np.zeros(3))
        self._held = (float(self.speed_mps), 0.0, 0.0)
        self._rng = np.random.default_rng([self.air.seed, 78])
        self._deviations = np.repeat(
            [self.noise.velocity_mps, self.noise.attitude_rad, self.noise.rates_rps], 3
        )
        self._yaw = yaw
        self._way: LedWay | None = None
        self._sum_mps2 = np.zeros(3)
        self._settle()

    def _settle(self) -> None:
        """Trimmed: flown on until tilt and integrals are those of steady flight, then put back."""
        place, air = self._x[:3].copy(), self.air.wind_mps
        for _ in range(80):
            self._move(0.05, air, np.zeros(9))
        self._x[:3] = place

    def begin(self, movement: Movement) -> None:
        self._held = (movement.speed_mps, movement.climb_mps or 0.0, movement.yaw_rate_rps)

    @property
    def lag_s(self) -> float:
        return max(LEAD_S)

    def follow(self, asked: Asked) -> None:
        self._way = LedWay(asked, LEAD_S)

    def step(self, duration_s: float) -> None:
        x = self._x
        flow = float(np.linalg.norm(x[3:6] - self.air.wind_mps))
        air = self.air.step(duration_s, flow, float(x[2]), self._yaw)
        noise = self._deviations * self._rng.normal(size=9)
        if self._way is None:
            self._move(duration_s, air, noise)
        else:
            self._follow(self._way, duration_s, air, noise)

    def _follow(self, way: LedWay, duration_s: float, air: FloatArray, noise: FloatArray) -> None:
        steps = max(1, round(duration_s * STEPS_PER_S))
        self._x, self._rotors, self._sum_mps2 = fly_led(
            self._x,
            self._rotors,
            self._sum_mps2,
            way.step(duration_s),
            air,
            noise,
            ROTOR_SIDES,
            self.frame,
            self.gains._replace(most_tilt_rad=LED_TILT_RAD),
            LED,
            steps,
            duration_s / steps,
        )

    def _move(self, duration_s: float, air: FloatArray, noise: FloatArray) -> None:
        steps = max(1, round(duration_s * STEPS_PER_S))
        self._x, self._rotors, self._led = fly_held(
            self._x,
            self._rotors,
            self._led,
            self._held,
            air,
            noise,
            ROTOR_SIDES,
            self.frame,
            self.gains,
            steps,
            duration_s / steps,
        )

    @property
    def state(self) -> FloatArray:
        r = rotate_by_quaternion(self._x[6:10])
        yaw = float(np.arctan2(r[1, 0], r[0, 0]))
        self._yaw += (yaw - self._yaw + np.pi) % (2.0 * np.pi) - np.pi
        pitch = float(-np.arcsin(np.clip(r[2, 0], -1.0, 1.0)))
        roll = float(np.arctan2(r[2, 1], r[2, 2]))
        return np.concatenate([self._x[:3], [roll, pitch, self._yaw]])

    @property
    def outputs(self) -> Mapping[str, float]:
        """Velocity in the world and rotor speeds."""
        names = ("velocity_x_mps", "velocity_y_mps", "velocity_z_mps")
        told = dict(zip(names, self._x[3:6].tolist(), strict=True))
        return told | {f"rotor_{k}_rps": float(speed) for k, speed in enumerate(self._rotors)}
