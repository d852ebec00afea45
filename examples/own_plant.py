"""A vehicle of one's own in under 40 lines: what truly moves, and the movements it is flown with.

Name it in a mission, `[vehicle] plant = "own_plant.py:Blimp"`, or run this file.
"""

import numpy as np

import clearway as cw


class Blimp:
    """A blimp that gains speed and turns slowly, and that every wind carries off."""

    movements = staticmethod(
        lambda speed_mps=3.0, duration_s=2.0: cw.MovementAutomaton.inertialess(
            speed_mps, 15.0, duration_s=duration_s, climb_mps=0.5, diagonals=False
        )
    )

    def __init__(self, state, speed_mps, air):
        self.outputs = {}
        self.state, self.air, self.now = np.array(state, dtype=float), air, np.zeros(3)
        self.now[0] = speed_mps

    def begin(self, movement):
        self.asked = np.array([movement.speed_mps, movement.yaw_rate_rps, movement.climb_mps or 0])

    def step(self, duration_s):
        self.now += (self.asked - self.now) * (1.0 - np.exp(-duration_s / 0.4))
        speed, rate, climb = self.now
        air = self.air.step(duration_s, speed, self.state[2], self.state[5])
        yaw = self.state[5] = self.state[5] + rate * duration_s
        way = np.array([speed * np.cos(yaw), speed * np.sin(yaw), climb])
        self.state = np.concatenate([self.state[:3] + (way + air) * duration_s, self.state[3:]])


if __name__ == "__main__":
    mission = cw.read_mission("balls-30")
    blimp = {"plant": f"{__file__}:Blimp", "speed_mps": 3.0, "movement_s": 2.0}
    mission = mission.with_values("vehicle", **blimp).with_values("grid", range_m=40.0)
    print(cw.fly(mission.with_values("safety", margin_m=1.5)))
