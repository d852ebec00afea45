"""RotorPy's quadrotor, led by RotorPy's own controller, as a plant of an outside simulator.

Needs `pip install --no-deps rotorpy==3.0.0` and SciPy. Name it in a mission,
`[vehicle] kind = "multirotor"`, `plant = "rotorpy_plant.py:RotorPy"`, or run this file.
"""

import numpy as np

import clearway as cw
from clearway.sim.plants.led import LedGains, LedWay, lead_sum
from clearway.vehicle.copter import CopterLimits

RATE_HZ = 100
LEAD_S = (0.15, 0.05)
"""By how much an acceleration is asked for before its time: level, which takes a tilt, and up."""
DRAG_PER_S = 0.5
"""Deceleration by drag per speed of the Hummingbird, leant into before it is felt."""
GAINS = LedGains(sum_per_s3=6.0)
"""Of the position's integral, which RotorPy's controller lacks: wind is leant into."""


class RotorPy:
    """RotorPy's Hummingbird with aerodynamics, held by its SE3 controller."""

    copter = CopterLimits(5.0, 3.0, lag_s=max(LEAD_S))
    lag_s = max(LEAD_S)

    def __init__(self, state, speed_mps, air):
        from rotorpy.controllers.quadrotor_control import SE3Control
        from rotorpy.vehicles.hummingbird_params import quad_params
        from rotorpy.vehicles.multirotor import Multirotor

        yaw = float(state[5])
        hover_rps = float(np.sqrt(quad_params["mass"] * 9.81 / (4.0 * quad_params["k_eta"])))
        self._now = {
            "x": np.array(state[:3], dtype=float),
            "v": speed_mps * np.array([np.cos(yaw), np.sin(yaw), 0.0]),
            "q": np.array([0.0, 0.0, np.sin(0.5 * yaw), np.cos(0.5 * yaw)]),
            "w": np.zeros(3),
            "wind": np.array(air.wind_mps, dtype=float),
            "rotor_speeds": np.full(4, hover_rps),
        }
        self._vehicle = Multirotor(quad_params, initial_state=self._now)
        self._sum_mps2 = np.zeros(3)
        self._control, self._air, self._yaw, self.outputs = SE3Control(quad_params), air, yaw, {}

    def begin(self, movement):
        raise NotImplementedError("it follows references alone")

    def follow(self, asked):
        self._way = LedWay(asked, LEAD_S)

    def step(self, duration_s):
        now = self._now
        flow_mps = float(np.linalg.norm(now["v"] - now["wind"]))
        now["wind"] = self._air.step(duration_s, flow_mps, float(now["x"][2]), self._yaw)
        before, after = self._way.step(duration_s)
        steps = max(1, round(duration_s * RATE_HZ))
        for step in range(steps):
            row = np.asarray(before + (step + 0.5) / steps * (after - before))
            self._sum_mps2 = lead_sum(now["x"], row, self._sum_mps2, duration_s / steps, GAINS)
            asked = {
                "x": row[:3],
                "x_dot": row[3:6],
                "x_ddot": row[6:9] + self._sum_mps2 + DRAG_PER_S * row[3:6] * [1.0, 1.0, 0.0],
                "x_dddot": np.zeros(3),
                "x_ddddot": np.zeros(3),
                "yaw": row[9],
                "yaw_dot": row[10],
            }
            control = self._control.update(0.0, now, asked)
            now = self._vehicle.step(now, control, duration_s / steps)
        self._now = now

    @property
    def state(self):
        x, y, z, w = self._now["q"]
        yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        self._yaw += (yaw - self._yaw + np.pi) % (2.0 * np.pi) - np.pi
        pitch = np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0))
        roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        return np.array([*self._now["x"], roll, pitch, self._yaw])


if __name__ == "__main__":
    mission = cw.read_mission("balls-30")
    print(cw.fly(mission.with_values("vehicle", kind="multirotor", plant=f"{__file__}:RotorPy")))
