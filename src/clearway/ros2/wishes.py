"""Messages of somebody who commands as wishes of a guardian."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray, enu_from_ned, world_from_body
from clearway.live.guard.guard_session import WishMaker
from clearway.live.guard.wish import PathWish, VelocityWish, Wish
from clearway.live.link.own_motion import OwnMotion
from clearway.ros2.parameters import NodeParameters

NO_VELOCITY = 0x038
NO_PLACE = 0x007
NO_YAW_RATE = 0x800
"""Bits of mavros_msgs/PositionTarget that leave it out."""
LOCAL_NED = 1
BODY_NED = 8
BODY_OFFSET_NED = 9
"""Its frames that are read; mavros turns them to z up itself."""
MOST_PLACES = 1000

PlaceOf = Callable[[Any], FloatArray | None]
"""A PoseStamped -> its place [3] in the map frame, or None."""


def wish_maker(
    message: Any, given: NodeParameters, speed_mps: float, place_of: PlaceOf
) -> WishMaker:
    """The wish of a message of the type `given.guard.type`; InputError for what is none.

    speed_mps: at which a path or a place is flown to.
    """
    kind = given.guard.type
    if kind == "Path":
        return _path(message, speed_mps, place_of)
    if kind == "PositionTarget":
        return _position_target(message, speed_mps)
    if kind == "TrajectorySetpoint":
        return _trajectory_set_point(message, speed_mps)
    in_body = given.guard.frame == "body"
    if kind == "TwistStamped":
        frame = message.header.frame_id.lstrip("/")
        if frame not in ("", given.base_frame.lstrip("/"), given.map_frame.lstrip("/")):
            raise InputError("wish", f"frame {frame!r} is neither the body's nor the map's")
        in_body = frame == given.base_frame.lstrip("/") if frame else in_body
        message = message.twist
    return _velocity(_three(message.linear), float(message.angular.z), in_body=in_body)


def _three(vector: Any) -> FloatArray:
    return np.array([vector.x, vector.y, vector.z], dtype=np.float64)


def _velocity(velocity_mps: FloatArray, yaw_rate_rps: float, *, in_body: bool) -> WishMaker:
    def wish(motion: OwnMotion) -> Wish:
        world = velocity_mps
        if in_body:
            world = world_from_body([0.0, 0.0, motion.heading_rad]) @ velocity_mps
        return VelocityWish(world, yaw_rate_rps)

    VelocityWish(velocity_mps, yaw_rate_rps)  # Refused at once.
    return wish


def _fix(wish: Wish) -> WishMaker:
    return lambda _motion: wish


def _path(message: Any, speed_mps: float, place_of: PlaceOf) -> WishMaker:
    if not 0 < len(message.poses) <= MOST_PLACES:
        raise InputError("wish", f"{len(message.poses)} places")
    places = [place_of(one) for one in message.poses]
    known = [place for place in places if place is not None]
    if len(known) < len(places):
        raise InputError("wish", "a place that nothing ties to the map frame")
    return _fix(PathWish(np.array(known), speed_mps))


def _position_target(message: Any, speed_mps: float) -> WishMaker:
    mask, frame = int(message.type_mask), int(message.coordinate_frame)
    rate = 0.0 if mask & NO_YAW_RATE else float(message.yaw_rate)
    if not mask & NO_VELOCITY and frame in (LOCAL_NED, BODY_NED, BODY_OFFSET_NED):
        return _velocity(_three(message.velocity), rate, in_body=frame != LOCAL_NED)
    if not mask & NO_PLACE and frame == LOCAL_NED:
        return _fix(PathWish(_three(message.position)[None], speed_mps))
    raise InputError("wish", f"type mask {mask:#x} in frame {frame} is neither velocity nor place")


def _trajectory_set_point(message: Any, speed_mps: float) -> WishMaker:
    velocity = np.asarray(message.velocity, dtype=np.float64)
    rate = -float(message.yawspeed) if np.isfinite(message.yawspeed) else 0.0
    if np.all(np.isfinite(velocity)):
        return _velocity(enu_from_ned(velocity), rate, in_body=False)
    place = enu_from_ned(np.asarray(message.position, dtype=np.float64))
    return _fix(PathWish(place[None], speed_mps))
