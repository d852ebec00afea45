"""Bytes into MAVLink 2 frames: nothing is taken that is not whole and of the right checksum.

pymavlink's own parser loses good frames behind a damaged one, and lets a forged signature shut out
the true sender, so frames are cut here; pymavlink decodes what is found to be good.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from typing import NamedTuple

from clearway.mavlink.dialect import compute_mavlink_crc

MAGIC = 0xFD
OLD_MAGIC = 0xFE
MAGICS = re.compile(b"[\xfd\xfe]")
HEADER = 10
OLD_FRAME = 8
CHECKSUM = 2
SIGNATURE = 13
SIGNED = 0x01
LONGEST_FRAME = HEADER + 255 + CHECKSUM + SIGNATURE
MOST_FLAWS = 32
"""Of a datagram: what is behind so many damaged frames is not looked at."""
MOST_FRAMES = 64
"""Nor is what is behind so many whole ones. Senders put 1,500 bytes into one at most, which is 44
of the shortest signed frames."""

GARBAGE = "bytes of no frame"
TRUNCATED = "truncated"
MAVLINK_1 = "MAVLink 1"
BAD_CHECKSUM = "bad checksum"
UNKNOWN_FLAGS = "unknown flags"
NOT_NEEDED = "message not needed"
OVERLONG = "datagram: more frames or damage than is looked at"


class MavlinkFrame(NamedTuple):
    """One whole frame, its checksum found right."""

    data: bytes
    system: int
    component: int
    message: int
    """Number of the message."""
    signed: bool


def frames_in(
    data: bytes, extras: Mapping[int, int], refused: Counter[str], *, stream: bool
) -> tuple[list[MavlinkFrame], bytes]:
    """Frames of the messages in `extras`, and the bytes left over that may begin another.

    extras: number of each wanted message -> its CRC_EXTRA. refused grows by what is left out, by
    reason. stream: frames may continue in the next piece (serial); a datagram is whole.
    """
    frames: list[MavlinkFrame] = []
    at, end, flaws, whole = 0, len(data), 0, 0
    while at < end:
        if not stream and (flaws >= MOST_FLAWS or whole >= MOST_FRAMES):
            refused[OVERLONG] += 1
            break
        if data[at] == OLD_MAGIC and _is_mavlink_1(data, at, extras):
            refused[MAVLINK_1] += 1
            at, whole = at + _old_length(data, at), whole + 1
            continue
        if data[at] != MAGIC:
            found = MAGICS.search(data, at + 1)
            after = found.start() if found else end
            refused[GARBAGE] += after - at
            at, flaws = after, flaws + 1
            continue
        length = _length(data, at)
        if end - at < length:
            if stream:
                return frames, data[at:]
            refused[TRUNCATED] += 1
            break
        reason = _flaw(data, at, extras)
        if reason is None:
            frames.append(_frame(data[at : at + length]))
            at, whole = at + length, whole + 1
            continue
        refused[reason] += 1
        # A frame may begin inside what only looked like one.
        passes = _ends_well(data, at, length)
        at += length if passes else 1
        whole, flaws = whole + passes, flaws + (not passes)
    return frames, b""


def _length(data: bytes, at: int) -> int:
    """Length of the frame that begins here; of the shortest where that cannot be told yet."""
    if len(data) - at < 3:
        return HEADER + CHECKSUM
    signature = SIGNATURE if data[at + 2] & SIGNED else 0
    return HEADER + data[at + 1] + CHECKSUM + signature


def _old_length(data: bytes, at: int) -> int:
    return OLD_FRAME + data[at + 1] if len(data) - at > 1 else OLD_FRAME


def _is_mavlink_1(data: bytes, at: int, extras: Mapping[int, int]) -> bool:
    """Whether a frame of MAVLink 1 begins here: by its checksum where its message is known."""
    length = _old_length(data, at)
    if not _ends_well(data, at, length):
        return False
    message = data[at + 5] if len(data) - at > 5 else -1
    end = at + length - CHECKSUM
    told = int.from_bytes(data[end : end + CHECKSUM], "little")
    return (
        message in extras
        and compute_mavlink_crc(data[at + 1 : end] + bytes([extras[message]])) == told
    )


def _ends_well(data: bytes, at: int, length: int) -> bool:
    """Whether a frame of that length ends with the data, or where another begins."""
    after = at + length
    return after == len(data) or (after < len(data) and data[after] in (MAGIC, OLD_MAGIC))


def _flaw(data: bytes, at: int, extras: Mapping[int, int]) -> str | None:
    if data[at + 2] & ~SIGNED:
        return UNKNOWN_FLAGS
    message = int.from_bytes(data[at + 7 : at + 10], "little")
    if message not in extras:
        return NOT_NEEDED
    end = at + HEADER + data[at + 1]
    told = int.from_bytes(data[end : end + CHECKSUM], "little")
    if compute_mavlink_crc(data[at + 1 : end] + bytes([extras[message]])) != told:
        return BAD_CHECKSUM
    return None


def _frame(data: bytes) -> MavlinkFrame:
    message = int.from_bytes(data[7:10], "little")
    return MavlinkFrame(data, data[5], data[6], message, bool(data[2] & SIGNED))
