"""The codec: pymavlink's tables of messages, brought by the extra [mavlink]."""

from __future__ import annotations

from binascii import crc_hqx
from functools import lru_cache
from importlib import import_module
from typing import Any

from clearway.base.errors import MissingExtraError

HEARTBEAT = 0
SYS_STATUS = 1
GPS_RAW_INT = 24
ATTITUDE = 30
LOCAL_POSITION_NED = 32
GLOBAL_POSITION_INT = 33
GPS_GLOBAL_ORIGIN = 49
LOCAL_POSITION_NED_COV = 64
EKF_STATUS_REPORT = 193
ESTIMATOR_STATUS = 230
HOME_POSITION = 242
ADSB_VEHICLE = 246
OBSTACLE_DISTANCE = 330
ODOMETRY = 331
PARAM_VALUE = 22
MISSION_COUNT = 44
MISSION_ITEM_INT = 73
MISSION_ACK = 47
COMMAND_INT = 75
COMMAND_LONG = 76
COMMAND_ACK = 77
POSITION_TARGET_LOCAL_NED = 85
SET_POSITION_TARGET_LOCAL_NED = 84
SET_POSITION_TARGET_GLOBAL_INT = 86
MANUAL_CONTROL = 69
TIMESYNC = 111
DISTANCE_SENSOR = 132
EXTENDED_SYS_STATE = 245
OBSTACLE_DISTANCE_3D = 11037
OPEN_DRONE_ID_LOCATION = 12901

OBSTACLE_AVOIDANCE = 196
"""MAV_COMP_ID_OBSTACLE_AVOIDANCE: our component in the vehicle's system."""

Message = Any
"""A decoded message; pymavlink has no types for them."""


@lru_cache(maxsize=1)
def dialect() -> Any:
    """The module of MAVLink 2 with ArduPilot's messages; MissingExtraError without pymavlink."""
    try:
        return import_module("pymavlink.dialects.v20.ardupilotmega")
    except ImportError as cause:
        raise MissingExtraError("a MAVLink link", "mavlink") from cause


REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
"""Each byte with its bits in reverse order."""


def compute_mavlink_crc(data: bytes) -> int:
    """CRC-16/MCRF4XX of header and payload with the extra byte of the message behind them.

    It is Python's own CRC-CCITT with the bits of every byte, and of the result, reversed: a tenth
    of the time of pymavlink's, which matters in a flood.
    """
    found = crc_hqx(data.translate(REVERSED), 0xFFFF)
    return REVERSED[found & 0xFF] << 8 | REVERSED[found >> 8]
