"""What the autopilot's heartbeat says of its mode: whether it flies by set-points from outside."""

from __future__ import annotations

from dataclasses import dataclass

from clearway.mavlink.dialect import Message

ARDUPILOT, PX4 = 3, 12
"""MAV_AUTOPILOT."""
ARMED, GUIDED_ENABLED = 128, 8
"""MAV_MODE_FLAG."""
PX4_OFFBOARD = 6
"""Main mode, in bits 16 to 23 of the custom mode."""
COPTERS = (2, 3, 4, 13, 14, 15, 29, 35)
"""MAV_TYPE of what ArduPilot flies as a copter. Its planes take no set-points in the local frame,
and its rovers leave out the velocity in them."""
COPTER_GUIDED = 4
"""Custom mode of ArduCopter."""


@dataclass(frozen=True, slots=True)
class AutopilotMode:
    """The mode as far as it concerns us."""

    armed: bool
    follows: bool
    """Whether set-points are followed: GUIDED of ArduCopter, OFFBOARD of PX4."""

    @classmethod
    def of(cls, heartbeat: Message) -> AutopilotMode:
        base, custom = int(heartbeat.base_mode), int(heartbeat.custom_mode)
        if heartbeat.autopilot == PX4:
            follows = (custom >> 16) & 0xFF == PX4_OFFBOARD
        elif heartbeat.autopilot == ARDUPILOT:
            follows = heartbeat.type in COPTERS and custom == COPTER_GUIDED
        else:
            follows = bool(base & GUIDED_ENABLED)
        return cls(bool(base & ARMED), follows)

    def __str__(self) -> str:
        armed = "armed" if self.armed else "disarmed"
        return f"{armed}, {'follows' if self.follows else 'does not follow'} set-points"
