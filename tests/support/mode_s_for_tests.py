"""Published Mode S messages, and files of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearway.io.traffic.traffic import read_traffic
from clearway.traffic.recorded import TrafficRecording

# Worked examples of J. Sun, The 1090 Megahertz Riddle (2nd ed.), chapters 4 and 5.
IDENTIFICATION = "8D4840D6202CC371C32CE0576098"
EVEN = "8D40621D58C382D690C8AC2863A7"
ODD = "8D40621D58C386435CC412692AD6"
VELOCITY = "8D485020994409940838175B284F"


def mode_s(path: Path, *rows: tuple[float, str]) -> TrafficRecording:
    pytest.importorskip("rs1090")
    path.write_text("".join(f"{time_s},{message}\n" for time_s, message in rows))
    return read_traffic(path)


def beast(*rows: tuple[int, str]) -> bytes:
    """Frames of ticks and messages, with 0x1a doubled inside."""
    frames = []
    for ticks, message in rows:
        payload = bytes.fromhex(message)
        kind = b"\x33" if len(payload) == 14 else b"\x32"
        body = ticks.to_bytes(6, "big") + b"\x1a" + payload
        frames.append(b"\x1a" + kind + body.replace(b"\x1a", b"\x1a\x1a"))
    return b"".join(frames)
