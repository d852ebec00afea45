"""A run read back from its MCAP file, as far as a view of it needs.

Messages are kept as they came, large ones packed, and read when somebody asks for one: those of an
hour, all read at once, take gigabytes.
"""

from __future__ import annotations

import json
import zlib
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import IO, Any, TypeVar

import numpy as np

from clearway.base.errors import InputError, MissingExtraError, naming
from clearway.base.frames import FloatArray
from clearway.base.made import Made
from clearway.io.foreign_errors import damage_told
from clearway.io.what_file import require_file
from clearway.view.replay import schemas

RUN_FILE = "run.mcap"
POINT_BYTES = 12
CLOUD_DATA = 6
"""Number of the field of foxglove.PointCloud that holds the points."""
OWN = tuple(topic for topic in schemas.SCHEMAS if topic != schemas.SCALARS)
"""Of clearway's own messages those that are read back: scalars repeat what decisions tell."""
READ = (*OWN, schemas.POINTS, schemas.WORLD_POINTS)
"""Topics that are read back; the others are for Foxglove."""
UNPACKED_BYTES = 64_000_000
UNPACKED_PER_BYTE = 100
"""That a recording may unpack to, beside and for each of its bytes; flights have 9 for each, and 30
where the vehicle stays in one place for an hour."""
PACK_FROM = 1_000
"""Bytes of a message from which on it is kept packed."""
PACKED = b"\x78"
"""What begins packed messages, and neither JSON nor a point cloud."""
ReplayMessage = dict[str, Any]
T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Recording:
    """A run as it was written; messages in the order of their times."""

    source: str
    mission: ReplayMessage
    states: Sequence[ReplayMessage]
    decisions: Sequence[ReplayMessage]
    cells: Sequence[ReplayMessage]
    """One per decision; none in a run of a planner without cells. So with the next two."""
    reach: Sequence[ReplayMessage]
    points_m: Sequence[FloatArray]
    """[n, 3] each: centres of the voxels with points that the decision reckoned with."""
    reach_sets: Sequence[ReplayMessage]
    intruders: Sequence[ReplayMessage]
    surveyed_m: FloatArray
    """[n, 3] points of a surveyed world, thinned."""


def run_file(run: Path) -> Path:
    """The MCAP file of a run: the path itself, or `run.mcap` in a run folder."""
    if run.is_dir():
        if not (run / RUN_FILE).is_file():
            raise InputError(
                str(run),
                f"no {RUN_FILE} in the folder; `clearway fly` writes it "
                "where the extra `foxglove` is installed",
            )
        return run / RUN_FILE
    require_file(run)
    return run


def read_run(run: Path) -> Recording:
    """The run of a folder or an MCAP file.

    Raises InputError for files that are absent, damaged, or of something else, and
    MissingExtraError without the extra `foxglove`.
    """
    path = run_file(run)
    with damage_told(path, "run"):
        messages = _messages(path)
        _check_complete(path, messages)
        return _recording(path, messages)


def _recording(path: Path, messages: dict[str, list[bytes]]) -> Recording:
    own = {topic: _read(messages[topic], json.loads) for topic in OWN}
    surveyed = _read(messages[schemas.WORLD_POINTS], cloud_points)
    return Recording(
        source=str(path),
        mission=own[schemas.MISSION][0],
        states=own[schemas.STATE],
        decisions=own[schemas.DECISION],
        cells=own[schemas.CELLS],
        reach=own[schemas.REACH],
        points_m=_read(messages[schemas.POINTS], cloud_points),
        reach_sets=own[schemas.REACH_SET],
        intruders=own[schemas.INTRUDERS],
        surveyed_m=surveyed[0] if surveyed else np.zeros((0, 3)),
    )


def _read(messages: list[bytes], read: Callable[[bytes], T]) -> Sequence[T]:
    """What messages say, read when asked for; each is read once at first, to find the damaged."""
    for data in messages:
        read(_unpack(data))
    return Made(messages, lambda data: read(_unpack(data))) if messages else ()


def _pack(data: bytes) -> bytes:
    return zlib.compress(data, 1) if len(data) >= PACK_FROM or data[:1] == PACKED else data


def _unpack(data: bytes) -> bytes:
    return zlib.decompress(data) if data[:1] == PACKED else data


