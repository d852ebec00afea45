"""What the deciding process hands over: messages, encoded, and when to send each of them."""

from __future__ import annotations

import marshal
import math
import struct
import zlib
from enum import Enum
from typing import Any, NamedTuple

HEAD = struct.Struct("<4sBdI")
"""Magic, kind, time of sending on the monotonic clock, checksum of all but the checksum."""
MAGIC = b"CWH1"
MOST_MOMENTS = 600
"""Of an escape: longer ones are sampled more coarsely."""
MOST_BYTES = 1 << 20
"""Of a hand-over: longer ones are none."""


class Kind(Enum):
    """What a message to the second process is."""

    PULSE = 1
    """The deciding process lives."""
    ESCAPE = 2
    """It lives, and this is what to fly if it does so no more."""
    END = 3
    """It ends in good order: there is nothing to fly any more."""


class Packet(NamedTuple):
    """A message on a channel: 0 is the link, or the first topic."""

    channel: int
    data: bytes


class Scheduled(NamedTuple):
    """What is sent at a time of the monotonic clock, which all processes share."""

    at_s: float
    packets: tuple[Packet, ...]


class HandOver(NamedTuple):
    """What the second process holds."""

    moments: tuple[Scheduled, ...] = ()
    """The escape in the order of time; none where there is nothing to fly."""
    why_none: str = ""
    """Why there is nothing to fly."""
    peer: tuple[str, int] | None = None
    """Where datagrams go; PX4's flight mode by name and number; None for a line, other topics."""
    vehicle_s: float = 0.0
    """The vehicle's clock less the monotonic one."""
    begins: tuple[Packet, ...] = ()
    """Says that the escape is flown from now on."""
    over: tuple[Packet, ...] = ()
    """Says that it has ended."""
    nothing: tuple[Packet, ...] = ()
    """Says that nothing is flown."""


NOTHING_YET = HandOver(why_none="no decision was handed over")


class BrokenHandOver(ValueError):
    """What came is no message of a deciding process."""


def encode(kind: Kind, sent_s: float, handed: HandOver | None = None) -> bytes:
    """One message; handed: of an escape."""
    body = b"" if handed is None else marshal.dumps(_plain(handed))
    head = HEAD.pack(MAGIC, kind.value, sent_s, 0)
    return HEAD.pack(MAGIC, kind.value, sent_s, zlib.crc32(head + body)) + body


def decode(data: bytes) -> tuple[Kind, float, HandOver | None]:
    """Kind, time of sending and escape of a message; BrokenHandOver for anything else."""
    if not HEAD.size <= len(data) <= MOST_BYTES:
        raise BrokenHandOver(f"{len(data)} bytes")
    magic, number, sent_s, checksum = HEAD.unpack_from(data)
    body = data[HEAD.size :]
    if magic != MAGIC or zlib.crc32(HEAD.pack(magic, number, sent_s, 0) + body) != checksum:
        raise BrokenHandOver("the checksum is wrong")
    try:
        kind = Kind(number)
        return kind, sent_s, _make_hand_over(marshal.loads(body)) if kind is Kind.ESCAPE else None
    except (ValueError, TypeError, EOFError) as cause:
        raise BrokenHandOver(str(cause)) from cause


def _plain(value: Any) -> Any:
    """Tuples in place of named ones, which marshal does not know."""
    if isinstance(value, tuple):
        return tuple(_plain(one) for one in value)
    return value


def _packets(rows: Any) -> tuple[Packet, ...]:
    found = tuple(Packet(*row) for row in rows)
    if not all(type(one.channel) is int and type(one.data) is bytes for one in found):
        raise ValueError("a packet is none")
    return found


def _make_hand_over(rows: Any) -> HandOver:
    """Of plain tuples; ValueError or TypeError where they are none of ours."""
    moments, why_none, peer, vehicle_s, *says = rows
    found = tuple(Scheduled(float(at_s), _packets(packets)) for at_s, packets in moments)
    times = [one.at_s for one in found]
    if not all(map(math.isfinite, (*times, float(vehicle_s)))) or times != sorted(times):
        raise ValueError("its times are none")
    begins, over, nothing = map(_packets, says)
    to = None if peer is None else (str(peer[0]), int(peer[1]))
    return HandOver(found, str(why_none), to, float(vehicle_s), begins, over, nothing)
