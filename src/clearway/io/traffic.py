"""Traffic recordings from files: one value for all formats; the content tells which it is."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from clearway.errors import InputError
from clearway.io.what_file import what_content
from clearway.recordings.report import TrafficRecording

GZIP = b"\x1f\x8b"
HEAD = 4096
BEAST_FRAME = re.compile(rb"\x1a[\x31-\x34]")
HEX_ROW = re.compile(rb"^\s*\"?[0-9.eE+-]+\"?\s*[,;]\s*\"?[0-9A-Fa-f]{14,28}", re.MULTILINE)
BLUESKY_ROW = re.compile(rb"^\s*\d+:\d\d:\d\d(\.\d+)?\s*>", re.MULTILINE)
HEX_HEADER = re.compile(rb"\s*\"?time\w*\"?\s*[,;]\s*\"?\w*\"?\s*$", re.IGNORECASE | re.MULTILINE)


def read_traffic(path: str | Path) -> TrafficRecording:
    """Read a recording of any known format, gzip or not, whatever its suffix.

    Raises InputError when the file is absent, empty, truncated, of no known format, or has nothing
    in it that can be understood; MissingExtraError when Mode S is to be decoded without [adsb], or
    a ULog read without [ulog].
    """
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as cause:
        raise InputError(str(path), f"cannot be read: {cause.strerror or cause}") from cause
    if not content:
        raise InputError(str(path), "the file is empty (0 bytes)")
    if content.startswith(GZIP):
        content = _unpacked(str(path), content)
    reader = next((form.read for form in FORMATS if form.recognises(content)), None)
    if reader is None:
        raise InputError(
            str(path),
            f"no known traffic recording: it begins with {content[:24]!r}; valid: "
            + "; ".join(form.name for form in FORMATS)
            + what_content(content),
        )
    recording = reader(str(path), content)
    if not (recording.reports or recording.of_use or recording.heard):
        reasons = ", ".join(f"{count} {reason}" for reason, count in recording.left_out.items())
        raise InputError(
            str(path),
            [f"no usable message in it (left out: {reasons or 'none'})", *recording.notes],
        )
    return recording


def _unpacked(source: str, content: bytes) -> bytes:
    """What gzip has packed, all members of it."""
    parts = []
    while content:
        unpacker = zlib.decompressobj(wbits=31)
        try:
            parts.append(unpacker.decompress(content))
        except zlib.error as cause:
            raise InputError(source, f"damaged gzip file: {cause}") from cause
        if not unpacker.eof:
            raise InputError(
                source,
                f"truncated: the gzip data end in the middle, after {sum(map(len, parts))} bytes "
                "unpacked",
            )
        content = unpacker.unused_data
    unpacked = b"".join(parts)
    if not unpacked:
        raise InputError(source, "the file is empty (0 bytes, unpacked)")
    return unpacked


@dataclass(frozen=True, slots=True)
class Format:
    """One kind of file."""

    name: str
    recognises: Callable[[bytes], bool]
    """Whether the content begins like it."""
    read: Callable[[str, bytes], TrafficRecording]


def _begins_with(content: bytes, signs: bytes) -> bool:
    return content[:HEAD].removeprefix(b"\xef\xbb\xbf").lstrip()[:1] in {bytes([s]) for s in signs}


def _is_beast(content: bytes) -> bool:
    # A recording may begin in the middle of a frame; text never has a 0x1a.
    return BEAST_FRAME.search(content[:64]) is not None


def _is_trace(content: bytes) -> bool:
    return _begins_with(content, b"{") and re.search(rb'"trace"\s*:', content[:HEAD]) is not None


def _is_trajectories(content: bytes) -> bool:
    return _begins_with(content, b"[")


def _is_aircraft(content: bytes) -> bool:
    return _begins_with(content, b"{")


def _is_hex(content: bytes) -> bool:
    head = content[:HEAD]
    return HEX_HEADER.match(head) is not None or HEX_ROW.search(head) is not None


def _is_daidalus(content: bytes) -> bool:
    lines = [line for line in content[:HEAD].splitlines() if not line.startswith(b"#")]
    return (
        bool(lines) and re.match(rb"\s*(name|aircraft|id)\b", lines[0], re.IGNORECASE) is not None
    )


def _is_ulog(content: bytes) -> bool:
    return content.startswith(b"ULog")


def _is_bluesky(content: bytes) -> bool:
    return BLUESKY_ROW.search(content[:HEAD].replace(b"\r", b"\n")) is not None


def _read_ulog(source: str, content: bytes) -> TrafficRecording:
    from clearway.io.ulog import read_ulog_traffic

    return read_ulog_traffic(source, content)


def _read_bluesky(source: str, content: bytes) -> TrafficRecording:
    from clearway.io.bluesky import read_bluesky

    return read_bluesky(source, content)


def _read_beast(source: str, content: bytes) -> TrafficRecording:
    from clearway.io.beast import read_beast

    return read_beast(source, content)


def _read_trace(source: str, content: bytes) -> TrafficRecording:
    from clearway.io.readsb_trace import read_trace

    return read_trace(source, content)


def _read_trajectories(source: str, content: bytes) -> TrafficRecording:
    from clearway.io.trajectories import read_trajectories

    return read_trajectories(source, content)


def _read_aircraft(source: str, content: bytes) -> TrafficRecording:
    from clearway.io.aircraft_json import read_aircraft

    return read_aircraft(source, content)


def _read_hex(source: str, content: bytes) -> TrafficRecording:
    from clearway.io.mode_s_hex import read_hex

    return read_hex(source, content)


def _read_daidalus(source: str, content: bytes) -> TrafficRecording:
    from clearway.io.daidalus import read_daidalus

    return read_daidalus(source, content)


FORMATS = (
    Format("ULog of PX4", _is_ulog, _read_ulog),
    Format("Beast binary", _is_beast, _read_beast),
    Format("readsb trace (JSON)", _is_trace, _read_trace),
    Format("trajectories (JSON list of rows)", _is_trajectories, _read_trajectories),
    Format("readsb aircraft (JSON, one object or one a line)", _is_aircraft, _read_aircraft),
    Format("Mode S messages (CSV of time, hex)", _is_hex, _read_hex),
    Format("DAIDALUS .daa", _is_daidalus, _read_daidalus),
    Format("BlueSky scenario (.scn)", _is_bluesky, _read_bluesky),
)
"""In the order in which they are tried."""
