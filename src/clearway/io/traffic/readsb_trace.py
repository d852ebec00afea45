"""Traces of one aircraft over a day, as readsb and tar1090 store them (`trace_full_*.json`)."""

from __future__ import annotations

from typing import Any

from clearway.base.errors import InputError
from clearway.io.foreign import NoJsonError, parse_json
from clearway.io.traffic.traffic_rows import (
    DAMAGED,
    Sieve,
    address_of,
    altitude_of,
    clean_text,
    number,
    report_of,
    source_of,
)
from clearway.traffic.recorded.report import TrafficRecording

FORM = "readsb trace"
GEOMETRIC_ALTITUDE = 8
"""Bit of a row's flags."""
LEAST_FIELDS = 8


def read_trace(source: str, content: bytes) -> TrafficRecording:
    """Rows of seconds since `timestamp`, place, altitude in feet, knots, degrees, flags, rate.

    Fields after readsb's README-json: 0 time, 1 latitude, 2 longitude, 3 altitude or "ground",
    4 ground speed, 5 track, 6 flags, 7 vertical rate, 8 details, 9 type, 10 geometric altitude.
    """
    try:
        data = parse_json(source, content)
    except NoJsonError as cause:
        raise InputError(source, f"no whole JSON object, truncated? ({cause})") from cause
    address, start_s = address_of(data.get("icao")), number(data.get("timestamp"))
    problems = []
    if not address:
        problems.append(f"icao: no address of six hexadecimal digits, got {data.get('icao')!r}")
    if start_s is None:
        problems.append(f"timestamp: no number, got {data.get('timestamp')!r}")
    if not isinstance(data.get("trace"), list):
        problems.append("trace: no list of rows")
    if problems or start_s is None:
        raise InputError(source, problems)
    sieve = Sieve(source)
    callsign = clean_text(data.get("r"))
    for place, row in enumerate(data["trace"]):
        elapsed_s = number(row[0]) if isinstance(row, list) and len(row) >= LEAST_FIELDS else None
        if elapsed_s is None:
            sieve.drop(DAMAGED, f"trace[{place}]: no row of at least {LEAST_FIELDS} fields")
            continue
        details = row[8] if len(row) > 8 and isinstance(row[8], dict) else {}
        callsign = clean_text(details.get("flight")) or callsign
        _take(row, start_s + elapsed_s, address, callsign, sieve)
    return sieve.recording(FORM)


def _take(row: list[Any], time_s: float, address: str, callsign: str, sieve: Sieve) -> None:
    told = sieve.complete(time_s, address, row[1], row[2])
    if told is None:
        return
    barometric, geometric = row[3], row[10] if len(row) > 10 else None
    flags = row[6] if isinstance(row[6], int) else 0
    if flags & GEOMETRIC_ALTITUDE and barometric != "ground":
        barometric, geometric = None, barometric
    sieve.take(
        report_of(
            *told,
            altitude_of(barometric, geometric, sieve),
            (row[4], row[5], row[7]),
            callsign,
            source_of(row[9] if len(row) > 9 else None, address),
        )
    )
