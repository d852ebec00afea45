"""Mode S frames into reports, through rs1090: checksums here, fields and positions there."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.base.errors import MissingExtraError
from clearway.base.state import IntArray
from clearway.base.units import FOOT_M, FOOT_PER_MINUTE_MPS, KNOT_MPS
from clearway.io.traffic.traffic_rows import ON_GROUND, Altitude, Sieve, clean_text
from clearway.traffic.recorded.report import NOT_ICAO, Source, TrafficReport

SHORT_BYTES = 7
LONG_BYTES = 14
ALL_CALL = 11
SQUITTER = 17
RELAYED = 18
"""Downlink formats whose checksum is open; in all others the address is folded into it."""
REPLIES = (0, 4, 5, 16, 20, 21)
"""To interrogations, of altitude, identity and registers; none tells a position."""
UNKNOWN = 0
WRONG = 1
REPLY = 2
ACQUISITION = 3
STATUS = 4
TELLING = 5
"""What a frame is."""
GENERATOR = 0xFFF409
"""Of the checksum of 24 bits (ICAO Annex 10, volume IV)."""
INTERROGATORS = 0x7F
"""An all-call reply may carry the code of its interrogator in the last bits of its checksum."""
AT_ONCE = 50_000
"""Messages that the decoder gets at once."""
VELOCITY_AGE_S = 10.0
OFFSET_AGE_S = 60.0
"""Older velocities, and differences of geometric and barometric altitude, no longer count."""

ADSB: Source = "adsb"
CHECKSUM = "checksum wrong"
NOT_KNOWN = "downlink format not known"
NOT_UNDERSTOOD = "not understood by the decoder"
PAIR = "position without its other half (CPR)"
SURFACE = "surface position without a reference"


@dataclass(slots=True)
class Frames:
    """Frames as they were received."""

    times_s: list[float] = field(default_factory=list)
    frames: list[bytes] = field(default_factory=list)

    def add(self, time_s: float, frame: bytes) -> None:
        self.times_s.append(time_s)
        self.frames.append(frame)


Motion = tuple[float | None, float | None, float | None]
"""Ground speed, track, vertical rate, SI."""
UNKNOWN_MOTION: Motion = (None, None, None)


@dataclass(slots=True)
class _ModeSAircraft:
    """What an aircraft has told between its positions."""

    heard: int = 0
    callsign: str = ""
    motion: Motion = UNKNOWN_MOTION
    motion_s: float = -np.inf
    offset_m: float = 0.0
    """Geometric less barometric altitude."""
    offset_s: float = -np.inf


def decode_frames(frames: Frames, sieve: Sieve) -> None:
    """Put all frames into the sieve, in the order of their times.

    A report is one position message; callsign and velocity are the latest of the same address.
    Raises MissingExtraError without rs1090.
    """
    if not frames.frames:
        return
    try:
        import rs1090
    except ImportError as cause:
        raise MissingExtraError(f"decoding Mode S of {sieve.source}", "adsb") from cause
    kinds = _kinds(frames.frames)
    known: dict[str, _ModeSAircraft] = defaultdict(_ModeSAircraft)
    _count_what_is_not_decoded(frames, kinds, known, sieve)
    order = np.argsort(np.array(frames.times_s), kind="stable")
    order = order[kinds[order] == TELLING]
    decode: Any = rs1090.decode
    for batch in _batches(order, frames.frames):
        messages = decode(
            [frames.frames[at].hex() for at in batch], [frames.times_s[at] for at in batch]
        )
        if len(messages) < len(batch):
            sieve.drop(NOT_UNDERSTOOD, count=len(batch) - len(messages))
        told = Counter(_take(message, known, sieve) for message in messages)
        for what, count in told.items():
            if what:
                sieve.use(what, count)
    sieve.heard.update({address: mine.heard for address, mine in known.items()})


def _batches(order: IntArray, frames: list[bytes]) -> list[IntArray]:
    """What is decoded at once, since the decoder takes kilobytes for each message: all of some
    aircraft, whose positions need nothing of others; of one that tells more, so many at a time."""
    if len(order) <= AT_ONCE:
        return [order]
    sender = np.array([int.from_bytes(frames[at][1:4]) for at in order])
    by_sender = np.argsort(sender, kind="stable")
    starts = np.flatnonzero(np.diff(sender[by_sender], prepend=-1))
    ends = [*starts[1:].tolist(), len(order)]
    batches, first = [], 0
    for start, end in zip(starts.tolist(), ends, strict=True):
        if start > first and end - first > AT_ONCE:
            batches.append(by_sender[first:start])
            first = start
    batches.append(by_sender[first:])
    pieces = (np.arange(0, len(batch), AT_ONCE) for batch in batches)
    return [
        order[np.sort(batch[at : at + AT_ONCE])]
        for batch, piece in zip(batches, pieces, strict=True)
        for at in piece.tolist()
    ]


def _count_what_is_not_decoded(
    frames: Frames, kinds: IntArray, known: dict[str, _ModeSAircraft], sieve: Sieve
) -> None:
    """Frames that tell at most an address; `known` grows by whom they are from."""
    for what, kind in ((CHECKSUM, WRONG), (NOT_KNOWN, UNKNOWN)):
        count = int(np.count_nonzero(kinds == kind))
        if count:
            sieve.drop(what, count=count)
    for what, kind in (
        ("Mode S reply", REPLY),
        ("all-call reply", ACQUISITION),
        ("status", STATUS),
    ):
        chosen = np.flatnonzero(kinds == kind)
        if len(chosen):
            sieve.use(what, len(chosen))
        if kind != REPLY:
            for at in chosen:
                known[_sender(frames.frames[at])[0]].heard += 1


def _take(message: dict[str, Any], known: dict[str, _ModeSAircraft], sieve: Sieve) -> str:
    """What a decoded squitter is of use for; empty where it is a report, or left out."""
    if message["df"] == "17":
        address, source = message["icao24"], ADSB
    else:
        address, source = _sender(bytes.fromhex(message["frame"]))
    mine = known[address]
    mine.heard += 1
    register = message.get("bds")
    if register in ("05", "06"):
        _take_position(message, address, source, mine, sieve)
        return ""
    if register == "09":
        _remember_velocity(message, mine)
        return "velocity"
    mine.callsign = clean_text(message.get("callsign"))
    return "identification"


def _remember_velocity(message: dict[str, Any], mine: _ModeSAircraft) -> None:
    mine.motion_s = message["timestamp"]
    mine.motion = _motion(message)
    offset_ft = message.get("geo_minus_baro")
    if offset_ft is not None:
        mine.offset_m, mine.offset_s = offset_ft * FOOT_M, mine.motion_s


def _motion(message: dict[str, Any]) -> Motion:
    speed, track = message.get("groundspeed"), message.get("track")
    rate = message.get("vertical_rate")
    return (
        None if speed is None else speed * KNOT_MPS,
        None if track is None else math.radians(track),
        None if rate is None else rate * FOOT_PER_MINUTE_MPS,
    )


def _take_position(
    message: dict[str, Any], address: str, source: Source, mine: _ModeSAircraft, sieve: Sieve
) -> None:
    on_ground = message["bds"] == "06"
    latitude, longitude = message.get("latitude"), message.get("longitude")
    if latitude is None or longitude is None:
        sieve.drop(SURFACE if on_ground else PAIR)
        return
    time_s = message["timestamp"]
    if on_ground:
        altitude, motion = ON_GROUND, _motion(message)
    else:
        altitude = _altitude(message, mine if time_s - mine.offset_s <= OFFSET_AGE_S else None)
        motion = mine.motion if time_s - mine.motion_s <= VELOCITY_AGE_S else UNKNOWN_MOTION
    sieve.take(
        TrafficReport(
            time_s, address, latitude, longitude, *altitude, *motion, mine.callsign, source
        )
    )


def _altitude(message: dict[str, Any], offset: _ModeSAircraft | None) -> Altitude:
    """Altitude, its kind, and the geometric altitude; with the offset where it is fresh."""
    altitude_ft = message.get("altitude")
    if altitude_ft is None:
        return None, None, None
    if message.get("source") != "barometric":
        return altitude_ft * FOOT_M, "geometric", altitude_ft * FOOT_M
    altitude_m = altitude_ft * FOOT_M
    return altitude_m, "barometric", None if offset is None else altitude_m + offset.offset_m


def _sender(frame: bytes) -> tuple[str, Source]:
    """Address and kind of sender; of relayed squitters (DF 18) by their control field."""
    address = frame[1:4].hex()
    if frame[0] >> 3 != RELAYED:
        return address, ADSB
    control = frame[0] & 0x07
    if control in (0, 1):
        return (address if control == 0 else NOT_ICAO + address), ADSB
    if control == 6:
        return (NOT_ICAO + address if _is_not_icao(frame) else address), "adsr"
    strange = control == 5 or _is_not_icao(frame)
    return (NOT_ICAO + address if strange else address), "tisb"


def _is_not_icao(frame: bytes) -> bool:
    """The flag for addresses that are not ICAO's, which each kind of message keeps elsewhere."""
    kind = frame[4] >> 3
    if kind == 19:
        return bool(frame[5] & 0x80)
    if 5 <= kind <= 8:
        return bool(frame[6] & 0x08)
    return 9 <= kind <= 22 and bool(frame[4] & 0x01)


