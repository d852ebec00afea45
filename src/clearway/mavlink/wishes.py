"""Commands of a pilot or a planner as wishes: velocity and place set-points, and sticks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray, enu_from_ned, ned_from_enu, world_from_body
from clearway.live.guard.guard_session import WishMaker
from clearway.live.guard.wish import PathWish, VelocityWish, Wish
from clearway.live.link.own_motion import OwnMotion
from clearway.mavlink.dialect import Message, dialect
from clearway.mavlink.set_points import (
    IGNORE_POSITION,
    LOCAL_NED,
    NO_ACCELERATION,
    NO_VELOCITY,
    NO_YAW_RATE,
)

NO_YAW = 0x400
VELOCITY = IGNORE_POSITION | NO_ACCELERATION | NO_YAW
"""Type mask: velocity and yaw rate count."""
WITHOUT_PLACE = IGNORE_POSITION | NO_YAW
"""Type mask: velocity, acceleration and yaw rate count."""
WORLD_FRAMES = (LOCAL_NED, 7)
"""MAV_FRAME_LOCAL_NED, LOCAL_OFFSET_NED: velocities are those of the world."""
BODY_FRAMES = (8, 9, 12)
"""BODY_NED, BODY_OFFSET_NED, BODY_FRD: along the nose, right, down."""
STICK = 1000
"""Of MANUAL_CONTROL, the end of an axis."""
MIDDLE = 500
"""Of MANUAL_CONTROL, the throttle at which height is kept."""
STICK_YAW_RPS = 1.0
"""At the end of the yaw axis."""


class Sticks(NamedTuple):
    """What the ends of the axes of MANUAL_CONTROL mean."""

    speed_mps: float
    climb_mps: float

    @classmethod
    def of(cls, planner: Planner) -> Sticks | None:
        """None for a vehicle that cannot stop: sticks let go of would have it stand still."""
        if not planner.automaton.can_stop:
            return None
        climbs = [abs(movement.climb_mps or 0.0) for movement in planner.automaton.movements]
        return cls(planner.speed_mps, max(climbs))


def of_set_point(message: Message, world_from_local_m: FloatArray, speed_mps: float) -> WishMaker:
    """SET_POSITION_TARGET_LOCAL_NED: its velocity where it has one, else its place at a speed.

    Raises InputError for one that has neither, or not in a frame that is known here.
    """
    mask, frame = int(message.type_mask), int(message.coordinate_frame)
    rate = 0.0 if mask & NO_YAW_RATE else -float(message.yaw_rate)
    told = [message.vx, message.vy, message.vz]
    if not mask & NO_VELOCITY and frame in WORLD_FRAMES:
        return _in_world(enu_from_ned(told), rate)
    if not mask & NO_VELOCITY and frame in BODY_FRAMES:
        return _in_body(np.array([told[0], -told[1], -told[2]]), rate)
    if not mask & IGNORE_POSITION and frame == LOCAL_NED:
        place = enu_from_ned([message.x, message.y, message.z]) + world_from_local_m
        wish = PathWish(place[None], speed_mps)
        return lambda _motion: wish
    raise InputError("wish", f"type mask {mask:#x} in frame {frame}: neither velocity nor place")


def of_sticks(message: Message, sticks: Sticks) -> WishMaker:
    """MANUAL_CONTROL: forward, right, throttle, yaw right; InputError for axes not in use."""
    axes = [int(message.x), int(message.y), int(message.z), int(message.r)]
    if max(abs(axis) for axis in axes) > STICK:
        raise InputError("wish", f"MANUAL_CONTROL {axes}: an axis beyond {STICK}")
    forward, right, throttle, yaw = axes
    velocity = np.array(
        [
            sticks.speed_mps * forward / STICK,
            -sticks.speed_mps * right / STICK,
            sticks.climb_mps * (throttle - MIDDLE) / MIDDLE if throttle >= 0 else 0.0,
        ]
    )
    return _in_body(velocity, -STICK_YAW_RPS * yaw / STICK)


def _in_world(velocity_mps: FloatArray, yaw_rate_rps: float) -> WishMaker:
    wish = VelocityWish(velocity_mps, yaw_rate_rps)
    return lambda _motion: wish


def _in_body(velocity_mps: FloatArray, yaw_rate_rps: float) -> WishMaker:
    VelocityWish(velocity_mps, yaw_rate_rps)  # Refused at once.

    def wish(motion: OwnMotion) -> Wish:
        turned = world_from_body([0.0, 0.0, motion.heading_rad])
        return VelocityWish(turned @ velocity_mps, yaw_rate_rps)

    return wish


def same_again(message: Message, boot_ms: int, system: int, component: int) -> Message:
    """A SET_POSITION_TARGET_LOCAL_NED as it came, for the autopilot."""
    return dialect().MAVLink_set_position_target_local_ned_message(
        boot_ms,
        system,
        component,
        message.coordinate_frame,
        message.type_mask,
        *[message.x, message.y, message.z],
        *[message.vx, message.vy, message.vz],
        *[message.afx, message.afy, message.afz],
        message.yaw,
        message.yaw_rate,
    )


def is_of_velocity(message: Message) -> bool:
    """Whether a SET_POSITION_TARGET_LOCAL_NED is flown without a place."""
    return bool(int(message.type_mask) & IGNORE_POSITION)


def encode_velocity(
    velocity_mps: FloatArray,
    yaw_rate_rps: float,
    boot_ms: int,
    system: int,
    component: int,
    acceleration_mps2: FloatArray | None = None,
) -> Message:
    """A velocity [3] of the world, without a place; and an acceleration [3] beside it."""
    faster = np.zeros(3) if acceleration_mps2 is None else acceleration_mps2
    return dialect().MAVLink_set_position_target_local_ned_message(
        boot_ms,
        system,
        component,
        LOCAL_NED,
        VELOCITY if acceleration_mps2 is None else WITHOUT_PLACE,
        *[0.0, 0.0, 0.0],
        *ned_from_enu(velocity_mps).tolist(),
        *ned_from_enu(faster).tolist(),
        0.0,
        -yaw_rate_rps,
    )
