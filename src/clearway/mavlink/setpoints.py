"""Set-points in the local frame, SET_POSITION_TARGET_LOCAL_NED: follow a plan, or hold a place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import (
    FloatArray,
    attitude_ned_frd_from_enu,
    ned_from_enu,
    world_from_body,
)
from clearway.mavlink.dialect import Message, dialect

LOCAL_NED = 1
"""MAV_FRAME_LOCAL_NED."""
NO_ACCELERATION, NO_YAW_RATE, NO_VELOCITY = 0x1C0, 0x800, 0x038
FOLLOW = NO_ACCELERATION | NO_YAW_RATE
"""Type mask: position, velocity and yaw count."""
HOLD = FOLLOW | NO_VELOCITY
"""Type mask: position and yaw count."""


@dataclass(frozen=True, slots=True, eq=False)
class SetPoint:
    """Where to be, how fast, and where to point; the autopilot's local frame, z up."""

    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray | None
    """[3] None holds the place."""
    yaw_rad: float
    """Left positive from x, here east."""

    @classmethod
    def following(
        cls,
        state: FloatArray,
        speed_mps: float,
        world_from_local_m: FloatArray,
        *,
        climb_mps: float = 0.0,
    ) -> SetPoint:
        """On a plan that has the vehicle in a state [6] of the world frame.

        climb_mps: beside the speed along the nose, of what climbs without pitching.
        """
        velocity = speed_mps * world_from_body(np.ascontiguousarray(state[3:]))[:, 0]
        velocity[2] += climb_mps
        return cls(state[:3] - world_from_local_m, velocity, float(state[5]))

    @classmethod
    def holding(
        cls, place_m: FloatArray, yaw_rad: float, world_from_local_m: FloatArray
    ) -> SetPoint:
        return cls(place_m - world_from_local_m, None, yaw_rad)

    def row(self) -> dict[str, object]:
        """For the log: the fields as sent, north, east, down."""
        velocity = None if self.velocity_mps is None else ned_from_enu(self.velocity_mps)
        return {
            "position_ned_m": [round(float(v), 3) for v in ned_from_enu(self.position_m)],
            "velocity_ned_mps": None if velocity is None else [round(v, 3) for v in velocity],
            "yaw_ned_rad": round(self._heading(), 4),
        }

    def message(self, boot_ms: int, system: int, component: int) -> Message:
        """The message for an autopilot."""
        place = ned_from_enu(self.position_m).tolist()
        moving = self.velocity_mps is not None
        velocity = ned_from_enu(np.zeros(3) if self.velocity_mps is None else self.velocity_mps)
        return dialect().MAVLink_set_position_target_local_ned_message(
            boot_ms,
            system,
            component,
            LOCAL_NED,
            FOLLOW if moving else HOLD,
            *place,
            *velocity.tolist(),
            *[0.0, 0.0, 0.0],
            self._heading(),
            0.0,
        )

    def _heading(self) -> float:
        """Clockwise from north."""
        return float(attitude_ned_frd_from_enu([0.0, 0.0, self.yaw_rad])[2])
