"""What the autopilot says of itself: whether its mode flies by set-points from outside, and whether
it is in the air."""

from __future__ import annotations

from clearway.live.link.status import VehicleStatus
from clearway.mavlink.dialect import Message

# MAV_AUTOPILOT.
ARDUPILOT = 3
PX4 = 12
# MAV_MODE_FLAG.
ARMED = 128
GUIDED_ENABLED = 8
PX4_OFFBOARD = 6
"""Main mode, in bits 16 to 23 of the custom mode."""
COPTERS = (2, 3, 4, 13, 14, 15, 29, 35)
"""MAV_TYPE of what ArduPilot flies as a copter. Its planes take no set-points in the local frame,
and its rovers leave out the velocity in them."""
COPTER_GUIDED = 4
"""Custom mode of ArduCopter."""
# MAV_LANDED_STATE: on the ground, taking off and landing are others.
UNDEFINED = 0
IN_AIR = 2


def status_of(heartbeat: Message, airborne: bool | None = None) -> VehicleStatus:
    """By its heartbeat: followed are GUIDED of ArduCopter and OFFBOARD of PX4."""
    base, custom = int(heartbeat.base_mode), int(heartbeat.custom_mode)
    if heartbeat.autopilot == PX4:
        follows = (custom >> 16) & 0xFF == PX4_OFFBOARD
    elif heartbeat.autopilot == ARDUPILOT:
        follows = heartbeat.type in COPTERS and custom == COPTER_GUIDED
    else:
        follows = bool(base & GUIDED_ENABLED)
    return VehicleStatus(bool(base & ARMED), follows, airborne)


def airborne_by(extended: Message) -> bool | None:
    """By EXTENDED_SYS_STATE; None where it does not know."""
    return None if extended.landed_state == UNDEFINED else bool(extended.landed_state == IN_AIR)
