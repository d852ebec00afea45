"""MCAP files of ROS 1 and ROS 2 messages, with or without an index, through mcap."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from clearway.base.errors import InputError
from clearway.io.foreign_errors import damage_told
from clearway.io.scans.bag import (
    NANOSECOND_S,
    Bag,
    RawMessage,
    Topic,
    library_complaints,
    merge_topics,
    ros2_name,
    types_of,
)
from clearway.io.scans.lost_chunks import Lost, read_mcap_messages, try_unpack

MAGIC = b"\x89MCAP0\r\n"
"""At the start of a file, and at its end."""


@contextmanager
def open_mcap(path: Path) -> Iterator[Bag]:
    """Open an MCAP file; InputError where it is damaged, or does not end as one does."""
    from mcap.reader import make_reader

    own = library_complaints()
    with ExitStack() as stack:
        with damage_told(path, "MCAP file", own):
            file = stack.enter_context(path.open("rb"))
            _check_end(path, file)
            summary = make_reader(file, validate_crcs=True).get_summary()
            indexed = summary is not None and bool(summary.channels)
            topics = _topics(summary if indexed else None, path)
        definitions: dict[str, Any] = {}
        kinds = {topic.name: topic.type for topic in topics}

        def messages(names: Sequence[str]) -> Iterator[RawMessage]:
            with damage_told(path, "MCAP file", own), path.open("rb") as own_file:
                reader = _reader(own_file, indexed)
                for one in read_mcap_messages(reader, own_file, names):
                    if isinstance(one, Lost):
                        topic, is_ros2 = one.channel.topic, one.channel.message_encoding != "ros1"
                        logged_s = one.logged_ns * NANOSECOND_S
                        yield RawMessage(topic, kinds[topic], logged_s, b"", is_ros2, one.why)
                        continue
                    schema, channel, message = one
                    if schema is not None:
                        definitions[ros2_name(schema.name)] = schema
                        raw, damage = try_unpack(message.data)
                        yield RawMessage(
                            channel.topic,
                            ros2_name(schema.name),
                            message.log_time * NANOSECOND_S,
                            raw,
                            channel.message_encoding != "ros1",
                            damage,
                        )

        stores: dict[str, Any] = {}

        def decode_message(message: RawMessage) -> Any:
            with damage_told(path, f"message of {message.topic} ({message.type})", own):
                if message.type not in stores:
                    stores[message.type] = types_of(definitions[message.type])
                types = stores[message.type]
                decode = types.deserialize_cdr if message.ros2 else types.deserialize_ros1
                return decode(message.raw, message.type)

        yield Bag("MCAP file", topics, messages, decode_message)


def _check_end(path: Path, file: BinaryIO) -> None:
    """Refuse a file whose writer never came to its end: what is left out would not be known."""
    size = path.stat().st_size
    file.seek(max(0, size - len(MAGIC)))
    if size < 2 * len(MAGIC) or file.read() != MAGIC:
        raise InputError(
            str(path),
            f"truncated MCAP file: its {size} bytes do not end as they begin; `mcap recover` "
            "makes a whole file of what is there",
        )
    file.seek(0)


def _reader(file: BinaryIO, indexed: bool) -> Any:
    """By the index, or from start to end where the summary lists no channels."""
    from mcap.reader import NonSeekingReader, make_reader

    return (make_reader if indexed else NonSeekingReader)(file, validate_crcs=True)


def _topics(summary: Any, path: Path) -> tuple[Topic, ...]:
    """From the summary, or by reading all of a file that has none."""
    if summary is None or summary.statistics is None:
        with path.open("rb") as file:
            return merge_topics(
                Topic(channel.topic, ros2_name(schema.name if schema else ""), 1)
                for schema, channel, _ in _reader(file, summary is not None).iter_messages()
            )
    counts = summary.statistics.channel_message_counts
    names = {number: schema.name for number, schema in summary.schemas.items()}
    return merge_topics(
        Topic(one.topic, ros2_name(names.get(one.schema_id, "")), counts.get(one.id, 0))
        for one in summary.channels.values()
    )
