"""GDL 90 recordings: what portable receivers (Stratux, Sentry, SkyEcho) send to tablets.

Frames between bytes 7e, with a checksum. Reports have no time of their own: it is that of the
heartbeat before them, seconds since midnight UTC of a day that the recording does not tell.
"""

from __future__ import annotations

import binascii
import math
from collections.abc import Iterator

from clearway.base.units import FOOT_M, FOOT_PER_MINUTE_MPS, KNOT_MPS
from clearway.io.traffic.traffic_rows import DAMAGED, NO_POSITION, NO_TIME, Sieve
from clearway.traffic.recorded.report import (
    NOT_ICAO,
    AltitudeKind,
    Source,
    TrafficRecording,
    TrafficReport,
)

FORM = "GDL 90"
FLAG = 0x7E
ESCAPE_BYTE = 0x7D
TURNED = 0x20
HEARTBEAT = 0
OWN = 10
OWN_GEOMETRIC = 11
OTHER = 20
LENGTHS = {HEARTBEAT: 7, OWN: 28, OWN_GEOMETRIC: 5, OTHER: 28}
LONGEST = 1_024
"""Of a frame; uplinks of weather have 436 bytes."""
ICAO_KINDS = (0, 2)
TISB_KINDS = (2, 3)
NO_AIRCRAFT = 5
"""Address types: given out by a state; told by a radar; a beacon on the ground."""
DEGREES = 180.0 / 2**23
FEET = 25.0
DAY_S = 86_400.0
HALF_DAY_S = 43_200.0
NO_ALTITUDE = 0xFFF
NO_SPEED = 0xFFF
NO_CLIMB = 0x800
CLIMB_FPM = 64.0
TURN_DEG = 360.0 / 256.0
GEOMETRIC_FT = 5.0
AIRBORNE = 8
TRUE_TRACK = 1
BEACON = "beacon on the ground"


class HeartbeatClock:
    """Seconds of the day as heartbeats tell them, counted on over midnight."""

    def __init__(self) -> None:
        self.time_s: float | None = None
        self._days = 0

    def take(self, second: float) -> None:
        before = None if self.time_s is None else self.time_s - DAY_S * self._days
        if before is not None and second < before - HALF_DAY_S:
            self._days += 1
        self.time_s = second + DAY_S * self._days


def is_gdl90(head: bytes) -> bool:
    """Whether a frame with a right checksum begins in it."""
    if FLAG not in head:
        return False
    return any(_check(frame) is not None for _, frame in _frames(head))


def read_gdl90(source: str, content: bytes) -> TrafficRecording:
    """Reports of the own aircraft and of others; pressure altitude, of the own geometric too."""
    sieve, now = Sieve(source), HeartbeatClock()
    sieve.notes.append("times are seconds since midnight UTC: the recording tells no day")
    own: str | None = None
    own_height: tuple[float, float] | None = None
    for place, frame in _frames(content):
        message = _check(frame)
        if message is None:
            sieve.drop(DAMAGED, f"byte {place}: {len(frame)} bytes, checksum wrong")
            continue
        kind = message[0]
        if kind in LENGTHS and len(message) < LENGTHS[kind]:
            sieve.drop(DAMAGED, f"byte {place}: message {kind} of {len(message)} bytes")
        elif kind == HEARTBEAT:
            now.take(float(int.from_bytes(message[3:5], "little") | (message[2] & 0x80) << 9))
            sieve.use("heartbeat")
        elif kind == OWN_GEOMETRIC:
            height = GEOMETRIC_FT * FOOT_M * int.from_bytes(message[1:3], "big", signed=True)
            own_height = None if now.time_s is None else (now.time_s, height)
            sieve.use("geometric altitude of the own aircraft")
        elif kind in (OWN, OTHER):
            geometric = None
            if kind == OWN:
                own = _address(message)
                fresh = own_height is not None and own_height[0] == now.time_s
                geometric = own_height[1] if own_height is not None and fresh else None
            _take(message, now.time_s, geometric, sieve)
        else:
            sieve.use("other message")
    last = content.rpartition(bytes([FLAG]))[2]
    if last:
        sieve.cut_off(f"the last {len(last)} bytes are no whole frame")
    return sieve.recording(FORM, "relative", own_address=own)


