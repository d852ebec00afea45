"""Telemetry logs of ground stations (.tlog): MAVLink frames, each after its time of arrival.

Of them the own GPS positions, and what ADSB_VEHICLE and Remote ID tell of others. Frames are
distinguished by their lengths; where that fails, the next place that looks like the beginning of a
record goes on.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator
from importlib import import_module
from typing import Any

from clearway.base.errors import MissingExtraError
from clearway.io.traffic.remote_id import RemoteIds
from clearway.io.traffic.traffic_rows import DAMAGED, NO_ADDRESS, NO_POSITION, Sieve
from clearway.traffic.recorded.report import TrafficRecording, TrafficReport

FORM = "telemetry log of MAVLink (.tlog)"
RECORD = re.compile(rb"\0[\4-\7].{6}[\xfd\xfe]", re.DOTALL)
"""Microseconds since 1970, from 2005 to 2041, and the first byte of a frame."""
TIME = struct.Struct(">Q")
V2 = 0xFD
SIGNED = 1
SIGNATURE = 13
HEAD = {0xFD: 12, 0xFE: 8}
"""Bytes of a frame besides its payload."""
OWN = "own"
VALID_PLACE = 1
VALID_ALTITUDE = 2
VALID_HEADING = 4
VALID_VELOCITY = 8
VALID_CALLSIGN = 16
PRESSURE = 0
FIX_3D = 3


def read_telemetry_log(source: str, content: bytes) -> TrafficRecording:
    """Own GPS positions (address `own`) and others' reports, by the clock of the ground station.

    Raises MissingExtraError without [mavlink].
    """
    try:
        dialect: Any = import_module("pymavlink.dialects.v20.ardupilotmega")
    except ImportError as cause:
        raise MissingExtraError(f"reading {source}", "mavlink") from cause
    codec = dialect.MAVLink(None)
    sieve = Sieve(source)
    remote = RemoteIds(sieve)
    for time_s, frame, place in _frames(content, sieve):
        try:
            message = codec.decode(bytearray(frame))
        except Exception as cause:  # of any kind, by what is damaged in it
            sieve.drop(DAMAGED, f"byte {place}: {cause}")
            continue
        kind = message.get_type()
        if kind == "GPS_RAW_INT":
            _take_own(message, time_s, sieve)
        elif kind == "ADSB_VEHICLE":
            _take_other(message, time_s, sieve)
        elif kind.startswith("OPEN_DRONE_ID_"):
            remote.take(message, kind, time_s)
        else:
            sieve.use("other message")
    return sieve.recording(FORM, own_address=OWN)


def _frames(content: bytes, sieve: Sieve) -> Iterator[tuple[float, bytes, int]]:
    """Seconds since 1970, frame, and where it begins."""
    at = 0
    while at < len(content):
        found = RECORD.match(content, at)
        if found is None:
            later = RECORD.search(content, at)
            left = (len(content) if later is None else later.start()) - at
            if later is None and left < TIME.size + HEAD[V2]:
                sieve.cut_off(f"the last {left} bytes are no whole record")
            else:
                sieve.drop(DAMAGED, f"byte {at}: {left} bytes that are no record")
            at += left
            continue
        begin = at + TIME.size
        first, payload = content[begin], content[begin + 1] if begin + 1 < len(content) else 0
        signed = first == V2 and content[begin + 2 : begin + 3] == bytes([SIGNED])
        end = begin + payload + HEAD[first] + (SIGNATURE if signed else 0)
        if end > len(content) or begin + 1 >= len(content):
            sieve.cut_off(f"the last record has {len(content) - at} of {end - at} bytes")
            return
        yield TIME.unpack_from(content, at)[0] * 1e-6, content[begin:end], at
        at = end


def _take_own(message: Any, time_s: float, sieve: Sieve) -> None:
    if message.fix_type < FIX_3D:
        sieve.drop("no fix of GPS")
        return
    sieve.heard[OWN] += 1
    height = message.alt_ellipsoid * 1e-3 if message.alt_ellipsoid else None
    if height is None:
        sieve.odd("GPS tells heights above the sea alone, taken as unknown")
    sieve.take(
        TrafficReport(
            time_s,
            OWN,
            message.lat * 1e-7,
            message.lon * 1e-7,
            height,
            None if height is None else "geometric",
            height,
            None if message.vel == 0xFFFF else message.vel * 1e-2,
            None if message.cog == 0xFFFF else math.radians(message.cog * 1e-2),
            None,
            OWN,
        )
    )


def _take_other(message: Any, time_s: float, sieve: Sieve) -> None:
    """WGS 84; millimetres, centimetres a second, hundredths of degrees."""
    flags = message.flags
    if not message.ICAO_address:
        sieve.drop(NO_ADDRESS)
        return
    address = f"{message.ICAO_address & 0xFFFFFF:06x}"
    sieve.heard[address] += 1
    if not flags & VALID_PLACE:
        sieve.drop(NO_POSITION)
        return
    moves = bool(flags & VALID_VELOCITY)
    height = message.altitude * 1e-3 if flags & VALID_ALTITUDE else None
    barometric = message.altitude_type == PRESSURE
    sieve.take(
        TrafficReport(
            time_s - message.tslc,
            address,
            message.lat * 1e-7,
            message.lon * 1e-7,
            height,
            None if height is None else "barometric" if barometric else "geometric",
            None if barometric else height,
            message.hor_velocity * 1e-2 if moves else None,
            math.radians(message.heading * 1e-2) if flags & VALID_HEADING else None,
            message.ver_velocity * 1e-2 if moves else None,
            str(message.callsign).strip("\0 ") if flags & VALID_CALLSIGN else "",
            "adsb",
        )
    )
