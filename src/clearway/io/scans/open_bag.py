"""Robot recordings: ROS 1 bags, ROS 2 bags and MCAP files, as topics and serialised messages.

rosbags reads the bags and decodes the messages, mcap the MCAP files. Both unpack and make whatever
a file says, so that they do it in another process.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import fields, is_dataclass
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from clearway.base.errors import InputError, MissingExtraError
from clearway.io.apart import apart, items_apart
from clearway.io.foreign_errors import damage_told
from clearway.io.scans.bag import (
    NANOSECOND_S,
    Bag,
    RawMessage,
    Topic,
    library_complaints,
    merge_topics,
)
from clearway.io.scans.bag_files import open_files, plain_files
from clearway.io.scans.bag_mcap import open_mcap
from clearway.io.scans.lost_chunks import Lost, read_bag1_messages
from clearway.io.what_file import require_file

LIBRARIES = ("mcap", "rosbags")
LOADED_APART = (
    "lz4.frame",
    "mcap.reader",
    "rosbags.highlevel",
    "rosbags.typesys.stores.ros2_galactic",
    "rosbags.typesys.stores.ros2_humble",
    "zstandard",
)


@contextmanager
def open_bag(path: Path, *, decoded: bool = True) -> Iterator[Bag]:
    """Open a .bag, the folder or a file of a ROS 2 bag, with or without metadata, or an .mcap;
    those of ROS 2 packed by zstd or not.

    It is read in a process of its own, by `io.apart`, so that no file takes all memory, or time
    without end. decoded: whether `Bag.decoded` will be asked for. Raises MissingExtraError without
    the packages of [lidar], InputError where it is damaged or not there.
    """
    require_file(path)
    if any(find_spec(name) is None for name in LIBRARIES):
        raise MissingExtraError(f"reading {path}", "lidar")
    with ExitStack() as stack:
        files = () if _is_alone(path) else tuple(plain_files(path, stack))
        size = sum(one.stat().st_size for one in files or (path,))
        kind, topics = apart(path, "recording", _contents, path, files, size=size)

        def messages(names: Sequence[str]) -> Iterator[RawMessage]:
            asked = (path, files, tuple(names), decoded)
            return items_apart(path, kind, _messages, *asked, size=size)

        yield Bag(kind, topics, messages, _value)


def _is_alone(path: Path) -> bool:
    """Whether a file is a whole recording, and none of the files of a ROS 2 bag."""
    return path.suffix.lower() in (".bag", ".mcap") and not path.is_dir()


def _value(message: RawMessage) -> Any:
    if isinstance(message.value, Exception):
        raise message.value
    return message.value


def _contents(path: Path, files: tuple[Path, ...]) -> tuple[str, tuple[Topic, ...]]:
    """Kind and topics of a recording; in the other process."""
    with _open(path, files) as bag:
        return bag.kind, bag.topics


def _messages(
    path: Path, files: tuple[Path, ...], names: tuple[str, ...], decoded: bool
) -> Iterator[RawMessage]:
    """Messages of some topics with their values; in the other process."""
    with _open(path, files) as bag:
        for message in bag.messages(names):
            has_value = decoded and not message.damage
            yield message._replace(value=_decode(bag, message)) if has_value else message


def _decode(bag: Bag, message: RawMessage) -> Any:
    try:
        return _plain(bag.decoded(message))
    except InputError as error:
        return error


def _plain(value: Any) -> Any:
    """A message without the class that was made for its type, which nobody else knows."""
    if is_dataclass(value):
        return SimpleNamespace(
            **{one.name: _plain(getattr(value, one.name)) for one in fields(value)}
        )
    return [_plain(one) for one in value] if isinstance(value, list) else value


@contextmanager
def _open(path: Path, files: tuple[Path, ...]) -> Iterator[Bag]:
    """A recording; files: those of a ROS 2 bag, unpacked."""
    try:  # They may be there, and not load.
        import mcap.reader  # noqa: F401
        import rosbags.highlevel  # noqa: F401
    except ImportError as cause:
        raise MissingExtraError(f"reading {path}", "lidar") from cause
    if files:
        opened = open_files(path, files)
    else:
        opened = (open_mcap if path.suffix.lower() == ".mcap" else _open_bag1)(path)
    with opened as bag:
        yield bag


@contextmanager
def _open_bag1(path: Path) -> Iterator[Bag]:
    from rosbags.highlevel import AnyReader

    kind, own = "ROS 1 bag", library_complaints()
    with ExitStack() as stack:
        with damage_told(path, kind, own):
            reader = AnyReader([path])
            stack.callback(_close, reader)  # its own way out leaves files open after a failure
            reader.open()
            topics = merge_topics(Topic(c.topic, c.msgtype, c.msgcount) for c in reader.connections)

        def messages(names: Sequence[str]) -> Iterator[RawMessage]:
            wanted = [c for c in reader.connections if c.topic in names]
            promised, found = sum(c.msgcount for c in wanted), 0
            with damage_told(path, kind, own):
                for one in read_bag1_messages(reader.readers[0], wanted):
                    found += 1
                    connection, logged_ns, raw = one
                    lost = isinstance(one, Lost)
                    yield RawMessage(
                        connection.topic,
                        connection.msgtype,
                        logged_ns * NANOSECOND_S,
                        b"" if lost else bytes(raw),
                        ros2=False,
                        damage=one.why if lost else "",
                    )
            if found < promised:
                raise InputError(
                    str(path), f"truncated: {promised} messages promised, {found} found"
                )

        def decode_message(message: RawMessage) -> Any:
            with damage_told(path, f"message of {message.topic} ({message.type})", own):
                return reader.deserialize(message.raw, message.type)

        yield Bag(kind, topics, messages, decode_message)


def _close(reader: Any) -> None:
    for one in reader.readers:
        with suppress(AssertionError, *library_complaints()):
            one.close()
