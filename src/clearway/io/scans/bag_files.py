"""ROS 2 bags by their files: with metadata of any version or none, past what is damaged."""

from __future__ import annotations

import re
import sqlite3
import struct
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

from clearway.base.errors import InputError, naming
from clearway.io.foreign_errors import damage_told
from clearway.io.scans.bag import (
    METADATA,
    NANOSECOND_S,
    Bag,
    RawMessage,
    Topic,
    library_complaints,
    merge_topics,
    ros2_types,
    types_of,
)
from clearway.io.scans.bag_mcap import open_mcap
from clearway.io.scans.lost_chunks import read_sqlite_rows, try_unpack
from clearway.io.scans.zstd import SUFFIX as PACKED
from clearway.io.scans.zstd import unpack_file
from clearway.io.sqlite_file import open_sqlite, query_rows, refuse_programs

SUFFIXES = (".db3", ".mcap")
PROMISED = re.compile(r"^  message_count:\s*(\d+)", re.M)
"""Of all topics, by metadata of any version."""


def is_bag_file(path: Path) -> bool:
    """Whether a file is one of a ROS 2 bag, packed or not."""
    return Path(path.name.removesuffix(PACKED)).suffix in SUFFIXES


def plain_files(path: Path, stack: ExitStack) -> list[Path]:
    """The files of a bag in the order of recording; packed ones are unpacked to the side, into a
    folder that goes with the stack.

    Raises InputError where one that the metadata name is missing, or none is there.
    """
    return [_plain(one, stack) for one in _files(path)]


@contextmanager
def open_files(path: Path, files: Sequence[Path]) -> Iterator[Bag]:
    """Open the plain files of a bag one after the other as one recording; path: the bag."""
    with ExitStack() as stack:
        bags = [
            stack.enter_context(open_mcap(one) if one.suffix == ".mcap" else _open_sqlite(one))
            for one in files
        ]
        known: dict[str, Bag] = {}  # by type of message, which is defined alike in all files

        def messages(names: Sequence[str]) -> Iterator[RawMessage]:
            for bag in bags:
                for message in bag.messages(names):
                    known[message.type] = bag
                    yield message

        def decode_message(message: RawMessage) -> Any:
            return known[message.type].decoded(message)

        topics = merge_topics(t for bag in bags for t in bag.topics)
        _check_count(path, sum(topic.messages for topic in topics))
        yield Bag("ROS 2 bag", topics, messages, decode_message)


def _check_count(path: Path, found: int) -> None:
    """Refuse a recording with fewer messages than its metadata promise."""
    metadata = (path if path.is_dir() else path.parent) / METADATA
    if metadata.is_file():
        told = PROMISED.search(metadata.read_text("utf-8", "replace"))
        if told is not None and found < int(told[1]):
            raise InputError(
                str(path), f"truncated: {told[1]} messages promised by {METADATA}, {found} found"
            )


def _plain(path: Path, stack: ExitStack) -> Path:
    """The file itself, or unpacked into a folder that goes with the stack."""
    if path.suffix != PACKED:
        return path
    if not is_bag_file(path):
        raise InputError(
            str(path),
            f"packed by zstd, but no file of a bag; valid: {' or '.join(SUFFIXES)} before {PACKED}",
        )
    with naming("TMPDIR", "written"):
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="clearway-")))
    with damage_told(path, "zstd file", library_complaints()):
        return unpack_file(path, folder)


def _there(path: Path) -> Path:
    """The file, or the packed one that took its place after its name was written down."""
    packed = path.with_name(path.name + PACKED)
    return packed if packed.is_file() and not path.is_file() else path


def _files(path: Path) -> list[Path]:
    """Files with messages, in the order of recording."""
    folder = path if path.is_dir() else path.parent
    metadata = folder / METADATA
    if metadata.is_file():
        _, _, listed = metadata.read_text("utf-8", "replace").partition("relative_file_paths:")
        names = list(dict.fromkeys(re.findall(r"[\w.+/-]+\.(?:db3|mcap)(?:\.zstd)?", listed)))
        files = [_there(folder / name) for name in names]
    elif path.is_dir():
        files = [one for one in folder.iterdir() if is_bag_file(one)]
        if len({re.sub(r"_\d+$", "", one.name.partition(".")[0]) for one in files}) > 1:
            found = ", ".join(sorted(one.name for one in files))
            raise InputError(str(path), f"several recordings in it, and no {METADATA}: {found}")
        files.sort(key=lambda one: ([int(n) for n in re.findall(r"\d+", one.stem)], one.name))
    else:
        files = [path]
    absent = [one.name for one in files if not one.is_file()]
    if absent or not files:
        raise InputError(
            str(path), f"no file with messages in it ({', '.join(absent) or ', '.join(SUFFIXES)})"
        )
    return files


@contextmanager
def _open_sqlite(path: Path) -> Iterator[Bag]:
    """A .db3: tables of topics and messages, in later versions of definitions too."""
    own = library_complaints()
    with ExitStack() as stack:
        with damage_told(path, "ROS 2 bag", own):
            _check_size(path)
            base = stack.enter_context(open_sqlite(path))
            refuse_programs(path, base)
            found = base.execute(
                "SELECT topics.id, name, type, COUNT(messages.id) FROM topics "
                "LEFT JOIN messages ON messages.topic_id = topics.id GROUP BY topics.id"
            )
            topics = {
                number: Topic(str(name), str(kind), count)
                for number, name, kind, count in query_rows(path, found)
            }
            definitions = _definitions(path, base)

        def messages(names: Sequence[str]) -> Iterator[RawMessage]:
            chosen = [number for number, topic in topics.items() if topic.name in names]
            with damage_told(path, "ROS 2 bag", own):
                for number, logged_ns, data, why in read_sqlite_rows(path, base, chosen):
                    topic = topics[number]
                    logged_s = logged_ns * NANOSECOND_S
                    raw, damage = (b"", why) if why else try_unpack(data)
                    yield RawMessage(topic.name, topic.type, logged_s, raw, True, damage)

        stores: dict[str, Any] = {}

        def decode_message(message: RawMessage) -> Any:
            with damage_told(path, f"message of {message.topic} ({message.type})", own):
                if message.type not in stores:
                    known = definitions.get(message.type)
                    stores[message.type] = ros2_types() if known is None else types_of(known)
                return stores[message.type].deserialize_cdr(message.raw, message.type)

        yield Bag("ROS 2 bag", merge_topics(iter(topics.values())), messages, decode_message)


def _check_size(path: Path) -> None:
    """Refuse a file that is shorter than its pages: what it lost would not be known."""
    with path.open("rb") as file:
        head = file.read(100)
    if len(head) < 100:
        return
    page, changes, pages = struct.unpack(">16xH6xII", head[:32])
    if changes == struct.unpack(">I", head[92:96])[0]:  # else the number of pages is not kept
        whole = pages * (65_536 if page == 1 else page)
        if path.stat().st_size < whole:
            raise InputError(str(path), f"truncated: {path.stat().st_size} of {whole} bytes")


def _definitions(path: Path, base: sqlite3.Connection) -> dict[str, Any]:
    """Definitions of messages by type, where the recorder wrote them."""
    tables = {name for (name,) in base.execute("SELECT name FROM sqlite_master")}
    if "message_definitions" not in tables:
        return {}
    rows = base.execute(
        "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
    )
    return {
        name: SimpleNamespace(name=name, encoding=encoding, data=text.encode())
        for name, encoding, text in query_rows(path, rows)
        if encoding in ("ros2msg", "ros2idl")
    }
