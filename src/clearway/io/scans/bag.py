"""A robot recording as one value, whichever way it is stored, and the types of its messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

METADATA = "metadata.yaml"
VELODYNE_PACKET = "builtin_interfaces/Time stamp\nuint8[1206] data"
VELODYNE_SCAN = "std_msgs/Header header\nvelodyne_msgs/VelodynePacket[] packets"
READ = (
    "builtin_interfaces/",
    "std_msgs/msg/Header",
    "geometry_msgs/",
    "nav_msgs/msg/Odometry",
    "sensor_msgs/msg/Point",
    "tf2_msgs/",
)
"""Beginnings of the names of the messages that are read, and of those within them."""
NANOSECOND_S = 1e-9


class Topic(NamedTuple):
    """A topic of a recording; types in ROS 2's form, `sensor_msgs/msg/PointCloud2`."""

    name: str
    type: str
    messages: int


class RawMessage(NamedTuple):
    """One message as it was recorded."""

    topic: str
    type: str
    logged_s: float
    """When it was recorded."""
    raw: bytes
    ros2: bool
    """Whether `raw` is CDR, and not ROS 1's serialisation."""
    damage: str = ""
    """Why it could not be read: `raw` is empty then."""
    value: Any = None
    """As it was decoded where it was read, in plain values; or the InputError of that."""


@dataclass(frozen=True, slots=True, eq=False)
class Bag:
    """An open recording."""

    kind: str
    topics: tuple[Topic, ...]
    messages: Callable[[Sequence[str]], Iterator[RawMessage]]
    """Those of some topics, in the order of recording."""
    decoded: Callable[[RawMessage], Any]


@cache
def library_complaints() -> tuple[type[Exception], ...]:
    """What rosbags, mcap and zstandard raise besides Python's own errors."""
    from mcap.exceptions import McapError
    from rosbags.highlevel import AnyReaderError
    from rosbags.rosbag1 import ReaderError as ReaderError1
    from rosbags.rosbag2 import ReaderError as ReaderError2
    from rosbags.serde import SerdeError
    from rosbags.typesys import TypesysError
    from zstandard import ZstdError

    return (
        AnyReaderError,
        ReaderError1,
        ReaderError2,
        SerdeError,
        TypesysError,
        McapError,
        ZstdError,
    )


@cache
def ros2_types() -> Any:
    """For bags without definitions: those messages of ROS 2 that are read, and Velodyne's.

    Only those: rosbags registers them anew for every bag, and all of them take 50 ms.
    """
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    every, types = get_typestore(Stores.ROS2_HUMBLE).FIELDDEFS, get_typestore(Stores.EMPTY)
    types.register({name: every[name] for name in every if name.startswith(READ)})
    types.register(get_types_from_msg(VELODYNE_PACKET, "velodyne_msgs/msg/VelodynePacket"))
    types.register(get_types_from_msg(VELODYNE_SCAN, "velodyne_msgs/msg/VelodyneScan"))
    return types


def types_of(schema: Any) -> Any:
    """A store with the message that an MCAP schema (`name`, `encoding`, `data`) defines."""
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    types = get_typestore(Stores.EMPTY)
    text, name = schema.data.decode(), ros2_name(schema.name)
    if schema.encoding == "ros2idl":
        types.register(get_types_from_idl(text))
    elif schema.encoding in ("ros1msg", "ros2msg"):
        types.register(get_types_from_msg(text, name))
    else:
        raise ValueError(f"schema encoding {schema.encoding!r}; valid: ros1msg, ros2msg, ros2idl")
    return types


def ros2_name(name: str) -> str:
    package, slash, rest = name.partition("/")
    return f"{package}/msg/{rest}" if slash and "/" not in rest else name


def merge_topics(topics: Iterator[Topic]) -> tuple[Topic, ...]:
    """One entry a topic, by name, messages of all its connections added up."""
    found: dict[str, Topic] = {}
    for topic in topics:
        before = found.get(topic.name)
        count = topic.messages + (before.messages if before else 0)
        found[topic.name] = topic._replace(messages=count)
    return tuple(found[name] for name in sorted(found))
