"""A file that keeps what was worked out, to be found again: whatever does not fit is never used.

It carries what it is, its version, the hash of what it was worked out from and a checksum.
"""

from __future__ import annotations

import hashlib
import os
import struct
from pathlib import Path
from typing import NamedTuple

from clearway.base.cache_folder import make_own
from clearway.base.errors import ClearwayError

_REST = "I32s32s"


class KeptKind(NamedTuple):
    """What a file keeps."""

    magic: bytes
    """That it begins with."""
    version: int
    """Raised whenever its layout, or how its content is worked out, changes."""

    @property
    def header(self) -> struct.Struct:
        """Magic, version, key [32] and checksum [32] of what follows."""
        return struct.Struct(f"<{len(self.magic)}s{_REST}")


def write_kept(path: Path, kind: KeptKind, key: bytes, payload: bytes) -> None:
    """Write beside the target and move into place, so that no one sees half a file.

    Raises OSError where that cannot be done.
    """
    checksum = hashlib.sha256(payload).digest()
    make_own(path.parent)
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        part.write_bytes(kind.header.pack(*kind, key, checksum) + payload)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def read_kept(path: Path, kind: KeptKind, key: bytes) -> bytes:
    """What a file keeps. Raises OSError where it cannot be read, ClearwayError where it is damaged,
    of another version, or of something else."""
    data = path.read_bytes()
    header = kind.header
    if len(data) < header.size or not data.startswith(kind.magic):
        raise ClearwayError("is damaged")
    _, version, stored_key, checksum = header.unpack_from(data)
    if version != kind.version:
        raise ClearwayError(f"is of version {version}, not {kind.version}")
    payload = data[header.size :]
    if stored_key != key or hashlib.sha256(payload).digest() != checksum:
        raise ClearwayError("is damaged")
    return payload