def _kinds(frames: list[bytes]) -> IntArray:
    """[n] what each frame is, by its downlink format, type code and checksum.

    The decoder looks at the checksums of some formats only, and takes long for what it decodes:
    only squitters with position, velocity or callsign go there.
    """
    kinds = np.full(len(frames), UNKNOWN)
    lengths = np.array([len(frame) for frame in frames])
    for size in (SHORT_BYTES, LONG_BYTES):
        rows = np.flatnonzero(lengths == size)
        if not len(rows):
            continue
        octets = np.frombuffer(b"".join(frames[row] for row in rows), dtype=np.uint8)
        octets = octets.reshape(-1, size)
        rest = np.bitwise_xor.reduce(_checksum_tables(size)[np.arange(size), octets], axis=1)
        format_, code = octets[:, 0] >> 3, octets[:, 4] >> 3
        squitter, called = np.isin(format_, (SQUITTER, RELAYED)), format_ == ALL_CALL
        wrong = squitter & (rest != 0)
        wrong |= called & (rest & ~np.uint32(INTERROGATORS) != 0)
        telling = squitter & (code >= 1) & (code <= 22)
        kinds[rows] = np.select(
            [wrong, telling, squitter, called, np.isin(format_, REPLIES)],
            [WRONG, TELLING, STATUS, ACQUISITION, REPLY],
            UNKNOWN,
        )
    return kinds


@cache
def _checksum_tables(size: int) -> npt.NDArray[np.uint32]:
    """[size, 256] what each value of each byte of a frame leaves; the checksum is their XOR."""
    tables = np.zeros((size, 256), dtype=np.uint32)
    for place in range(size):
        for bit in range(8):
            rest = _remainder(1 << (8 * (size - 1 - place) + bit))
            with_bit = (np.arange(256) >> bit) & 1 == 1
            tables[place, with_bit] ^= np.uint32(rest)
    return tables


def _remainder(frame: int) -> int:
    """Of the division of a frame, checksum included, by the generator."""
    generator = (1 << 24) | GENERATOR
    while frame.bit_length() > 24:
        frame ^= generator << (frame.bit_length() - 25)
    return frame
