"""A robot in a process of its own: publishes what a mission's world shows, follows set-points.

python ros2_robot.py MISSION DOMAIN STEPS: a line of JSON at the end, with its track.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np

from clearway.base.state import State
from clearway.live.link.session import SLOWEST  # noqa: F401  The library is loaded before time runs.
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.ros2.bus import SENSOR, STATIC_TF, USUAL
from clearway.ros2.dds import DdsBus
from clearway.ros2.messages import made, packed, unpacked
from clearway.ros2.told import point, stamp_of
from clearway.sensors import simulate_scan
from ros2_for_tests import BEGAN_S, cloud, odometry, transform

STEP_S = 0.1
TARGET = "mavros_msgs/msg/PositionTarget"
SILENT_S = 10.0


class Robot:
    """Lock-step: after every step it waits for a set-point, unless none ever came."""

    def __init__(self, mission: str, domain: int) -> None:
        setup = prepare(read_mission_file(mission))
        self.world, self.lidar = setup.world, setup.lidars[0]
        self.place, self.yaw = setup.mission.start.position_m.copy(), 0.0
        self.yaw = float(setup.mission.start.attitude_rad[2])
        self.velocity = np.zeros(3)
        self.traffic = setup.script
        self.bus = DdsBus(domain)
        for topic, kind, quality in (
            ("/odom", "nav_msgs/msg/Odometry", SENSOR),
            ("/points", "sensor_msgs/msg/PointCloud2", SENSOR),
            ("/tf_static", "tf2_msgs/msg/TFMessage", STATIC_TF),
            ("/clock", "rosgraph_msgs/msg/Clock", SENSOR),
        ):
            self.bus.advertise(topic, kind, quality)
        self.bus.subscribe("/target", TARGET, USUAL)
        mounted = self.lidar.mounting
        static = transform("lidar", "base_link", mounted.position_m, mounted.attitude_rad[2])
        self.bus.publish("/tf_static", packed(static))
        self.track = [self.place.tolist()]
        self.led = 0

    def step(self, number: int) -> None:
        now = BEGAN_S + STEP_S * number
        state = State(self.place, np.array([0.0, 0.0, self.yaw]), time_s=now)
        scan = simulate_scan(self.lidar, self.world, state, number)
        self.bus.publish("/clock", packed(made("rosgraph_msgs/msg/Clock", clock=stamp_of(now))))
        # Missing returns are NaN, as drivers tell them.
        points = np.vstack([scan.points_m, np.full((1, 3), np.nan)])
        self.bus.publish("/points", packed(cloud(now, points)))
        time.sleep(0.004)
        own = odometry(now, self.place, self.yaw, 0.0)
        level = np.array([[np.cos(self.yaw), np.sin(self.yaw), 0.0],
                          [-np.sin(self.yaw), np.cos(self.yaw), 0.0], [0.0, 0.0, 1.0]])  # fmt: skip
        own.twist.twist.linear = point(level @ self.velocity, "Vector3")
        self.bus.publish("/odom", packed(own))
        self._follow(now)

    def _follow(self, now: float) -> None:
        until = time.monotonic() + (0.5 if self.led else 0.1)
        target = None
        while target is None and time.monotonic() < until:
            self.bus.wait(0.05)
            for came in self.bus.take():
                told = unpacked(came.raw, TARGET)
                if told.header.stamp.sec + 1e-9 * told.header.stamp.nanosec >= now - 0.05:
                    target = told
        if target is None:
            return
        self.led += 1
        to = np.array([target.position.x, target.position.y, target.position.z])
        speed = np.array([target.velocity.x, target.velocity.y, target.velocity.z])
        moving = target.type_mask == 0x9C0
        # The place is half a tick ahead on the plan; it is followed for a whole one.
        aim = to + 0.5 * STEP_S * speed if moving else to
        way = aim - self.place
        far = float(np.linalg.norm(way))
        most = 1.2 * STEP_S
        if far > most:
            way *= most / far
        self.velocity = way / STEP_S
        self.place = self.place + way
        turn = (target.yaw - self.yaw + np.pi) % (2.0 * np.pi) - np.pi
        self.yaw += float(np.clip(turn, -1.0, 1.0))
        self.track.append(self.place.tolist())


def main() -> None:
    mission, domain, steps = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    robot = Robot(mission, domain)
    began = time.monotonic()
    while not robot.bus.subscribers("/odom") and time.monotonic() < began + 240.0:
        time.sleep(0.1)
    time.sleep(0.5)
    for number in range(steps):
        robot.step(number)
        if robot.led and not robot.bus.subscribers("/odom"):
            break
    robot.bus.close()
    print(json.dumps({"led": robot.led, "track": robot.track}))


if __name__ == "__main__":
    main()
