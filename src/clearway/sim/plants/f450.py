"""JSBSim's F450 quadrotor: its own loops hold rates, those of `cascade` ask for them.

Velocity, as in `cascade`, asks for an acceleration; that for thrust and for a tilt; its error, in
proportion, for the rates that the model's own controller holds, at most 0.75 rad/s each.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from clearway.base.frames import FloatArray
from clearway.sim.plants.air import Air
from clearway.sim.plants.cascade import (
    Gains,
    Led,
    compute_wanted_acceleration,
    lead_on,
    thrust_wanted,
)
from clearway.sim.plants.jsbsim_model import JsbsimModel
from clearway.sim.plants.led import Asked, LedGains, LedWay, lead_acceleration, lead_sum
from clearway.sim.plants.quadrotor import GRAVITY_MPS2
from clearway.vehicle.automaton import Movement

RATE_HZ = 120
FULL_RPS = 0.75
"""Rate that the model's controller takes a full command for."""
GAINS = Gains(velocity=3.0, velocity_sum=1.0, drag_per_s=0.1, most_mps2=2.0, most_tilt_rad=0.4)
LED = LedGains((2.0, 6.0), (2.5, 5.0), sum_per_s3=0.6, drag_per_s=0.1)
LEAD_S = (0.25, 0.05)
"""By how much an acceleration is asked for before its time: what tilt and rotors lag."""
TILT_PER_S = 9.0
SETTLE_S = 6.0


class F450Plant:
    """JSBSim's F450 quadrotor, whose own rate loops are led by loops of velocity and tilt."""

    def __init__(self, start: FloatArray, speed_mps: float, air: Air) -> None:
        start = np.asarray(start, dtype=np.float64)
        self._air = air
        self._model = JsbsimModel("F450", RATE_HZ)
        self._model.set_wind(air.wind_mps)
        self._model.start(start, speed_mps)
        fdm = self._model.fdm
        fdm["propulsion/set-running"] = -1
        fdm["fcs/ScasEngage"] = 1.0
        self._lift = 0.5
        self._led = Led(float(speed_mps), 0.0, float(start[5]), np.zeros(3))
        self._held = (float(speed_mps), 0.0, 0.0)
        self._late_s = 0.0
        self._way: LedWay | None = None
        self._sum_mps2 = np.zeros(3)
        for _ in range(round(SETTLE_S * RATE_HZ)):
            self._step(air.wind_mps)
        self._model.place_at(start)

    def begin(self, movement: Movement) -> None:
        self._held = (movement.speed_mps, movement.climb_mps or 0.0, movement.yaw_rate_rps)

    @property
    def lag_s(self) -> float:
        return max(LEAD_S)

    def follow(self, asked: Asked) -> None:
        self._way = LedWay(asked, LEAD_S)

    def step(self, duration_s: float) -> None:
        state = self._model.state
        flow = float(np.linalg.norm(self._model.velocity_mps - self._air.wind_mps))
        air = self._air.step(duration_s, flow, float(state[2]), float(state[5]))
        before = after = np.zeros(0)
        if self._way is not None:
            before, after = self._way.step(duration_s)
        self._late_s += duration_s
        while self._late_s > 0.5 / RATE_HZ:
            if self._way is None:
                self._step(air)
            else:
                share = min(max(1.0 - self._late_s / duration_s, 0.0), 1.0)
                self._follow(air, before + share * (after - before))
            self._late_s -= 1.0 / RATE_HZ

    def _step(self, air: FloatArray) -> None:
        dt = 1.0 / RATE_HZ
        self._model.set_wind(air)
        velocity = self._model.velocity_mps
        self._led, ahead = lead_on(self._led, velocity, *self._held, dt, GAINS)
        wanted = compute_wanted_acceleration(velocity, self._led, self._held[2], ahead, GAINS)
        self._lift += 0.02 * (self._led.climb_mps - velocity[2]) * dt
        self._lean(thrust_wanted(wanted, GAINS), self._led.yaw_rad, self._held[2])

    def _follow(self, air: FloatArray, asked: FloatArray) -> None:
        """asked: [11] a row of the reference."""
        dt = 1.0 / RATE_HZ
        self._model.set_wind(air)
        position, velocity = self._model.state[:3], self._model.velocity_mps
        wanted = lead_acceleration(position, velocity, asked, self._sum_mps2, LED)
        self._sum_mps2 = lead_sum(position, asked, self._sum_mps2, dt, LED)
        self._lift += 0.02 * (asked[5] - velocity[2]) * dt
        self._lean(thrust_wanted(wanted, GAINS), float(asked[9]), float(asked[10]))

    def _lean(self, thrust: FloatArray, heading_rad: float, rate_rps: float) -> None:
        """One step of the model, whose rates lead to a thrust [3] and to a heading."""
        model, fdm = self._model, self._model.fdm
        roll, pitch, yaw = model.attitude_rad.tolist()
        cosine, sine = np.cos(yaw), np.sin(yaw)
        forward = cosine * thrust[0] + sine * thrust[1]
        left = -sine * thrust[0] + cosine * thrust[1]
        pitch_off = np.arctan2(forward, thrust[2]) - pitch
        roll_off = -np.arctan2(left, np.hypot(forward, thrust[2])) - roll
        yaw_off = (heading_rad - yaw + np.pi) % (2.0 * np.pi) - np.pi
        # JSBSim: roll right, nose up and yaw right are positive.
        rates = (TILT_PER_S * roll_off, -TILT_PER_S * pitch_off, -(1.5 * yaw_off + rate_rps))
        names = ("aileron", "elevator", "rudder")
        for name, rate in zip(names, rates, strict=True):
            fdm[f"fcs/{name}-cmd-norm"] = float(np.clip(rate / FULL_RPS, -1.0, 1.0))
        # How much throttle carries the weight is learned: JSBSim's engines tell no thrust curve.
        level = np.cos(roll) * np.cos(pitch)
        throttle = self._lift * thrust[2] / GRAVITY_MPS2 / max(level, 0.5)
        fdm["fcs/throttle-cmd-norm"] = float(np.clip(throttle, 0.05, 0.95))
        fdm.run()

    @property
    def state(self) -> FloatArray:
        return self._model.state

    @property
    def outputs(self) -> Mapping[str, float]:
        """Velocity in the world, and throttle."""
        names = ("velocity_x_mps", "velocity_y_mps", "velocity_z_mps")
        told = dict(zip(names, self._model.velocity_mps.tolist(), strict=True))
        return told | {"throttle": float(self._model.fdm["fcs/throttle-cmd-norm"])}
