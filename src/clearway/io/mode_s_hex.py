"""Mode S messages as text: a table of times and hexadecimal messages."""

from __future__ import annotations

import math

from clearway.errors import InputError
from clearway.io.mode_s import LONG_BYTES, SHORT_BYTES, Frames, decode_frames
from clearway.io.traffic_rows import DAMAGED, Sieve
from clearway.recordings.report import TrafficRecording

FORM = "Mode S hex"
UTC_FROM_S = 1e8
"""Times below are not since 1970."""


def read_hex(source: str, content: bytes) -> TrafficRecording:
    """Reports of rows `time,hex`: seconds, and 14 or 28 digits; a header line may come first.

    Lines that are no such row are counted; raises InputError if the last one is cut off.
    """
    sieve, frames = Sieve(source), Frames()
    table = content.decode("ascii", "replace").replace(";", ",").replace('"', "")
    lines = table.splitlines()
    for place, line in enumerate(lines, start=1):
        try:
            frames.add(*_parsed(line))
        except ValueError as cause:
            if not line.strip() or (place == 1 and line.lstrip().lower().startswith("time")):
                continue
            if place == len(lines) and not content.endswith(b"\n"):
                raise InputError(
                    source, f"truncated: line {place}, the last one, {cause}"
                ) from cause
            sieve.drop(DAMAGED, f"line {place}: {cause}")
    decode_frames(frames, sieve)
    utc = not frames.times_s or max(frames.times_s) >= UTC_FROM_S
    return sieve.recording(FORM, clock="utc" if utc else "relative")


def _parsed(line: str) -> tuple[float, bytes]:
    """Time and message of a row; raises ValueError with the reason if it is none."""
    words = line.split(",")
    if len(words) < 2:
        raise ValueError("has no time and message, separated by a comma")
    try:
        time_s, message = float(words[0]), bytes.fromhex(words[1])
    except ValueError as cause:
        raise ValueError(f"is no time and hexadecimal message ({cause})") from cause
    if not math.isfinite(time_s):
        raise ValueError(f"has no finite time: {words[0]}")
    # The top bit of the downlink format is set in long messages only.
    expected = LONG_BYTES if message and message[0] & 0x80 else SHORT_BYTES
    if len(message) != expected:
        raise ValueError(f"has a message of {len(message)} bytes instead of {expected}")
    return time_s, message
