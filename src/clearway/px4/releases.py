"""Releases of PX4: which version of each message they speak, and on which topics.

PX4 ends a topic's name with the version of its message, but for version 0.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from clearway.ros2.messages import ADDED

TOPICS: Final = {
    "RegisterExtComponentRequest": "in/register_ext_component_request",
    "RegisterExtComponentReply": "out/register_ext_component_reply",
    "UnregisterExtComponent": "in/unregister_ext_component",
    "ArmingCheckRequest": "out/arming_check_request",
    "ArmingCheckReply": "in/arming_check_reply",
    "ModeCompleted": "in/mode_completed",
    "VehicleStatus": "out/vehicle_status",
    "VehicleLandDetected": "out/vehicle_land_detected",
    "VehicleLocalPosition": "out/vehicle_local_position",
    "VehicleOdometry": "out/vehicle_odometry",
    "HomePosition": "out/home_position",
    "VehicleCommand": "in/vehicle_command",
    "TrajectorySetpoint": "in/trajectory_setpoint",
    "VehicleControlMode": "in/config_control_setpoints",
    "SetpointConfig": "in/setpoint_config",
    "SetpointConfigReply": "out/setpoint_config_reply",
    "MessageFormatRequest": "in/message_format_request",
    "MessageFormatResponse": "out/message_format_response",
}
"""Messages by name, and their topics within /fmu, without the version."""
UNCHECKED = (
    "MessageFormatRequest",
    "MessageFormatResponse",
    "SetpointConfig",
    "SetpointConfigReply",
)
"""Of which PX4 is not asked for the format: by the first two it is asked, and of the others no
release is known to answer."""
FNV_START = 0x811C9DC5
FNV_PRIME = 0x1000193


@dataclass(frozen=True, slots=True)
class Release:
    """How one release of PX4 names and versions what we exchange with it."""

    name: str
    api: int
    """Version of the meaning of external modes, which both ends must share."""
    versions: Mapping[str, int] = field(default_factory=dict)
    """Of messages, where not 0."""
    configures: bool = False
    """Whether a mode states its set-points, and their time-out, by SetpointConfig."""

    @property
    def messages(self) -> tuple[str, ...]:
        """Names of all messages that are exchanged."""
        configured = ("SetpointConfig", "SetpointConfigReply")
        dropped = ("VehicleControlMode",) if self.configures else configured
        return tuple(name for name in TOPICS if name not in dropped)

    @property
    def checked(self) -> dict[str, str]:
        """Messages whose format PX4 is asked for, by the name of the topic that it knows."""
        return {f"fmu/{TOPICS[m]}": m for m in self.messages if m not in UNCHECKED}

    def topic(self, message: str) -> str:
        """The topic of a message, from /fmu on."""
        version = self.versions.get(message, 0)
        return f"/fmu/{TOPICS[message]}" + (f"_v{version}" if version else "")

    def kind(self, message: str) -> str:
        """The definition of a message: that of its version, or of an older one with its fields."""
        plain = f"px4_msgs/msg/{message}"
        version = self.versions.get(message, 0)
        names = (f"{plain}V{number}" for number in range(version, 0, -1))
        return next((name for name in names if name in ADDED), plain)


_OF_1_16 = {"VehicleStatus": 1}
_OF_1_17 = _OF_1_16 | {
    "ArmingCheckRequest": 1, "ArmingCheckReply": 1, "VehicleLocalPosition": 1, "HomePosition": 1,
}  # fmt: skip
_OF_1_18 = _OF_1_17 | {
    "RegisterExtComponentRequest": 2, "RegisterExtComponentReply": 1, "VehicleStatus": 4,
}  # fmt: skip
RELEASES: Final = {
    release.name: release
    for release in (
        Release("1.16", 1, _OF_1_16),
        Release("1.17", 1, _OF_1_17),
        Release("1.18", 2, _OF_1_18, configures=True),
    )
}
_FIELD = re.compile(r"^(?:px4_msgs/)?(\w+)((?:\[[^\]]*\])?) (\w+)$", re.MULTILINE)


def format_hash(kind: str) -> int:
    """Return PX4's hash over the fields of a message, by which it tells its format."""
    value = FNV_START
    for character in _fields(kind):
        value = ((value ^ ord(character)) * FNV_PRIME) & 0xFFFFFFFF
    return value


def _fields(kind: str) -> str:
    told = []
    for base, length, name in _FIELD.findall(ADDED[kind]):
        told.append(f"{base}{length} {name}\n")
        nested = f"px4_msgs/msg/{base}"
        if nested in ADDED:
            told.append(_fields(nested))
    return "".join(told)