def _frames(content: bytes) -> Iterator[tuple[int, bytes]]:
    """(place, bytes) between two flags, as they stand there; nothing before the first."""
    begin = content.find(FLAG)
    while begin >= 0:
        end = content.find(FLAG, begin + 1)
        if end < 0:
            return
        if end > begin + 1:
            yield begin, content[begin + 1 : end]
        begin = end


def _check(frame: bytes) -> bytes | None:
    """The message in a frame, None where the checksum does not fit."""
    if len(frame) > 2 * LONGEST:
        return None
    plain, turned = bytearray(), False
    for byte in frame:
        if byte == ESCAPE_BYTE and not turned:
            turned = True
            continue
        plain.append(byte ^ TURNED if turned else byte)
        turned = False
    if len(plain) < 3 or turned:
        return None
    message, told = bytes(plain[:-2]), int.from_bytes(plain[-2:], "little")
    return message if compute_gdl90_crc(message) == told else None


def compute_gdl90_crc(message: bytes) -> int:
    """CRC of 16 bits, polynomial 0x1021, of the last two bytes without zeros behind them."""
    padded = message.rjust(2, b"\0")
    return binascii.crc_hqx(padded[:-2], 0) ^ int.from_bytes(padded[-2:], "big")


def _address(message: bytes) -> str:
    sign = "" if message[1] & 15 in ICAO_KINDS else NOT_ICAO
    return f"{sign}{message[2:5].hex()}"


def _take(message: bytes, time_s: float | None, geometric_m: float | None, sieve: Sieve) -> None:
    """A report; fields as of the interface's table 8."""
    kind = message[1] & 15
    if kind == NO_AIRCRAFT:
        sieve.use(BEACON)
        return
    address = _address(message)
    latitude = DEGREES * int.from_bytes(message[5:8], "big", signed=True)
    longitude = DEGREES * int.from_bytes(message[8:11], "big", signed=True)
    sieve.heard[address] += 1
    if latitude == longitude == 0.0 and message[13] >> 4 == 0:
        sieve.drop(NO_POSITION)
        return
    if time_s is None:
        sieve.drop(NO_TIME)
        return
    steps, misc = message[11] << 4 | message[12] >> 4, message[12] & 15
    speed = message[14] << 4 | message[15] >> 4
    climb = (message[15] & 15) << 8 | message[16]
    altitude_m, told = None, None
    if not misc & AIRBORNE:
        told = "ground"
    elif steps != NO_ALTITUDE:
        altitude_m, told = (FEET * steps - 1000.0) * FOOT_M, "barometric"
    sieve.take(
        TrafficReport(
            time_s,
            address,
            latitude,
            longitude,
            altitude_m,
            _kind(told),
            geometric_m,
            None if speed == NO_SPEED else speed * KNOT_MPS,
            math.radians(TURN_DEG * message[17]) if misc & 3 == TRUE_TRACK else None,
            None if climb == NO_CLIMB else _read_signed(climb) * CLIMB_FPM * FOOT_PER_MINUTE_MPS,
            message[19:27].decode("ascii", "replace").strip("\0 "),
            _source(kind),
        )
    )


def _kind(told: str | None) -> AltitudeKind | None:
    return None if told is None else "ground" if told == "ground" else "barometric"


def _source(kind: int) -> Source:
    return "tisb" if kind in TISB_KINDS else "adsb"


def _read_signed(twelve_bits: int) -> int:
    return twelve_bits - 0x1000 if twelve_bits & 0x800 else twelve_bits
