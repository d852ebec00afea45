"""Somebody who commands a simulated vehicle straight at a place, to try `clearway guard` on."""

from __future__ import annotations

import math

import numpy as np

from clearway.base.frames import FloatArray, ned_from_enu, world_from_body, wrap_angle
from clearway.mavlink.dialect import Message, dialect
from clearway.mavlink.links import FrameLink
from clearway.mavlink.outbox import Packer
from clearway.mavlink.set_points import LOCAL_NED
from clearway.mavlink.simulated_vehicle import VehicleTruth
from clearway.mavlink.wishes import MIDDLE, STICK, STICK_YAW_RPS, VELOCITY

# As ground stations have them.
SYSTEM = 255
COMPONENT = 190
SLOWS_M = 1.0
"""From the place, from where on it wants to fly slower."""


class SimulatedPilot:
    """Sends a command for every moment, whatever is in the way.

    sticks: as MANUAL_CONTROL instead of velocities. speed_mps: at full stick.
    """

    def __init__(
        self,
        link: FrameLink,
        key: bytes | None,
        goal_m: FloatArray,
        speed_mps: float,
        *,
        sticks: bool,
    ) -> None:
        self._link, self._goal_m, self._speed_mps = link, goal_m, speed_mps
        self._sticks = sticks
        self._packer = Packer(SYSTEM, COMPONENT, key)

    def command(self, truth: VehicleTruth, boot_ms: int) -> None:
        """Send what it wants now."""
        way = self._goal_m - truth.position_m
        far = float(np.linalg.norm(way))
        velocity = way * (self._speed_mps / max(far, SLOWS_M))
        message = (
            self._steer_by_sticks(velocity, truth) if self._sticks else _velocity(velocity, boot_ms)
        )
        self._link.send(self._packer.pack(message))

    def _steer_by_sticks(self, velocity_mps: FloatArray, truth: VehicleTruth) -> Message:
        """MANUAL_CONTROL: the nose is turned to where it goes."""
        own = velocity_mps @ world_from_body([0.0, 0.0, truth.yaw_rad])
        aside = math.atan2(velocity_mps[1], velocity_mps[0])
        turn = float(wrap_angle(aside - truth.yaw_rad)) / STICK_YAW_RPS
        shares = np.clip([*(own[:2] / self._speed_mps), turn], -1.0, 1.0)
        forward, left, yaw = (round(STICK * float(share)) for share in shares)
        return dialect().MAVLink_manual_control_message(1, forward, -left, MIDDLE, -yaw, 0)

    def close(self) -> None:
        self._link.close()


def _velocity(velocity_mps: FloatArray, boot_ms: int) -> Message:
    zeros = [0.0, 0.0, 0.0]
    return dialect().MAVLink_set_position_target_local_ned_message(
        boot_ms, 1, 1, LOCAL_NED, VELOCITY, *zeros, *ned_from_enu(velocity_mps).tolist(), *zeros,
        0.0, 0.0,
    )  # fmt: skip
