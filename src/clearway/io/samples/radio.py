"""The same encounter as tablets and gliders hear it: GDL 90, lines of the Open Glider Network."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from clearway.io.samples.encounter import AIRCRAFT, Row, rows
from clearway.io.traffic.gdl90 import ESCAPE_BYTE, FLAG, TURNED, compute_gdl90_crc

TWENTY_FOUR = 1 << 24
TWELVE = 1 << 12
AIRBORNE_TRUE_TRACK = 9
GOOD_POSITION = 0xA9


def write_gdl90(path: Path, rng: np.random.Generator) -> None:
    """Each second a heartbeat, the own aircraft and its geometric altitude, and the other one."""
    del rng
    content, told_s = b"", -1.0
    for row in rows():
        if row.after_s > told_s:
            told_s = row.after_s
            content += _frame(_heartbeat(row.time_s))
        own = row.aircraft is AIRCRAFT[0]
        if own:
            feet = round(row.altitude_ft / 5.0)
            content += _frame(b"\x0b" + feet.to_bytes(2, "big", signed=True) + b"\0\x0a")
        content += _frame(_report(10 if own else 20, row))
    path.write_bytes(content)


def _heartbeat(time_s: float) -> bytes:
    second = int(time_s) % 86_400
    status = bytes((0, 0x81, 0x01 | (second >> 16) << 7))
    return status + (second & 0xFFFF).to_bytes(2, "little") + b"\0\0"


def _report(kind: int, row: Row) -> bytes:
    one = row.aircraft
    steps = round((row.altitude_ft + 1000.0) / 25.0)
    speed, climb = round(row.speed_kt), 0
    place = b"".join(
        (round(degrees / 180.0 * 2**23) % TWENTY_FOUR).to_bytes(3, "big")
        for degrees in (row.latitude, row.longitude)
    )
    return (
        bytes((kind, 0))
        + bytes.fromhex(one.address)
        + place
        + (steps << 4 | AIRBORNE_TRUE_TRACK).to_bytes(2, "big")
        + bytes((GOOD_POSITION,))
        + (speed << 12 | climb % TWELVE).to_bytes(3, "big")
        + bytes((round(one.track_deg / 360.0 * 256.0) % 256, 1))
        + one.callsign.ljust(8).encode()
        + b"\0"
    )


def _frame(message: bytes) -> bytes:
    """Between flags, with its checksum, flags in it turned."""
    told = message + compute_gdl90_crc(message).to_bytes(2, "little")
    turned = b"".join(
        bytes((ESCAPE_BYTE, byte ^ TURNED)) if byte in (FLAG, ESCAPE_BYTE) else bytes((byte,))
        for byte in told
    )
    return bytes((FLAG,)) + turned + bytes((FLAG,))


def write_ogn(path: Path, rng: np.random.Generator) -> None:
    """Lines after the moment at which they were logged, and a receiver's own."""
    del rng
    lines = ["# aprsc 2.1.19 made up\n"]
    for row in rows():
        when = datetime.fromtimestamp(row.time_s, UTC)
        one = row.aircraft
        north, finer_north = _minutes(row.latitude, 2)
        east, finer_east = _minutes(row.longitude, 3)
        feet = round(row.altitude_ft)
        lines.append(
            f"{when:%Y-%m-%dT%H:%M:%SZ} FLR{one.address.upper()}>OGFLR,qAS,NOWHERE:"
            f"/{when:%H%M%S}h{north}N/{east}E'{round(one.track_deg) or 360:03d}/"
            f"{round(row.speed_kt):03d}/A={feet:06d} !W{finer_north}{finer_east}! "
            f"id05{one.address.upper()} +000fpm +0.0rot 20.0dB 0e +0.1kHz gps2x3\n"
        )
    when = datetime.fromtimestamp(row.time_s, UTC)
    lines.append(
        f"{when:%Y-%m-%dT%H:%M:%SZ} NOWHERE>OGNSDR,TCPIP*,qAC,GLIDERN1:"
        f"/{when:%H%M%S}h5000.00NI00800.00E&/A=000328\n"
    )
    path.write_text("".join(lines))


def _minutes(degrees: float, digits: int) -> tuple[str, int]:
    """Degrees and minutes of two decimals, and the third."""
    whole, thousandths = divmod(round(abs(degrees) * 60_000.0), 60_000)
    hundredths, finer = divmod(thousandths, 10)
    return f"{whole:0{digits}d}{hundredths // 100:02d}.{hundredths % 100:02d}", finer
