"""Beast binary: frames of Mode S with the ticks of a receiver's 12 MHz clock."""

from __future__ import annotations

from collections.abc import Iterator

from clearway.base.errors import InputError
from clearway.io.traffic.mode_s import Frames, decode_frames
from clearway.io.traffic.ticks import TickClock
from clearway.io.traffic.traffic_rows import DAMAGED, NO_TIME, Sieve
from clearway.traffic.recorded.report import TrafficRecording

FORM = "Beast"
ESCAPE = b"\x1a"
HEAD_BYTES = 7
"""Six of time and one of signal strength, after the type."""
MODE_AC = 0x31
STATE = 0x34
POSITION = 0x35
NAME = 0xE3
BODY_BYTES = {
    MODE_AC: HEAD_BYTES + 2,
    0x32: HEAD_BYTES + 7,
    0x33: HEAD_BYTES + 14,
    STATE: HEAD_BYTES + 14,
    POSITION: 21,
    NAME: 8,
}
"""By type: Mode A/C, short and long Mode S; the receiver's own state, place, and name
(readsb)."""
OF_USE = {
    MODE_AC: "Mode A/C reply",
    STATE: "state of the receiver",
    POSITION: "position of the receiver",
    NAME: "name of the receiver",
}
GPS_TIME = 0x10
"""Of the first byte of a state: frames carry GPS times of day instead of 12 MHz ticks."""
COMPUTED = (b"\xff\x00MLAT", b"\xff\x00MLAU")
"""In place of ticks: positions that receivers computed together, without a time of reception."""


def read_beast(source: str, content: bytes) -> TrafficRecording:
    """Reports of the aircraft heard; times start with the first frame.

    Raises InputError when the file ends in the middle of a frame, and where no frame has a time of
    its own.
    """
    sieve, frames = Sieve(source), Frames()
    whole = [
        (number, kind, body)
        for number, (kind, body) in enumerate(_frames(content, sieve), start=1)
        if _is_whole(number, kind, body, sieve)
    ]
    states = [body for _, kind, body in whole if kind == STATE]
    clock = TickClock(gps=any(body[HEAD_BYTES] & GPS_TIME for body in states))
    for _, kind, body in whole:
        if kind in OF_USE:
            sieve.use(OF_USE[kind])
        elif body[:6] in COMPUTED:
            sieve.drop(NO_TIME)
        else:
            frames.add(clock.seconds(int.from_bytes(body[:6], "big")), body[HEAD_BYTES:])
    if clock.frames > 1 and clock.stands:
        raise InputError(
            source,
            f"all {clock.frames} frames have the same time: without times nothing can be placed; "
            "valid: a recording of a receiver that counts 12 MHz ticks, or GPS times",
        )
    sieve.notes.extend(clock.notes())
    decode_frames(frames, sieve)
    return sieve.recording(FORM, clock="relative")


def _is_whole(number: int, kind: int, body: bytes, sieve: Sieve) -> bool:
    if len(body) == BODY_BYTES.get(kind):
        return True
    sieve.drop(DAMAGED, f"frame {number}: type {kind:#x} with {len(body)} bytes")
    return False


def _frames(content: bytes, sieve: Sieve) -> Iterator[tuple[int, bytes]]:
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
                sieve.cut_off("it ends with the first byte of a frame")
                return
            body += ESCAPE + parts[at + 1]
            at += 2
        kind = body[0] if body else 0
        expected = 1 + BODY_BYTES.get(kind, 0)
        if at >= len(parts) and len(body) < expected:
            sieve.cut_off(f"the last frame has {len(body)} bytes after its start, of {expected}")
            return
        yield kind, body[1:]
