"""A robot in a process of its own: publishes what a mission's world shows, follows set-points.

python ros2_robot.py MISSION DOMAIN STEPS [pilot]: a line of JSON at the end, with its track and how
near it came to what was there. With a pilot, somebody commands it straight at the last goal, and it
flies what a guardian makes of that.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np

from clearway.base.frames import geodetic_from_enu
from clearway.base.state import State
from clearway.live.link.hearing import SLOWEST  # noqa: F401  The library is loaded before time runs.
from clearway.mavlink.simulated_autopilot import SOMEWHERE
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import CombinedWorld
from clearway.ros2.bus import SENSOR, STATIC_TF, USUAL
from clearway.ros2.dds import DdsBus
from clearway.ros2.messages import make_message, pack_message, unpack_cdr
from clearway.ros2.told import make_stamp, point
from clearway.sensors import simulate_scan
from clearway.sim.scripted import Traffic
from ros2_for_tests import BEGAN_S, cloud, odometry, transform
from solids import Array

STEP_S = 0.1
TWIST, REPORT = "geometry_msgs/msg/Twist", "px4_msgs/msg/TransponderReport"
TARGET = "mavros_msgs/msg/PositionTarget"
SILENT_S = 10.0


class Robot:
    """Lock-step: after every step it waits for a set-point, unless none ever came."""

    def __init__(self, mission: str, domain: int, *, piloted: bool = False) -> None:
        self.piloted = piloted
        file = read_mission_file(mission)
        setup = prepare(file)
        self.world, self.lidar = setup.world, setup.lidars[0]
        self.place, self.yaw = setup.mission.start.position_m.copy(), 0.0
        self.yaw = float(setup.mission.start.attitude_rad[2])
        self.velocity = np.zeros(3)
        self.goal = setup.mission.goals_m[-1]
        self.traffic = Traffic(
            setup.script, setup.mission, setup.planner.speed_mps, setup.traffic, 0
        )  # fmt: skip
        self.origin = np.array(file.mission.origin_geodetic or SOMEWHERE)
        self.nearest_m = self.nearest_intruder_m = float("inf")
        self.bus = DdsBus(domain)
        for topic, kind, quality in (
            ("/odom", "nav_msgs/msg/Odometry", SENSOR),
            ("/points", "sensor_msgs/msg/PointCloud2", SENSOR),
            ("/tf_static", "tf2_msgs/msg/TFMessage", STATIC_TF),
            ("/clock", "rosgraph_msgs/msg/Clock", SENSOR),
        ):
            self.bus.advertise(topic, kind, quality)
        if piloted:
            self.bus.advertise("/cmd_vel_in", TWIST, USUAL)
            self.bus.subscribe("/cmd_vel", TWIST, USUAL)
        else:
            self.bus.subscribe("/target", TARGET, USUAL)
        self.bus.advertise("/adsb", REPORT, SENSOR)
        mounted = self.lidar.mounting
        static = transform("lidar", "base_link", mounted.position_m, mounted.attitude_rad[2])
        self.bus.publish("/tf_static", pack_message(static))
        self.track = [self.place.tolist()]
        self.led = 0

    def step(self, number: int) -> None:
        now = BEGAN_S + STEP_S * number
        state = State(self.place, np.array([0.0, 0.0, self.yaw]), time_s=now)
        mission_s = STEP_S * number
        bodies = ObstacleMap(self.traffic.bodies(mission_s))
        world = CombinedWorld([self.world, bodies])
        scan = simulate_scan(self.lidar, world, state, number)
        self.bus.publish(
            "/clock", pack_message(make_message("rosgraph_msgs/msg/Clock", clock=make_stamp(now)))
        )
        # Missing returns are NaN, as drivers tell them.
        points = np.vstack([scan.points_m, np.full((1, 3), np.nan)])
        self.bus.publish("/points", pack_message(cloud(now, points)))
        self._tell_aircraft(mission_s)
        if self.piloted:
            way = self.goal - self.place
            far = float(np.linalg.norm(way))
            velocity = self._level() @ way * min(1.0, far) / max(far, 1e-9)
            wish = make_message("geometry_msgs/msg/Twist", linear=point(velocity, "Vector3"))
            self.bus.publish("/cmd_vel_in", pack_message(wish))
        time.sleep(0.004)
        own = odometry(now, self.place, self.yaw, 0.0)
        own.twist.twist.linear = point(self._level() @ self.velocity, "Vector3")
        self.bus.publish("/odom", pack_message(own))
        self._follow(now)
        self._measure(mission_s)

    def _level(self) -> Array:
        """[3, 3] of the body in the world, level."""
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])

    def _tell_aircraft(self, mission_s: float) -> None:
        """As a transponder hears them."""
        for at, one in enumerate(self.traffic.reports(mission_s)):
            latitude, longitude, height = geodetic_from_enu(one.position_m, self.origin)
            east, north, up = one.velocity_mps
            told = make_message(
                REPORT, icao_address=0xA00000 + at, lat=latitude, lon=longitude, altitude=height,
                heading=float(np.arctan2(east, north)), hor_velocity=float(np.hypot(east, north)),
                ver_velocity=float(up), flags=1 | 2 | 4 | 8 | 128, emitter_type=14,
            )  # fmt: skip
            self.bus.publish("/adsb", pack_message(told))

    def _measure(self, mission_s: float) -> None:
        """How near it comes to what is there."""
        gap = float(self.world.distance_m(self.place[None])[0])
        self.nearest_m = min(self.nearest_m, gap)
        attitude = np.array([0.0, 0.0, self.yaw])
        self.traffic.step(State(self.place, attitude, time_s=mission_s))
        for name, track in self.traffic.tracks.items():
            apart = float(np.linalg.norm(track[-1][1] - self.place))
            apart -= self.traffic.radii_m()[name]
            self.nearest_intruder_m = min(self.nearest_intruder_m, apart)

    def _follow(self, now: float) -> None:
        if self.piloted:
            self._follow_velocity()
            return
        until = time.monotonic() + (0.5 if self.led else 0.1)
        target = None
        while target is None and time.monotonic() < until:
            self.bus.wait(0.05)
            for came in self.bus.take():
                told = unpack_cdr(came.raw, TARGET)
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

    def _follow_velocity(self) -> None:
        until, told = time.monotonic() + (1.0 if self.led else 0.1), None
        while told is None and time.monotonic() < until:
            self.bus.wait(0.05)
            for came in self.bus.take():
                told = unpack_cdr(came.raw, TWIST)
        if told is None:
            return
        self.led += 1
        body = np.array([told.linear.x, told.linear.y, told.linear.z])
        self.velocity = body @ self._level()
        self.place = self.place + STEP_S * self.velocity
        self.yaw += STEP_S * told.angular.z
        self.track.append(self.place.tolist())


def main() -> None:
    mission, domain, steps = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    robot = Robot(mission, domain, piloted="pilot" in sys.argv[4:])
    began = time.monotonic()
    while not robot.bus.subscribers("/odom") and time.monotonic() < began + 240.0:
        time.sleep(0.1)
    time.sleep(0.5)
    for number in range(steps):
        robot.step(number)
        if robot.led and not robot.bus.subscribers("/odom"):
            break
    robot.bus.close()
    nearest = {"nearest_m": robot.nearest_m, "nearest_intruder_m": robot.nearest_intruder_m}
    print(json.dumps({"led": robot.led, "track": robot.track} | nearest))


if __name__ == "__main__":
    main()
