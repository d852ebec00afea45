"""A simulated PX4: a multicopter in a mission's world that external modes can fly.

It tells what PX4 tells on topics, in north, east, down; its attitude is always level. Distances
come as ObstacleDistance, or as a cloud where the mission's first sensor is to be simulated.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Any, Final

import numpy as np

from clearway.base.frames import ned_from_enu
from clearway.base.state import State
from clearway.io.json_values import round_number
from clearway.live.link.set_point import SetPoint
from clearway.mavlink.distances import BODY_FRD
from clearway.mavlink.simulated_autopilot import SOMEWHERE
from clearway.mavlink.simulated_habits import default_habits
from clearway.mavlink.simulated_targets import Target
from clearway.mavlink.simulated_telemetry import SECTORS, measure_sectors
from clearway.mavlink.simulated_vehicle import VehicleLimits, VehicleTruth, ground_of
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import FlightSetup
from clearway.px4.mode import FIRST_MODE, HOLD_MODE
from clearway.px4.releases import Release
from clearway.px4.simulated_commander import TAKE_OFF, Commander, Px4Habits
from clearway.px4.simulated_messages import cloud_message, target_of_trajectory
from clearway.ros2.bus import SENSOR, STATIC_TF, Quality, TopicBus
from clearway.ros2.messages import damages, make_message, pack_message, unpack_cdr
from clearway.ros2.told import header, make_stamp, point, turn_into_message
from clearway.sensors import Lidar, simulate_scan

BEGAN_S: Final = 1_700_000_000.0
"""PX4's clock is that of its agent: seconds since 1970."""
STEP_S: Final = 0.02
CLIMB_MPS: Final = 2.0
UPWARD_M: Final = 0.2
RESET_M: Final = 1.0
OUT = Quality(reliable=False, latched=True, depth=1)
"""As PX4's client publishes; what comes in is best effort too."""
IN = Quality(reliable=False, depth=20)
CLOUD_FRAME = "lidar"
DISTANCES = "/fmu/in/obstacle_distance"


