"""Mode S messages as receivers print them (AVR): `*8D...;`, with ticks `@` or `<` before them."""

from __future__ import annotations

import re

from clearway.base.errors import InputError
from clearway.io.traffic.mode_s import Frames, decode_frames
from clearway.io.traffic.mode_s_hex import decode_frame
from clearway.io.traffic.ticks import TickClock
from clearway.io.traffic.traffic_rows import DAMAGED, NO_TIME, Sieve
from clearway.traffic.recorded.report import TrafficRecording

FORM = "Mode S hex (AVR)"
LINE = re.compile(r"([*:@<%]?)([0-9A-Fa-f]+);?")
BEFORE = {"@": 12, "%": 12, "<": 14}
"""Digits before the message: ticks of 12 MHz, after `<` the strength of the signal too."""
MODE_AC_DIGITS = 4
MESSAGE = re.compile(r"[*:]?(?:[0-9A-Fa-f]{14}){1,2};?|[@%](?:[0-9A-Fa-f]{26}|[0-9A-Fa-f]{40});?"
                     r"|<(?:[0-9A-Fa-f]{28}|[0-9A-Fa-f]{42});?")  # fmt: skip


def is_avr(head: bytes) -> bool:
    """Whether one of the first lines is a message without anything else."""
    lines = head.decode("ascii", "replace").splitlines()
    return any(MESSAGE.fullmatch(line.strip()) for line in lines)


def read_avr(source: str, content: bytes) -> TrafficRecording:
    """Reports of the aircraft heard; times start with the first message that has ticks.

    Raises InputError where no message has a time, and where the last one is cut off.
    """
    sieve, frames, clock = Sieve(source), Frames(), TickClock()
    lines = content.decode("ascii", "replace").splitlines()
    for place, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        found = LINE.fullmatch(line.strip())
        try:
            if found is None:
                raise ValueError(f"is no message: {line[:40]!r}")
            _take(found[1], found[2], clock, frames, sieve)
        except ValueError as cause:
            if place == len(lines) and not content.endswith((b"\n", b";")):
                sieve.cut_off(f"line {place}, the last one, {cause}")
                continue
            sieve.drop(DAMAGED, f"line {place}: {cause}")
    if not frames.frames or (clock.frames > 1 and clock.stands):
        raise InputError(
            source,
            "messages without times: positions and encounters need them; valid: lines "
            "`@<12 digits of ticks><message>;`, or a table of time and message",
        )
    sieve.notes.extend(clock.notes())
    decode_frames(frames, sieve)
    return sieve.recording(FORM, clock="relative")


def _take(sign: str, digits: str, clock: TickClock, frames: Frames, sieve: Sieve) -> None:
    before = BEFORE.get(sign, 0)
    message = digits[before:]
    if len(message) == MODE_AC_DIGITS:
        sieve.use("Mode A/C reply")
        return
    frame = decode_frame(message)
    if before:
        frames.add(clock.seconds(int(digits[:12], 16)), frame)
    else:
        sieve.drop(NO_TIME)
