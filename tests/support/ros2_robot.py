"""A robot in a process of its own: publishes what a mission's world shows, follows set-points.

python ros2_robot.py MISSION DOMAIN STEPS KIND [pilot]: a line of JSON at the end, with its track,
and how near it came to what was there. DOMAIN "rclpy" is that of ROS. With a pilot, somebody
commands it straight at the last goal, and it flies what a guardian makes of that.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import numpy as np

from clearway.base.frames import FloatArray, geodetic_from_enu, world_from_body
from clearway.base.state import State
from clearway.live.link.hearing import SLOWEST  # noqa: F401  The library is loaded before time runs.
from clearway.mavlink.simulated_autopilot import SOMEWHERE
from clearway.mavlink.simulated_habits import default_habits
from clearway.mavlink.simulated_vehicle import VehicleLimits, VehicleTruth
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import CombinedWorld
from clearway.ros2.bus import SENSOR, STATIC_TF, USUAL
from clearway.ros2.dds import DdsBus
from clearway.ros2.kinds import SET_POINT_KINDS
from clearway.ros2.messages import make_message, pack_message, unpack_cdr
from clearway.ros2.rclpy_bus import RclpyBus
from clearway.ros2.told import make_stamp, point
from clearway.sensors import simulate_scan
from clearway.sim.scripted import Traffic
from obeyed_set_points import OBEYED, stamp_of
from ros2_for_tests import BEGAN_S, cloud, odometry, transform

STEP_S, FINE_S = 0.1, 0.02
"""Between two states that it publishes; and of its motion."""
TWIST, REPORT = "geometry_msgs/msg/Twist", "px4_msgs/msg/TransponderReport"
FIRST_S, ANSWER_S = 1.0, 2.0
"""So long it waits for a first set-point, and for each later one: its time stands still."""


class Robot:
    """Lock-step: after every step it waits for a set-point."""

    def __init__(self, mission: str, domain: str, kind: str, *, piloted: bool = False) -> None:
        self.piloted, self.kind = piloted, kind
        setup = prepare(file := read_mission_file(mission))
        self.world, self.lidar = setup.world, setup.lidars[0]
        start = setup.mission.start
        self.truth = VehicleTruth(start.position_m, np.zeros(3), float(start.attitude_rad[2]))
        habits = default_habits(setup.planner.automaton)
        self.limits = VehicleLimits(
            setup.planner.speed_mps, habits.acceleration_mps2, tilt_s=habits.tilt_s
        )
        self.goal, self.reach_m = setup.mission.goals_m[-1], setup.mission.reach_radius_m
        self.traffic = Traffic(
            setup.script, setup.mission, setup.planner.speed_mps, setup.traffic, 0
        )  # fmt: skip
        self.origin = np.array(file.mission.origin_geodetic or SOMEWHERE)
        self.nearest_m = self.nearest_intruder_m = self.from_goal_m = float("inf")
        self.led, self.led_s, self.arrived_s = 0, float("inf"), float("inf")
        self._told: Any = None
        in_ros = domain == "rclpy"
        self.bus: Any = RclpyBus.on_own_node("robot", "") if in_ros else DdsBus(int(domain))
        self.topic = "/cmd_vel" if piloted else "/target"
        for topic, kind, quality in (
            ("/odom", "nav_msgs/msg/Odometry", SENSOR),
            ("/points", "sensor_msgs/msg/PointCloud2", SENSOR),
            ("/clock", "rosgraph_msgs/msg/Clock", SENSOR),
        ):
            self.bus.advertise(topic, kind, quality)
        if piloted:
            self.bus.advertise("/cmd_vel_in", TWIST, USUAL)
        self.bus.subscribe(self.topic, SET_POINT_KINDS[self.kind], USUAL)
        self.has_traffic = bool(setup.script)
        if self.has_traffic:
            self.bus.advertise("/adsb", REPORT, SENSOR)
        self.frame = "base_link" if in_ros else "lidar"  # PyPI has no tf2_msgs for ROS.
        if not in_ros:
            mounted = self.lidar.mounting
            static = transform("lidar", "base_link", mounted.position_m, mounted.attitude_rad[2])
            self.bus.advertise("/tf_static", "tf2_msgs/msg/TFMessage", STATIC_TF)
            self.bus.publish("/tf_static", pack_message(static))
        self.track = [self.truth.position_m.tolist()]

    def step(self, number: int) -> None:
        mission_s = STEP_S * number
        now = BEGAN_S + mission_s
        place, yaw = self.truth.position_m, self.truth.yaw_rad
        state = State(place, np.array([0.0, 0.0, yaw]), time_s=now)
        world = CombinedWorld([self.world, ObstacleMap(self.traffic.bodies(mission_s))])
        scan = simulate_scan(self.lidar, world, state, number)
        # Missing returns are NaN, as drivers tell them.
        points = np.vstack([scan.points_m, np.full((1, 3), np.nan)])
        into_body = world_from_body([0.0, 0.0, yaw]).T
        own = odometry(now, place, yaw, 0.0)
        own.twist.twist.linear = point(into_body @ self.truth.velocity_mps, "Vector3")
        clock = make_message("rosgraph_msgs/msg/Clock", clock=make_stamp(now))
        told = [("/points", cloud(now, points, self.frame)), *self._tell_aircraft(mission_s)]
        if self.piloted:
            told.append(("/cmd_vel_in", self._wish(into_body)))
        told += [("/clock", clock), ("/odom", own)]
        packed = [(topic, pack_message(message)) for topic, message in told]
        self.bus.take()  # What answers an earlier state.
        # In one go: a node that looks in between would take its time for that of an older state.
        for topic, raw in packed:
            self.bus.publish(topic, raw)
        self._hear(now)
        self._fly(mission_s)

    def _wish(self, into_body: FloatArray) -> Any:
        """Straight at the goal, slower near it."""
        way = self.goal - self.truth.position_m
        far = float(np.linalg.norm(way))
        velocity = into_body @ way * min(1.0, far) / max(far, 1e-9)
        return make_message(TWIST, linear=point(velocity, "Vector3"))

    def _tell_aircraft(self, mission_s: float) -> list[tuple[str, Any]]:
        """As a transponder hears them."""
        told = []
        for at, one in enumerate(self.traffic.reports(mission_s)):
            latitude, longitude, height = geodetic_from_enu(one.position_m, self.origin)
            east, north, up = one.velocity_mps
            report = make_message(
                REPORT, icao_address=0xA00000 + at, lat=latitude, lon=longitude, altitude=height,
                heading=float(np.arctan2(east, north)), hor_velocity=float(np.hypot(east, north)),
                ver_velocity=float(up), flags=1 | 2 | 4 | 8 | 128, emitter_type=14,
            )  # fmt: skip
            told.append(("/adsb", report))
        return told

    def _hear(self, now: float) -> None:
        """Take set-points, up to the one that answers a state; without it, the last is flown on."""
        answered, began = False, time.monotonic()
        while not answered:
            if time.monotonic() > began + (FIRST_S if self._told is None else ANSWER_S):
                break
            self.bus.wait(0.05)
            for one in self.bus.take():
                self._told = unpack_cdr(one.raw, one.type)
                answered = answered or stamp_of(self.kind, self._told) >= now - 0.05
        self.led += answered

    def _fly(self, mission_s: float) -> None:
        """On to the next state, in fine steps: a velocity of the body turns with it."""
        for _ in range(round(STEP_S / FINE_S)):
            if self._told is not None:
                target = OBEYED[self.kind](self._told, self.truth.yaw_rad)
                assert target is not None, f"a {self.kind} that says nothing"
                self.truth = self.truth.after(FINE_S, target, self.limits)
            mission_s += FINE_S
            self._measure(mission_s)
        self.track.append(self.truth.position_m.tolist())

    def _measure(self, mission_s: float) -> None:
        """How near it comes to what is there, and to its goal."""
        place = self.truth.position_m
        gap = float(self.world.distance_m(place[None])[0])
        self.nearest_m = min(self.nearest_m, gap)
        self.traffic.step(State(place, np.array([0.0, 0.0, self.truth.yaw_rad]), time_s=mission_s))
        for name, track in self.traffic.tracks.items():
            apart = float(np.linalg.norm(track[-1][1] - place)) - self.traffic.radii_m()[name]
            self.nearest_intruder_m = min(self.nearest_intruder_m, apart)
        self.from_goal_m = min(self.from_goal_m, float(np.linalg.norm(place - self.goal)))
        if self.led:
            self.led_s = min(self.led_s, mission_s)
        if self.from_goal_m <= self.reach_m:
            self.arrived_s = min(self.arrived_s, mission_s)

    def summary(self) -> dict[str, Any]:
        """How the flight went in truth; seconds from the first set-point to the goal."""
        return {
            "led": self.led,
            "arrived": self.from_goal_m <= self.reach_m,
            "nearest_m": self.nearest_m,
            "nearest_intruder_m": self.nearest_intruder_m,
            "from_goal_m": self.from_goal_m,
            "seconds": round(self.arrived_s - self.led_s, 3),
            "track": self.track,
        }


def main() -> None:
    mission, domain, steps, kind = sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4]
    robot = Robot(mission, domain, kind, piloted="pilot" in sys.argv[5:])
    began = time.monotonic()
    while not robot.bus.subscribers("/odom") and time.monotonic() < began + 240.0:
        time.sleep(0.1)
    time.sleep(0.5)
    for number in range(steps):
        robot.step(number)
        if robot.led and not robot.bus.subscribers("/odom"):
            break
    robot.bus.close()
    print(json.dumps(robot.summary()))


if __name__ == "__main__":
    main()
