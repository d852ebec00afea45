"""Message types of ROS 2 by their definitions, and messages to and from CDR: no ROS is needed.

rosbags has the definitions of the usual packages; those of px4_msgs and mavros_msgs that are used
stand here, and our own.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from clearway.base.errors import MissingExtraError
from clearway.ros2.px4_definitions import PX4_DEFINITIONS

UINT8 = "uint8"
UINT16 = "uint16"
UINT32 = "uint32"
FLOAT32 = "float32"
FLOAT64 = "float64"

TRANSPONDER_REPORT = """
uint64 timestamp
uint32 icao_address
float64 lat
float64 lon
uint8 altitude_type
float32 altitude
float32 heading
float32 hor_velocity
float32 ver_velocity
char[9] callsign
uint8 emitter_type
uint8 tslc
uint16 flags
uint16 squawk
uint8[18] uas_id
"""
TRAJECTORY_SETPOINT = """
uint64 timestamp
float32[3] position
float32[3] velocity
float32[3] acceleration
float32[3] jerk
float32 yaw
float32 yawspeed
"""
POSITION_TARGET = """
std_msgs/Header header
uint8 coordinate_frame
uint16 type_mask
geometry_msgs/Point position
geometry_msgs/Vector3 velocity
geometry_msgs/Vector3 acceleration_or_force
float32 yaw
float32 yaw_rate
"""
ADSB_VEHICLE = """
std_msgs/Header header
uint32 icao_address
string callsign
float64 latitude
float64 longitude
float32 altitude
float32 heading
float32 hor_velocity
float32 ver_velocity
uint8 altitude_type
uint8 emitter_type
builtin_interfaces/Duration tslc
uint16 flags
uint16 squawk
"""
AIRCRAFT = """
std_msgs/Header header
uint32 address
geometry_msgs/Point position
geometry_msgs/Vector3 velocity
float32 radius
"""
ADDED = {
    "clearway_msgs/msg/Aircraft": AIRCRAFT,
    "px4_msgs/msg/TransponderReport": TRANSPONDER_REPORT,
    "px4_msgs/msg/TrajectorySetpoint": TRAJECTORY_SETPOINT,
    "mavros_msgs/msg/PositionTarget": POSITION_TARGET,
    "mavros_msgs/msg/ADSBVehicle": ADSB_VEHICLE,
    **PX4_DEFINITIONS,
}


@cache
def message_types() -> Any:
    """The store of all types."""
    try:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    except ImportError as cause:
        raise MissingExtraError("ROS 2", "ros2") from cause
    types = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in ADDED.items():
        types.register(get_types_from_msg(text, name))
    return types


def make_message(kind_name: str, /, **fields: Any) -> Any:
    """A message with some fields set; all others are zero, empty or false."""
    maker, kinds = _parts(kind_name)
    assert fields.keys() <= kinds.keys(), f"{kind_name} has no {fields.keys() - kinds.keys()}"
    return maker(*[fields[n] if n in fields else _empty(kind) for n, kind in kinds.items()])


@cache
def _parts(kind_name: str) -> tuple[Any, dict[str, Any]]:
    """What makes a message of its values, and its fields with their kinds."""
    types = message_types()
    return types.types[kind_name], dict(types.FIELDDEFS[kind_name][1])


def _empty(kind: tuple[Any, Any]) -> Any:
    """The value of a field that nobody set."""
    node, inner = int(kind[0]), kind[1]
    if node == 1:  # BASE
        return {"string": "", "bool": False}.get(inner[0], 0.0 if "float" in inner[0] else 0)
    if node == 2:  # NAME
        return make_message(inner)
    base, length = inner
    if int(base[0]) == 1 and base[1][0] not in ("string", "bool"):
        return np.zeros(length if node == 3 else 0, dtype=_dtype(base[1][0]))
    return [_empty(base) for _ in range(length if node == 3 else 0)]


def _dtype(name: str) -> str:
    return {"octet": "uint8", "char": "uint8", "byte": "uint8"}.get(name, name)


def pack_message(message: Any) -> bytes:
    """The message in CDR, with its head."""
    return bytes(message_types().serialize_cdr(message, message.__msgtype__))


def unpack_cdr(raw: bytes, name: str) -> Any:
    """The message of CDR bytes; raises what `damages` names where they are none."""
    return message_types().deserialize_cdr(raw, name)


@cache
def damages() -> tuple[type[Exception], ...]:
    """What comes of bytes that are no message."""
    import struct

    from rosbags.serde import SerdeError

    return (SerdeError, struct.error, ValueError, IndexError, UnicodeDecodeError, MemoryError,
            OverflowError, AssertionError, TypeError)  # fmt: skip
