"""Beast binary: frames of Mode S with the ticks of a receiver's 12 MHz clock."""

from __future__ import annotations

from collections.abc import Iterator

from clearway.errors import InputError
from clearway.io.mode_s import Frames, decode_frames
from clearway.io.traffic_rows import DAMAGED, NO_TIME, Sieve
from clearway.recordings.report import TrafficRecording

FORM = "Beast"
ESCAPE = b"\x1a"
HEAD_BYTES = 7
"""Six of ticks and one of signal strength, after the type."""
PAYLOAD_BYTES = {0x31: 2, 0x32: 7, 0x33: 14, 0x34: 14}
"""By type: Mode A/C, short and long Mode S, the receiver's own state."""
MODE_AC, STATE = 0x31, 0x34
TICK_HZ = 12e6
TICKS = 2**48
MULTILATERATED = b"\xff\x00MLAT"
"""In place of ticks: a position computed by receivers together, without a time of reception."""


def read_beast(source: str, content: bytes) -> TrafficRecording:
    """Reports of the aircraft heard; times start with the first frame.

    Raises InputError when the file ends in the middle of a frame.
    """
    sieve, frames = Sieve(source), Frames()
    first = last = None
    for number, (kind, body) in enumerate(_frames(source, content, sieve), start=1):
        expected = HEAD_BYTES + PAYLOAD_BYTES.get(kind, -HEAD_BYTES)
        if len(body) != expected:
            sieve.drop(DAMAGED, f"frame {number}: type {kind:#x} with {len(body)} bytes")
        elif kind == MODE_AC:
            sieve.use("Mode A/C reply")
        elif kind == STATE:
            sieve.use("state of the receiver")
        elif body[:6] == MULTILATERATED:
            sieve.drop(NO_TIME)
        else:
            ticks = int.from_bytes(body[:6], "big")
            if last is not None and ticks < last - TICKS // 2:
                ticks += TICKS
            first = ticks if first is None else first
            last = ticks
            frames.add((ticks - first) / TICK_HZ, body[HEAD_BYTES:])
    decode_frames(frames, sieve)
    return sieve.recording(FORM, clock="relative")


def _frames(source: str, content: bytes, sieve: Sieve) -> Iterator[tuple[int, bytes]]:
    """Type and unescaped rest of each frame; 0x1a is doubled inside, single at its start."""
    parts = content.split(ESCAPE)
    if parts[0]:
        sieve.notes.append(f"{len(parts[0])} bytes before the first frame are left out")
    at = 1
    while at < len(parts):
        body = parts[at]
        at += 1
        while at < len(parts) and not parts[at]:
            if at + 1 == len(parts):
                raise InputError(source, "truncated: it ends with the first byte of a frame")
            body += ESCAPE + parts[at + 1]
            at += 2
        kind = body[0] if body else 0
        expected = 1 + HEAD_BYTES + PAYLOAD_BYTES.get(kind, 0)
        if at >= len(parts) and kind in PAYLOAD_BYTES and len(body) < expected:
            raise InputError(
                source,
                f"truncated: the last frame has {len(body)} bytes after its start, of {expected}",
            )
        yield kind, body[1:]
