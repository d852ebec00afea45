"""A robot that obeys Twist alone, with lag, flies what one with PositionTarget flies."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.base.frames import wrap_angle
from clearway.vehicle.automaton import MovementAutomaton
from ros2_for_tests import BEGAN_S, RosBench, cloud, odometry

LAG_S, TICK_S, GOAL_M = 0.25, 0.1, np.array([30.0, 0.0, 0.0])
AUTOMATA = {
    "inertialess": MovementAutomaton.inertialess(speed_mps=2.0),
    "multirotor": MovementAutomaton.multirotor(speed_mps=2.0),
}


def turned(yaw: float) -> np.ndarray:
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


class TwistRobot:
    """Velocity and yaw rate follow what the last Twist says, in its own body."""

    def __init__(self, kind: str, yaw_rad: float) -> None:
        velocity = {"topic": "cmd_vel", "type": "Twist"}
        self.bench = RosBench(AUTOMATA[kind], set_points={"velocity": velocity})
        self.place, self.yaw, self.velocity, self.rate = np.zeros(3), yaw_rad, np.zeros(3), 0.0
        self.now_s = 0.0

    def step(self) -> None:
        own = odometry(BEGAN_S + self.now_s, self.place, self.yaw, 0.0)
        told = turned(self.yaw).T @ self.velocity
        linear = own.twist.twist.linear
        linear.x, linear.y, linear.z = told.tolist()
        self.bench.bus.tell("/odom", own)
        self.bench.bus.tell("/points", cloud(BEGAN_S + self.now_s, ((5.0, 9.0, 0.0),)))
        self.bench.tick(self.now_s)
        sent = self.bench.sent("/cmd_vel")
        for _ in range(5):
            self._move(sent[-1] if sent else None, TICK_S / 5)
        self.now_s += TICK_S

    def _move(self, twist: object, step_s: float) -> None:
        asked, rate = np.zeros(3), 0.0
        if twist is not None:
            linear = twist.linear  # type: ignore[attr-defined]
            asked = turned(self.yaw) @ np.array([linear.x, linear.y, linear.z])
            rate = twist.angular.z  # type: ignore[attr-defined]
        share = 1.0 - math.exp(-step_s / LAG_S)
        self.velocity = self.velocity + share * (asked - self.velocity)
        self.rate += share * (rate - self.rate)
        self.place = self.place + step_s * self.velocity
        self.yaw = float(wrap_angle(np.asarray(self.yaw + step_s * self.rate)))


@pytest.mark.parametrize("kind", ["inertialess", "multirotor"])
@pytest.mark.parametrize("yaw_deg", [0.0, 140.0])
def test_it_arrives_whichever_way_it_points(kind: str, yaw_deg: float) -> None:
    robot = TwistRobot(kind, math.radians(yaw_deg))
    while robot.now_s < 60.0 and str(robot.bench.session.state) != "arrived":
        robot.step()
    assert str(robot.bench.session.state) == "arrived"
    assert robot.now_s < 35.0
    assert np.linalg.norm(robot.place - GOAL_M) < 2.0
