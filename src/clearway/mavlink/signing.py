"""MAVLink 2 signing: the key, and whether a frame was signed with it and is not a replay.

A stream's time moves on only with a frame whose signature is right, so that forged ones cannot shut
out the true sender.
"""

from __future__ import annotations

import hashlib
import hmac
import time
from pathlib import Path

from clearway.base.errors import InputError, naming
from clearway.mavlink.wire import SIGNATURE, MavlinkFrame

KEY_BYTES = 32
EPOCH_S = 1_420_070_400
"""2015-01-01, from which signatures count time in steps of 10 microseconds."""
TICKS_PER_S = 100_000
OLDEST_S = 60
"""How far behind ours the time of a new stream may be."""

UNSIGNED = "unsigned"
WRONG_SIGNATURE = "wrong signature"
REPLAYED = "old timestamp"


def read_key(path: Path) -> bytes:
    """The key in a file: 32 bytes, or 64 hexadecimal digits; InputError for anything else."""
    with naming(path, "read"):
        data = path.read_bytes()
    if len(data) == KEY_BYTES:
        return data
    try:
        key = bytes.fromhex(data.decode("ascii"))
    except ValueError:
        key = b""
    if len(key) != KEY_BYTES:
        raise InputError(
            str(path),
            f"no signing key: {len(data)} bytes; 32 bytes or 64 hexadecimal digits are needed",
        )
    return key


def is_open(path: Path) -> bool:
    """Whether others than its owner may read a file."""
    return bool(path.stat().st_mode & 0o077)


def signing_time() -> int:
    """The present time in the unit of signatures."""
    return int(max(0.0, time.time() - EPOCH_S) * TICKS_PER_S)


class SignatureCheck:
    """Remembers the newest time of every stream that is signed with the key."""

    def __init__(self, key: bytes, now: int | None = None) -> None:
        self._key = key
        self.newest = signing_time() if now is None else now
        """Newest time known, in the unit of signatures."""
        self._streams: dict[tuple[int, int, int], int] = {}

    def flaw(self, frame: MavlinkFrame) -> str | None:
        """Why a frame is refused; None if its signature is right and new."""
        if not frame.signed:
            return UNSIGNED
        block = frame.data[-SIGNATURE:]
        right = hashlib.sha256(self._key + frame.data[:-6]).digest()[:6]
        if not hmac.compare_digest(right, block[7:]):
            return WRONG_SIGNATURE
        stream = (block[0], frame.system, frame.component)
        told = int.from_bytes(block[1:7], "little")
        last = self._streams.get(stream, self.newest - OLDEST_S * TICKS_PER_S - 1)
        if told <= last:
            return REPLAYED
        self._streams[stream] = told
        self.newest = max(self.newest, told)
        return None
