"""Recordings with damage amid them: all other messages, and what was lost."""

from __future__ import annotations

import heapq
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from clearway.io.foreign_errors import COMPLAINTS, LONGEST_COMPLAINT
from clearway.io.scans.bag import library_complaints
from clearway.io.scans.zstd import unpack_message
from clearway.io.sqlite_file import INTERRUPTED, query_rows

RECORD_HEAD = 9
"""Bytes of an MCAP record before its content: what it is, and how long."""


def damage_complaints() -> tuple[type[Exception], ...]:
    """Return what libraries raise for one damaged part; too little memory is no damage of it."""
    named = (*COMPLAINTS, *library_complaints())
    return tuple(one for one in named if one is not MemoryError)


class Lost(NamedTuple):
    """A message that cannot be read."""

    channel: Any
    """Connection of a bag, or channel of an MCAP file."""
    logged_ns: int
    why: str


def read_mcap_messages(reader: Any, file: BinaryIO, names: Sequence[str]) -> Iterator[Any]:
    """Yield (schema, channel, message) of an MCAP file, and a `Lost` for what damage hides.

    reader: a `SeekingReader` of the file; its summary loses the chunks that are damaged. Raises
    what mcap does where no chunk of an index is to blame.
    """
    found = 0
    while True:
        try:
            for one in islice(reader.iter_messages(list(names)), found, None):
                found += 1
                yield one
            return
        except damage_complaints() as cause:
            summary, why = reader.get_summary(), describe(cause)
            damaged = [one for one in summary.chunk_indexes if not _is_whole(one, file)]
            if not damaged:
                raise
            for one in damaged:
                summary.chunk_indexes.remove(one)
        for one in damaged:
            yield from _list_lost(one, file, summary, names, why)


def _is_whole(index: Any, file: BinaryIO) -> bool:
    from mcap.data_stream import ReadDataStream
    from mcap.records import Chunk
    from mcap.stream_reader import breakup_chunk

    try:
        file.seek(index.chunk_start_offset + RECORD_HEAD)
        breakup_chunk(Chunk.read(ReadDataStream(file)), validate_crc=True)
    except damage_complaints():
        return False
    return True


def _list_lost(
    index: Any, file: BinaryIO, summary: Any, names: Sequence[str], why: str
) -> Iterator[Lost]:
    """What a chunk held of some topics, by the records after it."""
    from mcap.data_stream import ReadDataStream
    from mcap.records import MessageIndex

    for number, offset in index.message_index_offsets.items():
        channel = summary.channels.get(number)
        if channel is None or channel.topic not in names:
            continue
        times = [index.message_start_time]
        with suppress(*damage_complaints()):
            file.seek(offset + RECORD_HEAD)
            listed = MessageIndex.read(ReadDataStream(file)).records
            times = [logged_ns for logged_ns, _ in listed]
        for logged_ns in times:
            yield Lost(channel, logged_ns, why)


def read_bag1_messages(reader: Any, wanted: Sequence[Any]) -> Iterator[Any]:
    """Yield (connection, nanoseconds, bytes) of a ROS 1 bag, and a `Lost` for what damage hides.

    reader: of `rosbags.rosbag1`, open; its index loses what is damaged.
    """
    done = 0
    while True:
        entries = list(heapq.merge(*(reader.indexes[one.id] for one in wanted)))
        if done >= len(entries):
            return
        start_ns = entries[done].time
        again = sum(1 for entry in entries[:done] if entry.time == start_ns)
        try:
            for one in islice(reader.messages(wanted, start=start_ns), again, None):
                done += 1
                yield one
            return
        except damage_complaints() as cause:
            why, damaged = describe(cause), entries[done]
        yield from _drop_damaged(reader, wanted, damaged, why)


def _drop_damaged(reader: Any, wanted: Sequence[Any], damaged: Any, why: str) -> Iterator[Lost]:
    """One message, or all of its chunk if that cannot be unpacked; the index loses them."""
    whole = _unpacks(reader, reader.chunks[damaged.chunk_pos])
    for connection in wanted:
        kept = []
        for entry in reader.indexes[connection.id]:
            if entry == damaged if whole else entry.chunk_pos == damaged.chunk_pos:
                yield Lost(connection, entry.time, why)
            else:
                kept.append(entry)
        reader.indexes[connection.id] = kept


def _unpacks(reader: Any, chunk: Any) -> bool:
    try:
        reader.bio.seek(chunk.datapos)
        chunk.decompressor(reader.bio.read(chunk.datasize))
    except damage_complaints():
        return False
    return True


def read_sqlite_rows(
    path: Path, base: sqlite3.Connection, topics: Sequence[int]
) -> Iterator[tuple[int, int, bytes, str]]:
    """Yield (topic, nanoseconds, bytes, why not) of the messages of a .db3 in the order of time.

    Where pages are damaged, messages are read one by one. Raises sqlite3.Error where not even
    their list can be read.
    """
    marks = ",".join("?" * len(topics))
    chosen = f"FROM messages WHERE topic_id IN ({marks}) ORDER BY timestamp"
    done = 0
    try:
        rows = base.execute(f"SELECT topic_id, timestamp, data {chosen}", topics)
        for row in query_rows(path, rows):
            done += 1
            yield (*row, "")
        return
    except sqlite3.DatabaseError as cause:
        if INTERRUPTED in str(cause):
            raise
        rows = base.execute(f"SELECT rowid, topic_id, timestamp {chosen}", topics)
        listed = list(query_rows(path, rows))
    for number, topic, logged_ns in listed[done:]:
        try:
            ((data,),) = base.execute("SELECT data FROM messages WHERE rowid = ?", (number,))
        except (sqlite3.DatabaseError, ValueError) as cause:
            if INTERRUPTED in str(cause):
                raise
            yield topic, logged_ns, b"", describe(cause)
        else:
            yield topic, logged_ns, data, ""


def try_unpack(data: bytes) -> tuple[bytes, str]:
    """Return a message that may be packed by zstd as it was serialised, or why it cannot be."""
    try:
        return unpack_message(data), ""
    except damage_complaints() as cause:
        return b"", describe(cause)


def describe(cause: Exception) -> str:
    """Return what a library says, as one short line."""
    return f"{type(cause).__name__}: {' '.join(str(cause).split())[:LONGEST_COMPLAINT]}"
