"""What the simulated autopilot is told to fly: to a place, to hold one, or a velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray, enu_from_ned, world_from_body
from clearway.live.link.set_point import SetPoint
from clearway.mavlink.dialect import Message
from clearway.mavlink.set_points import (
    IGNORE_POSITION,
    LOCAL_NED,
    NO_ACCELERATION,
    NO_VELOCITY,
    NO_YAW_RATE,
)
from clearway.mavlink.wishes import BODY_FRAMES, WORLD_FRAMES


@dataclass(frozen=True, slots=True, eq=False)
class VelocityTarget:
    """To fly with a velocity, wherever that leads."""

    velocity_mps: FloatArray
    """[3] local frame, z up."""
    yaw_rate_rps: float
    """Left positive."""
    acceleration_mps2: FloatArray | None = None
    """[3] beside it; None where none is told."""


Target = SetPoint | VelocityTarget


def name_controller(target: Target) -> str:
    """Which of an autopilot's controllers flies it."""
    if isinstance(target, VelocityTarget):
        return "velocity"
    return "place" if target.velocity_mps is None else "plan"


def target_of(message: Message, yaw_rad: float, height_off_m: float) -> Target | None:
    """Of a SET_POSITION_TARGET_LOCAL_NED; None for one that says nothing that is flown.

    yaw_rad: of the vehicle, by which velocities of the body are turned when they come.
    height_off_m: of the local frame's zero.
    """
    mask, frame = int(message.type_mask), int(message.coordinate_frame)
    velocity = enu_from_ned([message.vx, message.vy, message.vz])
    if not mask & IGNORE_POSITION and frame == LOCAL_NED:
        place = enu_from_ned([message.x, message.y, message.z])
        place[2] += height_off_m
        yaw = np.pi / 2.0 - message.yaw
        if mask & NO_VELOCITY:
            return SetPoint(place, None, float(yaw))
        rate = 0.0 if mask & NO_YAW_RATE else -float(message.yaw_rate)
        faster = enu_from_ned([message.afx, message.afy, message.afz])
        told = None if mask & NO_ACCELERATION else faster
        return SetPoint(place, velocity, float(yaw), told, rate)
    if mask & NO_VELOCITY or frame not in (*WORLD_FRAMES, *BODY_FRAMES):
        return None
    if frame in BODY_FRAMES:
        ahead_left_up = np.array([message.vx, -message.vy, -message.vz], dtype=np.float64)
        velocity = world_from_body([0.0, 0.0, yaw_rad]) @ ahead_left_up
    rate = 0.0 if mask & NO_YAW_RATE else -float(message.yaw_rate)
    faster = enu_from_ned([message.afx, message.afy, message.afz])
    return VelocityTarget(velocity, rate, None if mask & NO_ACCELERATION else faster)
