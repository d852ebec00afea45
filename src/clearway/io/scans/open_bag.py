"""Robot recordings: ROS 1 bags, ROS 2 bags and MCAP files, as topics and serialised messages.

rosbags reads the bags and decodes the messages, mcap the MCAP files. Only what is asked for is
decoded, and only when it is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from clearway.base.errors import InputError, MissingExtraError
from clearway.io.foreign_errors import damage_told
from clearway.io.scans.bag import (
    NANOSECOND_S,
    Bag,
    RawMessage,
    Topic,
    library_complaints,
    merged,
)
from clearway.io.scans.bag_files import open_files
from clearway.io.scans.bag_mcap import open_mcap
from clearway.io.scans.lost_chunks import Lost, read_bag1_messages
from clearway.io.what_file import require_file


@contextmanager
def open_bag(path: Path) -> Iterator[Bag]:
    """Open a .bag, the folder or a file of a ROS 2 bag, with or without metadata, or an .mcap;
    those of ROS 2 packed by zstd or not.

    Raises MissingExtraError without the packages of [lidar], InputError where it is damaged or not
    there.
    """
    require_file(path)
    try:
        import mcap.reader  # noqa: F401
        import rosbags.highlevel  # noqa: F401
    except ImportError as cause:
        raise MissingExtraError(f"reading {path}", "lidar") from cause
    suffix = "" if path.is_dir() else path.suffix.lower()
    opened = {".mcap": open_mcap, ".bag": _open_bag1}.get(suffix, open_files)
    with opened(path) as bag:
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
            topics = merged(Topic(c.topic, c.msgtype, c.msgcount) for c in reader.connections)

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

        def decoded(message: RawMessage) -> Any:
            with damage_told(path, f"message of {message.topic} ({message.type})", own):
                return reader.deserialize(message.raw, message.type)

        yield Bag(kind, topics, messages, decoded)


def _close(reader: Any) -> None:
    for one in reader.readers:
        with suppress(AssertionError, *library_complaints()):
            one.close()