def _check_complete(path: Path, messages: dict[str, list[bytes]]) -> None:
    """Refuse files of other programs, of newer versions, and runs with parts missing."""
    topics = ", ".join(sorted(messages)) or "none"
    if not messages[schemas.MISSION] or not messages[schemas.STATE]:
        raise InputError(
            str(path),
            f"no run of clearway: topics {schemas.MISSION} and {schemas.STATE} are needed, "
            f"there are {topics}",
        )
    try:
        about = json.loads(_unpack(messages[schemas.MISSION][0]))
        version = about["format"]
    except (ValueError, KeyError, TypeError) as cause:
        raise InputError(str(path), f"{schemas.MISSION}: no readable message") from cause
    if version != schemas.FORMAT:
        raise InputError(
            str(path),
            f"written in format {version} of clearway's runs; this version reads {schemas.FORMAT}",
        )
    decisions = len(messages[schemas.DECISION])
    promised = about["summary"]["decisions"]
    if decisions != promised:
        raise InputError(str(path), f"{decisions} decisions of {promised}: part of it is missing")
    for topic in (schemas.CELLS, schemas.REACH, schemas.POINTS):
        count = len(messages[topic])
        if count not in (0, decisions):
            raise InputError(str(path), f"{topic}: {count} messages for {decisions} decisions")


def _messages(path: Path) -> dict[str, list[bytes]]:
    """Data of all messages by topic, packed, in the order of their times."""
    try:
        from mcap.reader import SeekingReader
    except ImportError as cause:
        raise MissingExtraError(f"reading {path}", "foxglove") from cause
    found: dict[str, list[bytes]] = defaultdict(list)
    with (
        naming(path, "read"),
        damage_told(path, "MCAP file", _libraries_own()),
        path.open("rb") as stream,
    ):
        _check_ends(path, stream)
        _check_unpacked(path, stream)
        reader = SeekingReader(stream, validate_crcs=True)
        summary = reader.get_summary()
        for channel in summary.channels.values() if summary else ():
            found[channel.topic] = []
        for _, channel, message in reader.iter_messages(topics=READ):
            found[channel.topic].append(_pack(message.data))
    return found


@cache
def _libraries_own() -> tuple[type[Exception], ...]:
    """What the reader and its decompressors raise besides Python's own errors."""
    from mcap.exceptions import McapError
    from mcap.stream_reader import CRCValidationError
    from zstandard import ZstdError

    return (McapError, CRCValidationError, ZstdError)


def _check_ends(path: Path, stream: IO[bytes]) -> None:
    """Both ends of an MCAP file carry its magic bytes: without the last ones it is truncated."""
    magic = b"\x89MCAP0\r\n"
    size = stream.seek(0, 2)
    stream.seek(0)
    if stream.read(len(magic)) != magic:
        raise InputError(str(path), f"no MCAP file ({size} bytes)")
    stream.seek(max(0, size - len(magic)))
    if stream.read() != magic or size < 2 * len(magic):
        raise InputError(str(path), f"a truncated MCAP file: its end is missing ({size} bytes)")
    stream.seek(0)


def _check_unpacked(path: Path, stream: IO[bytes]) -> None:
    """Refuse what unpacks to far more than a flight would, before anything is unpacked."""
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader

    size = stream.seek(0, 2)
    most, unpacked = UNPACKED_BYTES + UNPACKED_PER_BYTE * size, 0
    stream.seek(0)
    for record in StreamReader(stream, emit_chunks=True).records:
        if isinstance(record, Chunk):
            size_told = _read_stated_size(record.compression, record.data, most)
            unpacked += max(record.uncompressed_size, size_told)
        if unpacked > most:
            raise InputError(
                str(path),
                f"its {size / 1e6:.3g} MB unpack to more than {most / 1e6:.3g} MB: no run of "
                "clearway",
            )
    stream.seek(0)


def _read_stated_size(compression: str, packed: bytes, most: int) -> int:
    """What a packed chunk itself unpacks to, up to so much, where that may be more than its record
    tells."""
    if compression == "zstd":
        import zstandard

        return max(0, int(zstandard.frame_content_size(packed)))
    if compression == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        return len(LZ4FrameDecompressor().decompress(packed, max_length=most + 1))
    return len(packed)


def cloud_points(data: bytes) -> FloatArray:
    """[n, 3] points of an encoded foxglove.PointCloud as `entities.point_cloud` makes it."""
    packed = _bytes_field(data, CLOUD_DATA)
    if len(packed) % POINT_BYTES:
        raise ValueError(f"{schemas.POINTS}: {len(packed)} bytes are no whole points")
    return np.frombuffer(packed, dtype="<f4").reshape(-1, 3).astype(np.float64)


def _bytes_field(message: bytes, wanted: int) -> bytes:
    """A field of bytes of a protobuf message; empty where absent, as protobuf leaves it out."""
    at = 0
    while at < len(message):
        key, at = _varint(message, at)
        number, wire = key >> 3, key & 7
        if wire == 0:
            _, at = _varint(message, at)
        elif wire in (1, 5):
            at += 8 if wire == 1 else 4
        elif wire == 2:
            length, at = _varint(message, at)
            if number == wanted:
                return message[at : at + length]
            at += length
        else:
            raise ValueError(f"protobuf wire type {wire}")
    return b""


def _varint(message: bytes, at: int) -> tuple[int, int]:
    """A number of protobuf's variable length, and where the next one begins."""
    value = shift = 0
    while True:
        byte = message[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return value, at
