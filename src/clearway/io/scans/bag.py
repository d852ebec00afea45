"""Robot recordings: ROS 1 bags, ROS 2 bags and MCAP files, as topics and serialised messages.

rosbags reads the bags and decodes the messages, mcap the MCAP files. Only what is asked for is
decoded, and only when it is asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from clearway.base.errors import InputError, MissingExtraError
from clearway.io.foreign_errors import damage_told

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


@dataclass(frozen=True, slots=True, eq=False)
class Bag:
    """An open recording."""

    kind: str
    topics: tuple[Topic, ...]
    messages: Callable[[Sequence[str]], Iterator[RawMessage]]
    """Those of some topics, in the order of recording."""
    decoded: Callable[[RawMessage], Any]


@contextmanager
def open_bag(path: Path) -> Iterator[Bag]:
    """Open a .bag, the folder or .db3 of a ROS 2 bag, with or without metadata, or an .mcap.

    Raises MissingExtraError without the packages of [lidar], InputError where it is damaged.
    """
    try:
        import mcap.reader  # noqa: F401
        import rosbags.highlevel  # noqa: F401
    except ImportError as cause:
        raise MissingExtraError(f"reading {path}", "lidar") from cause
    from clearway.io.scans.bag_files import open_files, without_metadata
    from clearway.io.scans.bag_mcap import open_mcap

    opened = open_files if without_metadata(path) else _open_rosbag
    with (open_mcap if path.suffix.lower() == ".mcap" else opened)(path) as bag:
        yield bag


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


@contextmanager
def _open_rosbag(path: Path) -> Iterator[Bag]:
    from rosbags.highlevel import AnyReader

    is_ros1 = path.suffix.lower() == ".bag" and not path.is_dir()
    kind = "ROS 1 bag" if is_ros1 else "ROS 2 bag"
    place = path if is_ros1 or path.is_dir() else path.parent
    own = library_complaints()
    with ExitStack() as stack:
        with damage_told(path, kind, own):
            reader = AnyReader([place], default_typestore=ros2_types())
            stack.callback(_close, reader)  # its own way out leaves files open after a failure
            reader.open()
            topics = merged(Topic(c.topic, c.msgtype, c.msgcount) for c in reader.connections)

        def messages(names: Sequence[str]) -> Iterator[RawMessage]:
            wanted = [c for c in reader.connections if c.topic in names]
            promised, found = sum(c.msgcount for c in wanted), 0
            with damage_told(path, kind, own):
                for connection, logged_ns, raw in reader.messages(wanted) if wanted else ():
                    found += 1
                    yield RawMessage(
                        connection.topic,
                        connection.msgtype,
                        logged_ns * NANOSECOND_S,
                        bytes(raw),
                        not is_ros1,
                    )
            if found < promised:
                raise InputError(
                    str(path), f"truncated: {promised} messages promised, {found} found"
                )

        def decoded(message: RawMessage) -> Any:
            with damage_told(path, f"message of {message.topic} ({message.type})", own):
                return reader.deserialize(message.raw, message.type)

        yield Bag(kind, topics, messages, decoded)


def _close(reader: Any) -> None:
    for one in reader.readers:
        with suppress(AssertionError, *library_complaints()):
            one.close()


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


def merged(topics: Iterator[Topic]) -> tuple[Topic, ...]:
    """One entry a topic, by name, messages of all its connections added up."""
    found: dict[str, Topic] = {}
    for topic in topics:
        before = found.get(topic.name)
        count = topic.messages + (before.messages if before else 0)
        found[topic.name] = topic._replace(messages=count)
    return tuple(found[name] for name in sorted(found))
