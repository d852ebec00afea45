"""Which messages are heard and told, by the names that parameters have for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from clearway.ros2.bus import Quality
from clearway.ros2.parameters import NodeParameters, SetPointParameters

TRAFFIC_KINDS = {
    "Aircraft": "clearway_msgs/msg/Aircraft",
    "TransponderReport": "px4_msgs/msg/TransponderReport",
    "ADSBVehicle": "mavros_msgs/msg/ADSBVehicle",
}
SET_POINT_KINDS = {
    "TrajectorySetpoint": "px4_msgs/msg/TrajectorySetpoint",
    "PositionTarget": "mavros_msgs/msg/PositionTarget",
    "Twist": "geometry_msgs/msg/Twist",
    "TwistStamped": "geometry_msgs/msg/TwistStamped",
    "Path": "nav_msgs/msg/Path",
}


def base_of(one: SetPointParameters, given: NodeParameters) -> str | None:
    """The frame of the body where a set-point is given in it, else None."""
    return given.base_frame if one.frame == "body" else None


@dataclass(frozen=True, slots=True)
class Heard:
    """A topic and what is done with its messages."""

    topic: str
    kind: str
    quality: Quality
    take: Callable[[Any, float, str], None]
    needed: bool = False