class SimulatedPx4:
    """Step it with `step`; a simulated pilot uses `commander`."""

    def __init__(
        self,
        bus: TopicBus,
        file: MissionFile,
        setup: FlightSetup,
        release: Release,
        habits: Px4Habits | None = None,
        cloud_topic: str = "",
    ) -> None:
        self.habits = habits or Px4Habits()
        self.commander = Commander(release, self._send, self.habits)
        self.bus, self.release, self.time_s = bus, release, 0.0
        self.heard: Counter[str] = Counter()
        self.strays = 0
        """Set-points that came while no external mode flew: PX4's own modes would fly them."""
        self.nearest_obstacle_m, self.fastest_mps = math.inf, 0.0
        self.answered_s = -math.inf
        """Stamp of the state that the newest set-point answers, as far as is known."""
        self._setup, self._origin = setup, np.array(file.mission.origin_geodetic or SOMEWHERE)
        start = setup.mission.start
        self._start = start.position_m
        self.ground_m = ground_of(setup)
        vehicle = default_habits(setup.planner.automaton)
        self._limits = VehicleLimits(
            setup.planner.speed_mps, vehicle.acceleration_mps2, tilt_s=vehicle.tilt_s
        )
        begins_m = np.array([*self._start[:2], self.ground_m])
        if self.habits.starts_armed:
            begins_m = self._start
            self.commander.is_armed, self.commander.landed = True, False
        self.truth = VehicleTruth(begins_m, np.zeros(3), float(start.attitude_rad[2]))
        self._held = self.truth
        self._flown_in = self.commander.nav_state
        self._target: Target | None = None
        self._shift_m, self._resets = np.zeros(3), 0
        self._range_m = (file.lidar[0].max_range_m if file.lidar else None) or (
            setup.planner.grid.range_m
        )
        self._lidar: Lidar | None = setup.lidars[0] if cloud_topic else None
        self._cloud_topic = cloud_topic
        self._open()

    def _open(self) -> None:
        self._incoming: dict[str, str] = {}
        for message in self.release.messages:
            topic, kind = self.release.topic(message), self.release.kind(message)
            if "/fmu/in/" in topic:
                self._incoming[topic] = message
                self.bus.subscribe(topic, kind, IN)
            else:
                self.bus.advertise(topic, kind, OUT)
        self.bus.advertise("/clock", "rosgraph_msgs/msg/Clock", SENSOR)
        if self._lidar is None:
            self.bus.advertise(DISTANCES, "px4_msgs/msg/ObstacleDistance", SENSOR)
            return
        self.bus.advertise(self._cloud_topic, "sensor_msgs/msg/PointCloud2", SENSOR)
        self.bus.advertise("/tf_static", "tf2_msgs/msg/TFMessage", STATIC_TF)
        mounted = self._lidar.mounting
        there = make_message(
            "geometry_msgs/msg/TransformStamped", header=header(0.0, "base_link"),
            child_frame_id=CLOUD_FRAME,
        )  # fmt: skip
        there.transform.translation = point(mounted.position_m, "Vector3")
        there.transform.rotation = turn_into_message(float(mounted.attitude_rad[2]))
        self._publish("/tf_static", make_message("tf2_msgs/msg/TFMessage", transforms=[there]))

    # --- the flight -----------------------------------------------------------------------

    @property
    def now_s(self) -> float:
        """PX4's time."""
        return BEGAN_S + self.time_s

    @property
    def flies_external(self) -> bool:
        """Whether an external mode flies the vehicle."""
        return self.commander.is_armed and self.commander.nav_state >= FIRST_MODE

    def step(self, seconds: float = 0.1) -> None:
        """Take what has come, fly on, and tell what is due."""
        self.listen()
        until = self.time_s + seconds
        while self.time_s < until - 1e-9:
            self._fly(min(STEP_S, until - self.time_s))
        if self.time_s < self.habits.dies_s:
            self._tell()

    def _fly(self, step_s: float) -> None:
        commander, before_s = self.commander, self.time_s
        self.time_s += step_s
        if before_s < self.habits.restarts_s <= self.time_s:
            commander.modes.clear()
        if before_s < self.habits.resets_s <= self.time_s:
            self._shift_m, self._resets = np.array([RESET_M, 0.0, 0.0]), 1
        if self.time_s < self.habits.dies_s:
            commander.update(self.now_s)
        if commander.nav_state != self._flown_in:
            self._flown_in, self._held, self._target = commander.nav_state, self.truth, None
        if not commander.is_armed:
            return
        if commander.nav_state == TAKE_OFF:
            self._climb(step_s)
        else:
            hover = SetPoint.holding(self._held.position_m, self._held.yaw_rad)
            own = self._target if self.flies_external else None
            self.truth = self.truth.after(step_s, own or hover, self._limits)
        self._measure()

    def _climb(self, step_s: float) -> None:
        """Straight up to the height of the mission's start, and then Hold."""
        up_m = min(CLIMB_MPS * step_s, float(self._start[2] - self.truth.position_m[2]))
        place = self.truth.position_m + np.array([0.0, 0.0, up_m])
        self.truth = VehicleTruth(place, np.zeros(3), self.truth.yaw_rad)
        self.commander.landed = bool(place[2] < self.ground_m + UPWARD_M)
        if place[2] >= self._start[2] - 1e-6:
            self.commander.choose(HOLD_MODE)

    def _measure(self) -> None:
        gap = float(self._setup.world.distance_m(self.truth.position_m[None])[0])
        self.nearest_obstacle_m = min(self.nearest_obstacle_m, gap)
        self.fastest_mps = max(self.fastest_mps, float(np.linalg.norm(self.truth.velocity_mps)))

    @property
    def from_goal_m(self) -> float:
        """How far it is from the mission's last goal."""
        return float(np.linalg.norm(self.truth.position_m - self._setup.mission.goals_m[-1]))

    # --- in -------------------------------------------------------------------------------

    def listen(self) -> None:
        """Take what has come."""
        # Topics have no order among each other: what a mode did is heard before that it has left.
        done = self.release.topic("ModeCompleted")
        for came in sorted(self.bus.take(), key=lambda one: one.topic != done):
            message = self._incoming.get(came.topic)
            if message is None:
                continue
            try:
                told = unpack_cdr(came.raw, self.release.kind(message))
            except damages():
                self.heard["malformed"] += 1
                continue
            self.heard[message] += 1
            if message == "TrajectorySetpoint":
                self._take_set_point(told)
            else:
                self.commander.hear(message, told, self.now_s)

    def _take_set_point(self, told: Any) -> None:
        self.strays += not self.flies_external
        self.commander.set_point_s = self.now_s
        self.answered_s = self.time_s
        self._target = target_of_trajectory(told, self.truth.yaw_rad, self._shift_m)

    # --- out ------------------------------------------------------------------------------

    def _tell(self) -> None:
        self._tell_sensor()
        self._publish(
            "/clock", make_message("rosgraph_msgs/msg/Clock", clock=make_stamp(self.now_s))
        )
        local = self.truth.position_m + self._shift_m
        north, east, down = ned_from_enu(local).tolist()
        vx, vy, vz = ned_from_enu(self.truth.velocity_mps).tolist()
        valid = self.commander.position_is_valid
        heading = math.remainder(0.5 * math.pi - self.truth.yaw_rad, 2.0 * math.pi)
        stamps = {"timestamp": round(1e6 * self.now_s), "timestamp_sample": round(1e6 * self.now_s)}
        latitude, longitude, height = self._origin.tolist()
        self._send_out(
            "VehicleLocalPosition", **stamps, x=north, y=east, z=down, vx=vx, vy=vy, vz=vz,
            xy_valid=valid, z_valid=valid, v_xy_valid=valid, v_z_valid=valid, heading=heading,
            heading_good_for_control=True, xy_reset_counter=self._resets, xy_global=True,
            z_global=True, ref_lat=latitude, ref_lon=longitude, ref_alt=height,
        )  # fmt: skip
        self._send_out("HomePosition", timestamp=stamps["timestamp"], valid_lpos=True,
                       z=-self.ground_m)  # fmt: skip
        if self.time_s >= self.habits.odometry_ends_s:
            return
        self._send_out(
            "VehicleOdometry", **stamps, pose_frame=1, velocity_frame=1,
            position=np.array([north, east, down], np.float32),
            velocity=np.array([vx, vy, vz], np.float32), reset_counter=self._resets,
            q=np.array([math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)], np.float32),
        )  # fmt: skip

    def _tell_sensor(self) -> None:
        if self._lidar is None:
            far = measure_sectors(self.truth, self._setup.world, self._range_m)
            reach = round(100.0 * self._range_m)
            told = np.where(np.isfinite(far), np.floor(100.0 * far), reach + 1)
            self._publish(DISTANCES, make_message(
                "px4_msgs/msg/ObstacleDistance", timestamp=round(1e6 * self.now_s), frame=BODY_FRD,
                distances=np.minimum(told, reach + 1).astype(np.uint16), increment=360.0 / SECTORS,
                max_distance=reach,
            ))  # fmt: skip
            return
        attitude = np.array([0.0, 0.0, self.truth.yaw_rad])
        state = State(self.truth.position_m, attitude, time_s=self.now_s)
        seed = round(1e3 * self.time_s)
        scan = simulate_scan(self._lidar, self._setup.world, state, seed)
        self._publish(self._cloud_topic, cloud_message(scan.points_m, self.now_s, CLOUD_FRAME))

    def _send_out(self, message: str, **fields: Any) -> None:
        self._send(message, make_message(self.release.kind(message), **fields))

    def _send(self, message: str, told: Any) -> None:
        self._publish(self.release.topic(message), told)

    def _publish(self, topic: str, told: Any) -> None:
        self.bus.publish(topic, pack_message(told))

    def summary(self) -> dict[str, Any]:
        """How the flight went in truth."""
        return {
            "time_s": round(self.time_s, 3),
            "nav_state": self.commander.nav_state,
            "failsafe": self.commander.is_in_failsafe,
            "completed": self.commander.completed,
            "from_goal_m": round(self.from_goal_m, 3),
            "nearest_obstacle_m": round_number(self.nearest_obstacle_m, 3),
            "fastest_mps": round(self.fastest_mps, 3),
            "strays": self.strays,
            "heard": dict(self.heard),
        }
