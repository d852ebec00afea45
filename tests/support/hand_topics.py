"""A robot on topics whose node is killed or stopped, in real time, and what it hears and does."""

from __future__ import annotations

import signal
import time
from pathlib import Path
from typing import Any

import numpy as np

from clearway.base.state import State
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.ros2.bus import SENSOR, STATIC_TF, USUAL
from clearway.ros2.dds import DdsBus
from clearway.ros2.messages import pack_message, unpack_cdr
from clearway.sensors import simulate_scan
from hand_flights import Cut
from ros2_for_tests import DOMAIN, cloud, odometry, transform
from ros2_processes import begun

WALL = """
[mission]
name = "wall"
waypoints_m = [[40, 0, 0]]

[vehicle]
kind = "multirotor"
speed_mps = 2.0
body_radius_m = 0.2

[safety]
margin_m = 0.6

[[lidar]]
name = "front"
beams_per_cell = [20, 10]
max_range_m = 10

[[obstacle]]
name = "wall"
shape = "cuboid"
position_m = [14, 0, 0]
size_m = [1, 40, 20]
"""
PARAMETERS = """
/**:
  ros__parameters:
    mission: {mission}
    act: true
    ground_m: -20.0
    clouds: {{front: {{topic: points}}}}
    set_points: {{target: {{topic: target, type: {kind}}}}}
"""
STEP_S, CLOUD_S = 0.02, 0.1
KINDS = {
    "PositionTarget": "mavros_msgs/msg/PositionTarget",
    "TrajectorySetpoint": "px4_msgs/msg/TrajectorySetpoint",
}
STARTS_S, ENDS_S = 30.0, 30.0
SAID = "diagnostic_msgs/msg/DiagnosticArray"


class HandRobot:
    """Goes at once where it is told to be, and stands where nothing comes."""

    def __init__(self, mission: Path, kind: str) -> None:
        setup = prepare(read_mission_file(str(mission)))
        self.world, self.lidar = setup.world, setup.lidars[0]
        self.place, self.velocity, self.yaw = np.zeros(3), np.zeros(3), 0.0
        self.kind = KINDS[kind]
        self.came_s: list[float] = []
        self.said: list[str] = []
        self.nearest_m, self.to_m = float("inf"), self.place
        self.bus = DdsBus(DOMAIN)
        for topic, message, quality in (
            ("/odom", "nav_msgs/msg/Odometry", SENSOR),
            ("/points", "sensor_msgs/msg/PointCloud2", SENSOR),
            ("/tf_static", "tf2_msgs/msg/TFMessage", STATIC_TF),
        ):
            self.bus.advertise(topic, message, quality)
        self.bus.subscribe("/target", self.kind, USUAL)
        self.bus.subscribe("/diagnostics", SAID, USUAL)
        self.bus.publish("/tf_static", pack_message(transform("lidar", "base_link")))
        self._cloud_s, self._stepped_s = 0.0, time.monotonic()

    def step(self) -> None:
        """Tell where it is and what it sees, and follow what has come."""
        now = time.time()
        if now - self._cloud_s >= CLOUD_S:
            self._cloud_s = now
            state = State(self.place, np.array([0.0, 0.0, self.yaw]), time_s=now)
            scan = simulate_scan(self.lidar, self.world, state, 0)
            # Missing returns are NaN, as drivers tell them.
            points = np.vstack([scan.points_m, np.full((1, 3), np.nan)])
            self.bus.publish("/points", pack_message(cloud(now, points)))
        own = odometry(now, self.place, self.yaw, 0.0)
        ahead, aside = self.velocity[0], self.velocity[1]
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        own.twist.twist.linear.x = float(cos * ahead + sin * aside)
        own.twist.twist.linear.y = float(cos * aside - sin * ahead)
        own.twist.twist.linear.z = float(self.velocity[2])
        self.bus.publish("/odom", pack_message(own))
        ends = time.monotonic() + STEP_S
        while (left := ends - time.monotonic()) > 0.0:
            self.bus.wait(left)
            for came in self.bus.take():
                self._take(came.topic, unpack_cdr(came.raw, came.type))
        # On a busy machine a step takes longer: it goes as far as its velocity says all the same.
        flown_s, self._stepped_s = time.monotonic() - self._stepped_s, time.monotonic()
        self.place = self.place + flown_s * self.velocity
        gap = float(self.world.distance_m(self.place[None])[0])
        self.nearest_m = min(self.nearest_m, gap)

    def _take(self, topic: str, message: Any) -> None:
        if topic == "/diagnostics":
            self.said += [one.message for one in message.status]
            return
        self.came_s.append(time.monotonic())
        if self.kind.startswith("px4"):
            swap = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
            to, velocity = swap @ message.position, np.nan_to_num(swap @ message.velocity)
        else:
            to = np.array([message.position.x, message.position.y, message.position.z])
            moves = message.type_mask != 0x9F8
            told = message.velocity
            velocity = np.array([told.x, told.y, told.z]) * moves
            self.yaw = message.yaw
        self.velocity = velocity + 1.0 * (to - self.place)


def fly_topics(
    folder: Path,
    cut: Cut,
    at_m: float,
    kind: str,
    *,
    after_s: float = 5.0,
    continues_s: float | None = None,
) -> tuple[HandRobot, float, int]:
    """Fly until it is so far ahead, cut the node, and fly on: robot, time of the cut, status.

    continues_s: so long after the cut the node is told to go on, and at the end to end.
    """
    (folder / "m.toml").write_text(WALL)
    parameters = PARAMETERS.format(mission=folder / "m.toml", kind=kind)
    (folder / "p.yaml").write_text(parameters)
    robot = HandRobot(folder / "m.toml", kind)
    node = begun("-m", "clearway", "ros2", folder / "p.yaml", "--domain", DOMAIN, "--json")
    try:
        until, cut_s = time.monotonic() + STARTS_S, 0.0
        while not cut_s or time.monotonic() < cut_s + after_s:
            robot.step()
            if not cut_s and robot.place[0] >= at_m:
                cut(node)
                cut_s = time.monotonic()
            if continues_s is not None and cut_s and time.monotonic() > cut_s + continues_s:
                node.send_signal(signal.SIGCONT)
            assert cut_s or time.monotonic() < until, "it never came so far"
        if continues_s is not None:
            node.terminate()
            node.communicate(timeout=ENDS_S)
    finally:
        node.send_signal(signal.SIGKILL)
        node.communicate()
        robot.bus.close()
    return robot, cut_s, node.returncode
