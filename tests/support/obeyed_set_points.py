"""What a robot flies of a set-point that came as a message, each as its own receiver takes it."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from clearway.base.frames import ned_from_enu, world_from_body
from clearway.mavlink.simulated_targets import Target, VelocityTarget, target_of
from clearway.px4.simulated_messages import target_of_trajectory
from solids import Array


def obey_twist(told: Any, yaw_rad: float) -> Target:
    """A base controller: velocity in the body as it points now, and a yaw rate."""
    return VelocityTarget(
        world_from_body([0.0, 0.0, yaw_rad]) @ vector(told.linear), told.angular.z
    )


def obey_position_target(told: Any, yaw_rad: float) -> Target | None:
    """mavros: from east, north, up to SET_POSITION_TARGET_LOCAL_NED, which an autopilot flies."""
    x, y, z = ned_from_enu(vector(told.position))
    vx, vy, vz = ned_from_enu(vector(told.velocity))
    afx, afy, afz = ned_from_enu(vector(told.acceleration_or_force))
    message = SimpleNamespace(
        type_mask=told.type_mask, coordinate_frame=told.coordinate_frame, x=x, y=y, z=z,
        vx=vx, vy=vy, vz=vz, afx=afx, afy=afy, afz=afz, yaw=0.5 * math.pi - told.yaw,
        yaw_rate=-told.yaw_rate,
    )  # fmt: skip
    return target_of(message, yaw_rad, 0.0)


def obey_trajectory(told: Any, yaw_rad: float) -> Target | None:
    """PX4: north, east, down, and what is not a number is free."""
    return target_of_trajectory(told, yaw_rad, np.zeros(3))


def vector(told: Any) -> Array:
    """[3] of a Point or Vector3."""
    return np.array([told.x, told.y, told.z])


OBEYED: dict[str, Callable[[Any, float], Target | None]] = {
    "Twist": obey_twist,
    "PositionTarget": obey_position_target,
    "TrajectorySetpoint": obey_trajectory,
}


def stamp_of(kind: str, told: Any) -> float:
    """The time that a set-point is for; a Twist has none."""
    if kind == "PositionTarget":
        return float(told.header.stamp.sec) + 1e-9 * float(told.header.stamp.nanosec)
    return 1e-6 * float(told.timestamp) if kind == "TrajectorySetpoint" else math.inf
