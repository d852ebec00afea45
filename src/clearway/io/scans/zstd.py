"""What zstd has packed in robot recordings: whole files, and messages one by one."""

from __future__ import annotations

import errno
from pathlib import Path

from clearway.base.errors import InputError

SUFFIX = ".zstd"
"""Of packed files, after the suffix of what is packed."""
MAGIC = b"\x28\xb5\x2f\xfd"
"""Messages packed one by one begin so, serialised ones never."""
MOST_MESSAGE_BYTES = 500_000_000
MOST_FILE_BYTES = 1_000_000_000
MOST_RATIO = 50
"""Unpacked, of a small file and for each byte of a larger one: scans shrink to a third at best."""
PIECE_BYTES = 1 << 20
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""What the system says of a disk that is full."""


def unpack_message(data: bytes) -> bytes:
    """A message as it was serialised; ValueError where it unpacks to far too much."""
    if not data.startswith(MAGIC):
        return data
    from zstandard import ZstdDecompressor

    plain = bytearray()
    with ZstdDecompressor().stream_reader(data) as stream:
        # By pieces: the library makes room at once for all that it is asked for.
        while piece := stream.read(PIECE_BYTES):
            plain += piece
            if len(plain) > MOST_MESSAGE_BYTES:
                raise ValueError(f"a message unpacks to more than {MOST_MESSAGE_BYTES:,} bytes")
    return bytes(plain)


def unpack_file(path: Path, folder: Path) -> Path:
    """The file unpacked into a folder, under its name without the suffix.

    Raises InputError where it is cut off or unpacks to far too much, ZstdError where it is damaged.
    """
    from zstandard import ZstdDecompressor

    size = path.stat().st_size
    most, written = MOST_FILE_BYTES + MOST_RATIO * size, 0
    target = folder / path.name.removesuffix(SUFFIX)
    unpacker = ZstdDecompressor().decompressobj(read_across_frames=False)
    try:
        with path.open("rb") as packed, target.open("wb") as plain:
            while piece := packed.read(PIECE_BYTES):
                part = unpacker.decompress(piece)
                written += len(part)
                plain.write(part)
                if written > most:
                    raise InputError(str(path), f"unpacks to more than {most:,} bytes")
    except OSError as cause:
        if cause.errno not in NO_ROOM:
            raise
        raise InputError(
            str(path),
            f"cannot be unpacked into {folder}: {cause.strerror}; "
            "let TMPDIR name a folder with more space",
        ) from cause
    if not unpacker.eof:
        raise InputError(
            str(path), f"truncated: the zstd data end after {written:,} bytes unpacked"
        )
    return target
