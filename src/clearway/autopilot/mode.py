"""What the autopilot's heartbeat says of its mode: whether it flies by set-points from outside."""

from __future__ import annotations

from dataclasses import dataclass

from clearway.autopilot.dialect import Message

ARDUPILOT, PX4 = 3, 12
"""MAV_AUTOPILOT."""
ARMED, GUIDED_ENABLED = 128, 8
"""MAV_MODE_FLAG."""
PX4_OFFBOARD = 6
"""Main mode, in bits 16 to 23 of the custom mode."""
PLANES, ROVERS = (1, 19, 20, 21, 22, 23, 24, 25), (10, 11)
"""MAV_TYPE of what ArduPilot flies as a plane (quadplanes too) or drives as a rover."""
COPTER_GUIDED, PLANE_GUIDED = 4, 15
"""Custom modes of ArduPilot; a rover's is the plane's, a submarine's the copter's."""


@dataclass(frozen=True, slots=True)
class AutopilotMode:
    """The mode as far as it concerns us."""

    armed: bool
    follows: bool
    """Whether set-points are followed: GUIDED of ArduPilot, OFFBOARD of PX4."""

    @classmethod
    def of(cls, heartbeat: Message) -> AutopilotMode:
        base, custom = int(heartbeat.base_mode), int(heartbeat.custom_mode)
        if heartbeat.autopilot == PX4:
            follows = (custom >> 16) & 0xFF == PX4_OFFBOARD
        elif heartbeat.autopilot == ARDUPILOT:
            is_plane = heartbeat.type in (*PLANES, *ROVERS)
            follows = custom == (PLANE_GUIDED if is_plane else COPTER_GUIDED)
        else:
            follows = bool(base & GUIDED_ENABLED)
        return cls(bool(base & ARMED), follows)

    def __str__(self) -> str:
        armed = "armed" if self.armed else "disarmed"
        return f"{armed}, {'follows' if self.follows else 'does not follow'} set-points"
