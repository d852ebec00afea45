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

from clearway.errors import InputError, MissingExtraError
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
    """Open a .bag, the folder or .db3 of a ROS 2 bag, or an .mcap.

    Raises MissingExtraError without the packages of [lidar], InputError where it is damaged.
    """
    try:
        import mcap  # noqa: F401
        import rosbags  # noqa: F401
    except ImportError as cause:
        raise MissingExtraError(f"reading {path}", "lidar") from cause
    with _open_mcap(path) if path.suffix.lower() == ".mcap" else _open_rosbag(path) as bag:
        yield bag


def bag_folder(path: Path) -> Path:
    """The folder of a ROS 2 bag, given it or one of its files; InputError without metadata."""
    folder = path if path.is_dir() else path.parent
    if not (folder / METADATA).is_file():
        raise InputError(
            str(path),
            f"no {METADATA} {'in it' if path.is_dir() else 'beside it'}; valid: the folder of a "
            "ROS 2 bag, or a .db3 in it (`ros2 bag reindex` makes the file anew)",
        )
    return folder


@cache
def _complaints() -> tuple[type[Exception], ...]:
    """What the libraries raise besides Python's own errors."""
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
    place = path if is_ros1 else bag_folder(path)
    own = _complaints()
    with ExitStack() as stack:
        with damage_told(path, kind, own):
            reader = AnyReader([place], default_typestore=ros2_types())
            stack.callback(_close, reader)  # its own way out leaves files open after a failure
            reader.open()
            topics = _merged(Topic(c.topic, c.msgtype, c.msgcount) for c in reader.connections)

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
        with suppress(AssertionError, *_complaints()):
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


@contextmanager
def _open_mcap(path: Path) -> Iterator[Bag]:
    from mcap.reader import make_reader

    own = _complaints()
    with ExitStack() as stack:
        with damage_told(path, "MCAP file", own):
            file = stack.enter_context(path.open("rb"))
            reader = make_reader(file)
            topics = _mcap_topics(reader)
        definitions: dict[str, Any] = {}

        def messages(names: Sequence[str]) -> Iterator[RawMessage]:
            with damage_told(path, "MCAP file", own):
                for schema, channel, message in reader.iter_messages(list(names)):
                    if schema is not None:
                        definitions[_ros2_name(schema.name)] = schema
                        yield RawMessage(
                            channel.topic,
                            _ros2_name(schema.name),
                            message.log_time * NANOSECOND_S,
                            message.data,
                            channel.message_encoding != "ros1",
                        )

        stores: dict[str, Any] = {}

        def decoded(message: RawMessage) -> Any:
            with damage_told(path, f"message of {message.topic} ({message.type})", own):
                if message.type not in stores:
                    stores[message.type] = _types_of(definitions[message.type])
                types = stores[message.type]
                decode = types.deserialize_cdr if message.ros2 else types.deserialize_ros1
                return decode(message.raw, message.type)

        yield Bag("MCAP file", topics, messages, decoded)


def _mcap_topics(reader: Any) -> tuple[Topic, ...]:
    """From the summary, or by reading all of a file that has none."""
    summary = reader.get_summary()
    if summary is None or not summary.channels or summary.statistics is None:
        return _merged(
            Topic(channel.topic, _ros2_name(schema.name if schema else ""), 1)
            for schema, channel, _ in reader.iter_messages()
        )
    counts = summary.statistics.channel_message_counts
    names = {number: schema.name for number, schema in summary.schemas.items()}
    return _merged(
        Topic(one.topic, _ros2_name(names.get(one.schema_id, "")), counts.get(one.id, 0))
        for one in summary.channels.values()
    )


def _types_of(schema: Any) -> Any:
    """A store with the message that an MCAP schema defines."""
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    types = get_typestore(Stores.EMPTY)
    text, name = schema.data.decode(), _ros2_name(schema.name)
    if schema.encoding == "ros2idl":
        types.register(get_types_from_idl(text))
    elif schema.encoding in ("ros1msg", "ros2msg"):
        types.register(get_types_from_msg(text, name))
    else:
        raise ValueError(f"schema encoding {schema.encoding!r}; valid: ros1msg, ros2msg, ros2idl")
    return types


def _ros2_name(name: str) -> str:
    package, slash, rest = name.partition("/")
    return f"{package}/msg/{rest}" if slash and "/" not in rest else name


def _merged(topics: Iterator[Topic]) -> tuple[Topic, ...]:
    """One entry a topic, by name, messages of all its connections added up."""
    found: dict[str, Topic] = {}
    for topic in topics:
        before = found.get(topic.name)
        count = topic.messages + (before.messages if before else 0)
        found[topic.name] = topic._replace(messages=count)
    return tuple(found[name] for name in sorted(found))
