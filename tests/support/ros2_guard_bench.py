"""A guardian on topics told by hand, without a network."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from clearway.base.state import State
from clearway.live.guard.guard_session import GuardSession
from clearway.live.guard.guardian import Guardian
from clearway.live.link.floor import FloorRule
from clearway.live.link.hearing import SessionTerms
from clearway.live.link.outcome import TickOutcome
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.ros2.guard_link import GuardLink
from clearway.ros2.messages import make_message
from clearway.ros2.parameters import Names, NodeParameters
from clearway.ros2.told import header
from guarded_flights import planner_for
from ros2_for_tests import BEGAN_S, LIDAR, LocalBus, odometry, transform

WALL = ObstacleMap([Obstacle.cuboid([3.0, 0.0, 0.0], (1.0, 9.0, 9.0))])
"""From x = 2.5 on."""
NOWHERE = ObstacleMap([])
EVERY = {
    "body": {"topic": "cmd_vel", "type": "Twist"},
    "map": {"topic": "stamped", "type": "TwistStamped", "frame": "map"},
    "mavros": {"topic": "mavros", "type": "PositionTarget"},
    "px4": {"topic": "px4", "type": "TrajectorySetpoint"},
}


def twist(x: float = 0.0, y: float = 0.0, z: float = 0.0, turn: float = 0.0) -> Any:
    message = make_message("geometry_msgs/msg/Twist")
    message.linear.x, message.linear.y, message.linear.z = float(x), float(y), float(z)
    message.angular.z = float(turn)
    return message


def stamped(frame: str, x: float = 0.0, y: float = 0.0) -> Any:
    return make_message(
        "geometry_msgs/msg/TwistStamped", header=header(BEGAN_S, frame), twist=twist(x, y)
    )


class GuardBench:
    """Our clock and the vehicle's run together; ticks at 10 Hz."""

    def __init__(
        self,
        vehicle: str = "stops",
        obstacle_map: ObstacleMap = WALL,
        sensor: bool = False,
        **parameters: Any,
    ) -> None:
        """sensor: all is known by the LiDAR of `ros2_for_tests` alone, and nothing by the map."""
        given = {
            "mission": Path("none.toml"), "act": True, "set_points": EVERY, "ground_m": -50.0,
        } | parameters  # fmt: skip
        lidars = {"front": LIDAR} if sensor else {}
        if sensor:
            given["clouds"] = {"front": {"topic": "points"}}
        self.parameters = NodeParameters.model_validate(given)
        guard = self.parameters.guard
        acceleration = guard.acceleration_mps2 or math.inf
        self.guardian = Guardian(
            planner_for(vehicle, "strict" if sensor else "known"),
            State(np.zeros(3)),
            lidars=tuple(lidars.values()),
            obstacle_map=None if sensor else obstacle_map,
            hold_s=guard.hold_s,
            acceleration_mps2=acceleration,
        )
        self.bus, self.counts = LocalBus(), Counter[str]()
        terms = SessionTerms(act=self.parameters.act, floor=FloorRule(0.6))
        self.session = GuardSession(
            self.guardian, lidars.get("front"), terms, self.counts, wish_s=guard.timeout_s
        )
        self.link = GuardLink(self.bus, self.session, self.parameters, Names(), lidars, None)
        if sensor:
            self.bus.tell("/tf_static", transform("lidar", "base_link", (0.2, 0.0, 0.1)))

    def tick(
        self, number: int, wish: Any = None, place: Any = (0.0, 0.0, 0.0), yaw: float = 0.0,
        speed: float = 0.0,
    ) -> TickOutcome:  # fmt: skip
        """An own place, a wish where there is one, and what came of it."""
        now = 0.1 * number
        self.bus.tell("/odom", odometry(BEGAN_S + now, place, yaw, speed))
        if wish is not None:
            self.bus.tell("/cmd_vel_in", wish)
        return self.quiet(now)

    def quiet(self, now: float) -> TickOutcome:
        """A tick in which nothing new came."""
        self.link.hear(now)
        return self.link.tick(now)

    def sent(self, topic: str) -> list[Any]:
        return self.bus.sent[topic]
