"""The kinds of traffic recordings: what each begins like, and what reads it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from clearway.io.poses.ulog import read_ulog_traffic
from clearway.io.traffic.aircraft_json import read_aircraft
from clearway.io.traffic.avr import is_avr, read_avr
from clearway.io.traffic.beast import read_beast
from clearway.io.traffic.bluesky import read_bluesky
from clearway.io.traffic.daidalus import read_daidalus
from clearway.io.traffic.dataflash import MAGIC as DATAFLASH
from clearway.io.traffic.dataflash import read_dataflash
from clearway.io.traffic.gdl90 import is_gdl90, read_gdl90
from clearway.io.traffic.mode_s_hex import (
    find_message_columns,
    read_hex,
    read_json_frames,
    table_lines,
)
from clearway.io.traffic.ogn import is_ogn, read_ogn
from clearway.io.traffic.opensky import read_states
from clearway.io.traffic.readsb_trace import read_trace
from clearway.io.traffic.sbs import read_sbs
from clearway.io.traffic.telemetry_log import RECORD, read_telemetry_log
from clearway.io.traffic.traffic_table import is_table, read_table
from clearway.io.traffic.trajectories import read_trajectories, read_trajectory_columns
from clearway.traffic.recorded.report import TrafficRecording

HEAD = 4096
BEAST_FRAME = re.compile(rb"\x1a[\x31-\x35\xe3]")
HEX_ROW = re.compile(rb"^\s*\"?[0-9.eE+-]+\"?\s*[,;]\s*\"?[0-9A-Fa-f]{14,28}", re.MULTILINE)
BLUESKY_ROW = re.compile(rb"^\s*\d+:\d\d:\d\d(\.\d+)?\s*>", re.MULTILINE)
SBS_ROW = re.compile(rb"^MSG,[1-8],", re.MULTILINE)
BY_COLUMN = re.compile(rb'\s*\{\s*"\w+"\s*:\s*\{\s*"\d+"\s*:')
JSON_FRAME = re.compile(rb'"frame"\s*:\s*"[0-9A-Fa-f]{14,28}"')
DAIDALUS_COLUMNS = {"lat", "latitude", "sx"}


@dataclass(frozen=True, slots=True)
class Format:
    """One kind of file."""

    name: str
    recognises: Callable[[bytes], bool]
    """Whether the content begins like it."""
    read: Callable[[str, bytes], TrafficRecording]
    known_by: str = ""
    """What it is recognised by, for tables; so the next two."""
    time: str = ""
    needs: str = ""
    """Extra that it needs."""


def _begins_with(content: bytes, signs: bytes) -> bool:
    return content[:HEAD].removeprefix(b"\xef\xbb\xbf").lstrip()[:1] in {bytes([s]) for s in signs}


def _is_beast(content: bytes) -> bool:
    # A recording may begin in the middle of a frame; text never has a 0x1a.
    return BEAST_FRAME.search(content[:64]) is not None


def _is_json(content: bytes) -> bool:
    return _begins_with(content, b"{[")


def _has(*keys: str) -> Callable[[bytes], bool]:
    """Whether JSON has all of these keys near its start."""
    signs = [re.compile(rf'"{key}"\s*:'.encode()) for key in keys]
    return lambda content: _is_json(content) and all(s.search(content[:HEAD]) for s in signs)


def _is_by_column(content: bytes) -> bool:
    columns = (b'"icao24"', b'"latitude"')
    return BY_COLUMN.match(content) is not None and all(name in content for name in columns)


def _is_json_frames(content: bytes) -> bool:
    return _is_json(content) and JSON_FRAME.search(content[:HEAD]) is not None


def _is_hex(content: bytes) -> bool:
    head = content[:HEAD]
    return HEX_ROW.search(head) is not None or find_message_columns(table_lines(head)) is not None


def _is_sbs(content: bytes) -> bool:
    return SBS_ROW.search(content[:HEAD]) is not None


def _is_daidalus(content: bytes) -> bool:
    """Whether the first line names columns, of names and of places."""
    head = content[:HEAD].decode("utf-8-sig", "replace").splitlines()
    lines = [line for line in head if line.strip() and not line.lstrip().startswith("#")]
    words = re.split(r"[\s,;]+", lines[0].strip().lower()) if lines else []
    return bool({"name", "aircraft", "id"} & set(words)) and (
        words[0] in ("name", "aircraft", "id") or not DAIDALUS_COLUMNS.isdisjoint(words)
    )


def _is_ulog(content: bytes) -> bool:
    return content.startswith(b"ULog")


def _is_bluesky(content: bytes) -> bool:
    return BLUESKY_ROW.search(content[:HEAD].replace(b"\r", b"\n")) is not None


TRAFFIC_FORMATS = (
    Format(
        "ULog of PX4",
        _is_ulog,
        read_ulog_traffic,
        "`ULog`; own GPS positions (`own`), `transponder_report`",
        "UTC where GPS told it",
        "`[ulog]`",
    ),
    Format(
        "telemetry log of MAVLink (.tlog)",
        lambda content: RECORD.match(content) is not None,
        read_telemetry_log,
        "times of 8 bytes before `fd` or `fe`; own GPS positions (`own`), `ADSB_VEHICLE`, "
        "`OPEN_DRONE_ID_LOCATION` (Remote ID)",
        "of the ground station, UTC",
        "`[mavlink]`",
    ),
    Format(
        "DataFlash log of ArduPilot (.bin)",
        lambda content: content.startswith(DATAFLASH),
        read_dataflash,
        "`a3 95 80`; own GPS positions with pressure altitude (`own`), `ADSB`",
        "UTC where GPS told it, else since boot",
        "`[mavlink]`",
    ),
    Format(
        "GDL 90",
        lambda content: is_gdl90(content[:HEAD]),
        read_gdl90,
        "frames between `7e` with a right checksum: the own aircraft and others",
        "of the heartbeat before: seconds of a day, without a date",
    ),
    Format(
        "Beast binary",
        _is_beast,
        read_beast,
        "`1a 31` to `1a 35`, `1a e3`; of readsb and Radarcape too",
        "12 MHz ticks, or GPS time, since the first frame",
        "`[adsb]`",
    ),
    Format(
        "readsb trace (JSON)",
        _has("trace"),
        read_trace,
        "JSON with `trace`: one aircraft",
        "`timestamp` + seconds",
    ),
    Format(
        "Mode S frames of jet1090 (JSON)",
        _is_json_frames,
        read_json_frames,
        "JSON with `frame`",
        "`timestamp`",
        "`[adsb]`",
    ),
    Format(
        "OpenSky states (JSON)",
        _has("time", "states"),
        read_states,
        "`states`",
        "of the position, else `time`",
    ),
    Format(
        "trajectories (JSON)",
        _has("icao24", "latitude"),
        read_trajectories,
        "`icao24` and `latitude`: the `traffic` library, OpenSky's fields in feet",
        "`last_position`, else `timestamp`",
    ),
    Format(
        "trajectories (JSON, by column)",
        _is_by_column,
        read_trajectory_columns,
        '`{"timestamp": {"0": ...}, ...}`: `to_json()` of the `traffic` library and of pandas',
        "as of rows",
    ),
    Format(
        "readsb aircraft (JSON, one object or one a line)",
        _is_json,
        read_aircraft,
        "JSON objects, or a list; dump1090, tar1090, adsb.lol too: snapshots, or a row a line",
        "`now` less `seen_pos`",
    ),
    Format(
        "OpenSky states or trajectories (CSV)",
        lambda c: is_table(c[:HEAD]),
        read_table,
        "columns `icao24`, `lat`, `baroaltitude`, or `icao24` and `latitude`",
        "as of their JSON",
    ),
    Format(
        "BaseStation (MSG,...)",
        _is_sbs,
        read_sbs,
        "lines `MSG,...` (SBS-1)",
        "of the computer, taken as UTC",
    ),
    Format(
        "Mode S messages with ticks (AVR: @...;)",
        lambda c: is_avr(c[:HEAD]),
        read_avr,
        "lines `@...;` or `<...;` as receivers print them (`*...;` has no time)",
        "12 MHz ticks since the first message",
        "`[adsb]`",
    ),
    Format(
        "Mode S messages (CSV of time, hex)",
        _is_hex,
        read_hex,
        "rows of a time and 14 or 28 digits, in any columns",
        "seconds, ms, µs or ns since 1970, dates",
        "`[adsb]`",
    ),
    Format(
        "Open Glider Network (APRS)",
        lambda content: is_ogn(content[:HEAD]),
        read_ogn,
        "lines `FLRDDA5BA>...:/160829h4415.41N/...` of its servers: FLARM and others, perhaps "
        "after date and time",
        "of the day before the line, else seconds of a day, without a date",
    ),
    Format(
        "DAIDALUS .daa",
        _is_daidalus,
        read_daidalus,
        "names and units in the first rows",
        "seconds",
    ),
    Format(
        "BlueSky scenario (.scn)",
        _is_bluesky,
        read_bluesky,
        "rows of `HH:MM:SS>`: aircraft where `CRE` puts them",
        "of the script",
    ),
)
"""In the order in which they are tried. Add a format here: help, messages and the table of
docs/traffic.md are made from it."""
