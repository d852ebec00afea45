"""Set-points as SET_POSITION_TARGET_LOCAL_NED: position, velocity and acceleration on a plan, or a
place held."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray, attitude_ned_frd_from_enu, ned_from_enu
from clearway.live.link.set_point import SetPoint
from clearway.mavlink.dialect import Message, dialect

LOCAL_NED = 1
"""MAV_FRAME_LOCAL_NED."""
IGNORE_POSITION = 0x007
NO_ACCELERATION = 0x1C0
NO_YAW_RATE = 0x800
NO_VELOCITY = 0x038
FOLLOW = NO_ACCELERATION | NO_YAW_RATE
"""Type mask: position, velocity and yaw count."""
FOLLOW_WHOLLY = 0
"""Type mask: acceleration and yaw rate count too."""
HOLD = FOLLOW | NO_VELOCITY
"""Type mask: position and yaw count."""


def encode_set_point(
    set_point: SetPoint,
    world_from_local_m: FloatArray,
    boot_ms: int,
    system: int,
    component: int,
) -> Message:
    """The message for an autopilot; world_from_local_m: [3] its origin in the world frame."""
    place = ned_from_enu(set_point.position_m - world_from_local_m).tolist()
    mask = HOLD if set_point.velocity_mps is None else FOLLOW
    mask = mask if set_point.acceleration_mps2 is None else FOLLOW_WHOLLY
    faster = np.zeros(3) if set_point.acceleration_mps2 is None else set_point.acceleration_mps2
    velocity = ned_from_enu(
        np.zeros(3) if set_point.velocity_mps is None else set_point.velocity_mps
    )
    return dialect().MAVLink_set_position_target_local_ned_message(
        boot_ms,
        system,
        component,
        LOCAL_NED,
        mask,
        *place,
        *velocity.tolist(),
        *ned_from_enu(faster).tolist(),
        _heading(set_point),
        -set_point.yaw_rate_rps if mask == FOLLOW_WHOLLY else 0.0,
    )


def set_point_row(set_point: SetPoint, world_from_local_m: FloatArray) -> dict[str, object]:
    """For the log: the fields as sent, north, east, down."""
    velocity = None if set_point.velocity_mps is None else ned_from_enu(set_point.velocity_mps)
    faster = set_point.acceleration_mps2
    place = ned_from_enu(set_point.position_m - world_from_local_m)
    told = {} if faster is None else {
        "acceleration_ned_mps2": [round(v, 3) for v in ned_from_enu(faster).tolist()]
    }  # fmt: skip
    return {
        "position_ned_m": [round(float(v), 3) for v in place],
        "velocity_ned_mps": None if velocity is None else [round(v, 3) for v in velocity],
        "yaw_ned_rad": round(_heading(set_point), 4),
        **told,
    }


def _heading(set_point: SetPoint) -> float:
    """Clockwise from north."""
    return float(attitude_ned_frd_from_enu([0.0, 0.0, set_point.yaw_rad])[2])
