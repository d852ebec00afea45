"""Numbers of Remote ID (ASTM F3411, as MAVLink's OPEN_DRONE_ID messages have them)."""

from __future__ import annotations

import zlib

UNKNOWN_DIRECTION = 36_100
UNKNOWN_SPEED = 25_500
UNKNOWN_CLIMB = 6_300
"""Hundredths of degrees, centimetres a second."""
UNKNOWN_ALTITUDE_M = -1_000.0
ACCURACY_M = {
    1: 18_520.0, 2: 7_408.0, 3: 3_704.0, 4: 1_852.0, 5: 926.0, 6: 555.6, 7: 185.2, 8: 92.6,
    9: 30.0, 10: 10.0, 11: 3.0, 12: 1.0,
}  # fmt: skip
"""MAV_ODID_HOR_ACC: bounds that hold in 95 of 100 cases; 0 is unknown."""
ANONYMOUS = 1 << 24
"""Beyond the addresses that states give out."""


def remote_address(identity: bytes) -> int:
    """A number for the sender of an identity, of 24 bits beside those given out by states."""
    return ANONYMOUS | zlib.crc32(bytes(identity).rstrip(b"\0")) & (ANONYMOUS - 1)


def is_own_message(identity: bytes) -> bool:
    """Whether a message is the vehicle's own, on its way to its sender: it names nobody."""
    return not any(identity)
