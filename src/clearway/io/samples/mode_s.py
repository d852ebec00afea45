"""Mode S messages as a transponder sends them: positions, velocities and names, with parity.

After ICAO Doc 9871 and J. Sun, The 1090 Megahertz Riddle, chapters 3 to 7.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from clearway.io.samples.encounter import Row, rows

GENERATOR = 0xFFF409
LETTERS = "#ABCDEFGHIJKLMNOPQRSTUVWXYZ##### ###############0123456789######"
TICKS_A_SECOND = 12_000_000
ZONES = 15


def write_hex(path: Path, rng: np.random.Generator) -> None:
    """A table of seconds since 1970 and hex digits."""
    del rng
    lines = (f"{time_s:.6f},{message.hex()}\n" for time_s, _, message in messages())
    path.write_text("timestamp,rawmsg\n" + "".join(lines))


def write_avr(path: Path, rng: np.random.Generator) -> None:
    """Lines `@<ticks><message>;`, ticks of 12 MHz."""
    del rng
    path.write_text(
        "".join(
            f"@{_ticks(after_s):012X}{message.hex().upper()};\n"
            for _, after_s, message in messages()
        )
    )


def write_beast(path: Path, rng: np.random.Generator) -> None:
    """Beast: 0x1a, kind, six bytes of ticks, one of signal, message; 0x1a doubled inside."""
    del rng
    content = b""
    for _, after_s, message in messages():
        body = _ticks(after_s).to_bytes(6, "big") + b"\x80" + message
        content += b"\x1a3" + body.replace(b"\x1a", b"\x1a\x1a")
    path.write_bytes(content)


def write_json_frames(path: Path, rng: np.random.Generator) -> None:
    """Objects of jet1090, one a line."""
    del rng
    path.write_text(
        "".join(
            json.dumps({"timestamp": round(time_s, 6), "frame": message.hex()}) + "\n"
            for time_s, _, message in messages()
        )
    )


def _ticks(after_s: float) -> int:
    return round((after_s + 1.0) * TICKS_A_SECOND)


def messages() -> Iterator[tuple[float, float, bytes]]:
    """(seconds since 1970, seconds since the beginning, message), in the order of time."""
    for row in rows(step_s=0.5):
        odd = round(2.0 * row.after_s) % 2
        kinds = [encode_position(row, odd)]
        if odd:
            kinds.append(velocity(row))
        elif round(row.after_s) % 10 == 0:
            kinds.append(identification(row))
        for number, data in enumerate(kinds):
            later = row.after_s + 0.01 * number
            yield row.time_s + 0.01 * number, later, frame_message(row.aircraft.address, data)


def frame_message(address: str, data: int) -> bytes:
    """A message of format 17 with its 56 bits of data and its parity."""
    head = (17 << 3 | 5) << 24 | int(address, 16)
    content = head << 56 | data
    return (content << 24 | _parity(content)).to_bytes(14, "big")


def _parity(content: int) -> int:
    """Remainder of 88 bits, with 24 zeros after them, by the generator."""
    rest = content << 24
    for bit in range(111, 23, -1):
        if rest >> bit & 1:
            rest ^= (1 << 24 | GENERATOR) << (bit - 24)
    return rest


def encode_position(row: Row, odd: int) -> int:
    """Airborne position, barometric altitude, even or odd (type code 11)."""
    steps = (row.altitude_ft + 1000) // 25
    altitude = (steps >> 4) << 5 | 1 << 4 | steps & 15
    latitude_step = 360.0 / (4 * ZONES - odd)
    y = _share(row.latitude, latitude_step)
    found = latitude_step * (y / 2**17 + math.floor(row.latitude / latitude_step))
    longitude_step = 360.0 / max(1, _longitude_zones(found) - odd)
    x = _share(row.longitude, longitude_step)
    return 11 << 51 | altitude << 36 | odd << 34 | (y % 2**17) << 17 | x % 2**17


def _share(angle: float, step: float) -> int:
    return math.floor(2**17 * (angle % step) / step + 0.5)


def _longitude_zones(latitude: float) -> int:
    inside = 1.0 - math.cos(math.pi / (2 * ZONES))
    cosine = math.cos(math.radians(latitude)) ** 2
    return math.floor(2.0 * math.pi / math.acos(1.0 - inside / cosine))


def velocity(row: Row) -> int:
    """Airborne velocity over the ground (type code 19, subtype 1), level."""
    track = math.radians(row.aircraft.track_deg)
    east = round(row.speed_kt * math.sin(track))
    north = round(row.speed_kt * math.cos(track))
    parts = (int(east < 0) << 10 | abs(east) + 1, int(north < 0) << 10 | abs(north) + 1)
    return 19 << 51 | 1 << 48 | parts[0] << 32 | parts[1] << 21 | 1 << 10


def identification(row: Row) -> int:
    """Name and category (type code 4, light)."""
    data = 4 << 51 | 1 << 48
    for place, letter in enumerate(row.aircraft.callsign.ljust(8)):
        data |= LETTERS.index(letter) << (42 - 6 * place)
    return data
