"""What a simulated PX4 reads and shows: set-points as targets, returns as a cloud."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from clearway.base.frames import FloatArray, enu_from_ned
from clearway.live.link.set_point import SetPoint
from clearway.mavlink.simulated_targets import Target, VelocityTarget
from clearway.ros2.messages import make_message
from clearway.ros2.told import header


def target_of_trajectory(told: Any, yaw_rad: float, shift_m: FloatArray) -> Target | None:
    """What a TrajectorySetpoint says is to be flown; None where it says nothing.

    shift_m: of PX4's frame, as its estimator has it, from the true one.
    """
    place, velocity = (enu_from_ned(np.array(v, float)) for v in (told.position, told.velocity))
    faster = enu_from_ned(np.array(told.acceleration, float))
    rate = -float(told.yawspeed) if math.isfinite(told.yawspeed) else 0.0
    moves = bool(np.all(np.isfinite(velocity)))
    if not np.all(np.isfinite(place)):
        return VelocityTarget(velocity, rate) if moves else None
    yaw = 0.5 * math.pi - float(told.yaw) if math.isfinite(told.yaw) else yaw_rad
    target = SetPoint(place - shift_m, velocity if moves else None, yaw, yaw_rate_rps=rate)
    return replace(target, acceleration_mps2=faster) if np.all(np.isfinite(faster)) else target


def cloud_message(points_m: FloatArray, time_s: float, frame: str) -> Any:
    """A PointCloud2 in its sensor's frame; a return that is missing is not a number."""
    told = np.vstack([points_m, np.full((1, 3), np.nan)]).astype("<f4")
    fields = [
        make_message(
            "sensor_msgs/msg/PointField", name=axis, offset=4 * number, datatype=7, count=1
        )
        for number, axis in enumerate("xyz")
    ]
    return make_message(
        "sensor_msgs/msg/PointCloud2", header=header(time_s, frame), height=1,
        width=len(told), fields=fields, point_step=12, row_step=12 * len(told),
        data=np.frombuffer(told.tobytes(), dtype=np.uint8),
    )  # fmt: skip
