"""Mode S messages as text: tables of times and hexadecimal messages, and JSON that holds both."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from clearway.io.json_objects import json_objects
from clearway.io.moments import second_of
from clearway.io.traffic.mode_s import LONG_BYTES, SHORT_BYTES, Frames, decode_frames
from clearway.io.traffic.traffic_rows import DAMAGED, NO_TIME, Sieve, clean_text, epoch_s
from clearway.traffic.recorded.report import TrafficRecording

FORM = "Mode S hex"
UTC_FROM_S = 1e8
"""Times below are not since 1970."""
MESSAGE = re.compile(r"\*?(?:[0-9A-Fa-f]{14}|[0-9A-Fa-f]{28})")
FIRST_LINES = 50
"""In which the columns are looked for."""


class MessageColumns(NamedTuple):
    """Where a row has its time and its message."""

    time: int
    message: int


def read_hex(source: str, content: bytes) -> TrafficRecording:
    """Reports of rows with a time and a message of 14 or 28 digits; a header line may come first.

    Columns stand in any order, others beside them, between commas, semicolons, tabs or blanks;
    times in seconds, or parts of them since 1970, or as dates. Lines that are no such row are
    counted; raises InputError if the last one is cut off.
    """
    sieve, frames = Sieve(source), Frames()
    lines = table_lines(content)
    columns = find_message_columns(lines) or MessageColumns(0, 1)
    for place, line in enumerate(lines, start=1):
        try:
            frames.add(*_parse_row(line, columns))
        except ValueError as cause:
            if not line.strip() or line.startswith("#") or (place == 1 and _is_header(line)):
                continue
            if place == len(lines) and not content.endswith(b"\n"):
                sieve.cut_off(f"line {place}, the last one, {cause}")
                continue
            sieve.drop(DAMAGED, f"line {place}: {cause}")
    return _recording(frames, sieve)


def read_json_frames(source: str, content: bytes) -> TrafficRecording:
    """Reports of objects with `timestamp` and `frame`, as jet1090 writes them, one a line."""
    sieve, frames = Sieve(source), Frames()
    for place, row in json_objects(source, content, sieve):
        time_s = epoch_s(row.get("timestamp"))
        if time_s is None:
            sieve.drop(NO_TIME)
            continue
        try:
            frames.add(time_s, decode_frame(clean_text(row.get("frame"))))
        except ValueError as cause:
            sieve.drop(DAMAGED, f"{place}: {cause}".strip(": "))
    return _recording(frames, sieve)


def table_lines(content: bytes) -> list[str]:
    """Lines of a table, its words between commas."""
    table = content.decode("utf-8-sig", "replace").replace(";", ",").replace("\t", ",")
    lines = table.replace('"', "").splitlines()
    if not any("," in line for line in lines[:FIRST_LINES]):
        lines = [",".join(line.split()) for line in lines]
    return lines


def find_message_columns(lines: list[str]) -> MessageColumns | None:
    """The columns of the first row that has a message and a time; None where there is none."""
    header: list[str] = []
    for line in lines[:FIRST_LINES]:
        words = [word.strip() for word in line.split(",")]
        message = next((n for n, word in enumerate(words) if MESSAGE.fullmatch(word)), None)
        if message is None:
            header = header or [word.lower() for word in words]
            continue
        times = [n for n, word in enumerate(words) if n != message and _is_time(word)]
        named = [n for n in times if n < len(header) and re.search("time|stamp", header[n])]
        if times:
            return MessageColumns((named or times)[0], message)
    return None


def decode_frame(digits: str) -> bytes:
    """A message of its digits; raises ValueError with the reason if it is none."""
    try:
        message = bytes.fromhex(digits)
    except ValueError as cause:
        raise ValueError(f"has no hexadecimal message ({cause})") from None
    # The top bit of the downlink format is set in long messages only.
    expected = LONG_BYTES if message and message[0] & 0x80 else SHORT_BYTES
    if len(message) != expected:
        raise ValueError(f"has a message of {len(message)} bytes instead of {expected}")
    return message


def _parse_row(line: str, columns: MessageColumns) -> tuple[float, bytes]:
    """Time and message of a row; raises ValueError with the reason if it is none."""
    words = line.split(",")
    if len(words) <= max(columns):
        raise ValueError("has no time and message, separated by a comma")
    try:
        time_s = float(words[columns.time])
    except ValueError:
        moment = epoch_s(words[columns.time])
        if moment is None:
            raise ValueError(f"has no time: {words[columns.time][:30]!r}") from None
        time_s = moment
    if not math.isfinite(time_s):
        raise ValueError(f"has no finite time: {words[columns.time]}")
    return time_s, decode_frame(words[columns.message].strip(" *"))


def _is_time(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return epoch_s(word) is not None
    return True


def _is_header(line: str) -> bool:
    """Whether a line has names instead of a time and a message."""
    words = [word.strip() for word in line.split(",")]
    return not any(_is_time(word) or MESSAGE.fullmatch(word) for word in words)


def _recording(frames: Frames, sieve: Sieve) -> TrafficRecording:
    """Frames decoded, times since 1970 in seconds whatever they were counted in."""
    latest = max(map(abs, frames.times_s), default=UTC_FROM_S)
    second = second_of(latest)
    if second != 1.0:
        frames.times_s = [time * second for time in frames.times_s]
    decode_frames(frames, sieve)
    return sieve.recording(FORM, clock="utc" if latest * second >= UTC_FROM_S else "relative")
