"""The kinds of traffic recordings: what each begins like, and what reads it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from clearway.io.aircraft_json import read_aircraft
from clearway.io.beast import read_beast
from clearway.io.bluesky import read_bluesky
from clearway.io.daidalus import read_daidalus
from clearway.io.mode_s_hex import read_hex
from clearway.io.readsb_trace import read_trace
from clearway.io.trajectories import read_trajectories
from clearway.io.ulog import read_ulog_traffic
from clearway.recordings.report import TrafficRecording

HEAD = 4096
BEAST_FRAME = re.compile(rb"\x1a[\x31-\x35\xe3]")
HEX_ROW = re.compile(rb"^\s*\"?[0-9.eE+-]+\"?\s*[,;]\s*\"?[0-9A-Fa-f]{14,28}", re.MULTILINE)
BLUESKY_ROW = re.compile(rb"^\s*\d+:\d\d:\d\d(\.\d+)?\s*>", re.MULTILINE)
HEX_HEADER = re.compile(rb"\s*\"?time\w*\"?\s*[,;]\s*\"?\w*\"?\s*$", re.IGNORECASE | re.MULTILINE)


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


FORMATS = (
    Format("ULog of PX4", _is_ulog, read_ulog_traffic),
    Format("Beast binary", _is_beast, read_beast),
    Format("readsb trace (JSON)", _is_trace, read_trace),
    Format("trajectories (JSON list of rows)", _is_trajectories, read_trajectories),
    Format("readsb aircraft (JSON, one object or one a line)", _is_aircraft, read_aircraft),
    Format("Mode S messages (CSV of time, hex)", _is_hex, read_hex),
    Format("DAIDALUS .daa", _is_daidalus, read_daidalus),
    Format("BlueSky scenario (.scn)", _is_bluesky, read_bluesky),
)
"""In the order in which they are tried."""
