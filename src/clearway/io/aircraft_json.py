"""Aircraft as readsb, dump1090 and tar1090 tell of them in JSON: snapshots, or one row a line."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from clearway.errors import InputError
from clearway.io.traffic_rows import (
    DAMAGED,
    Sieve,
    address_of,
    altitude_of,
    number,
    report_of,
    source_of,
    text,
)
from clearway.recordings.report import TrafficRecording

FORM = "aircraft JSON"


def read_aircraft(source: str, content: bytes) -> TrafficRecording:
    """Rows with `now`, `hex`, `lat`, `lon`, `alt_baro` ..., or snapshots with `aircraft` lists.

    Feet, knots, degrees and feet a minute; `now` in seconds since 1970. A snapshot's positions are
    `seen_pos` seconds old. Raises InputError when the last line is cut off.
    """
    sieve = Sieve(source)
    types: dict[str, Any] = {}
    for found in _objects(source, content, sieve):
        rows = found.get("aircraft")
        if isinstance(rows, list):
            for row in rows:
                if isinstance(row, dict):
                    _take(row, found.get("now"), sieve, types)
                else:
                    sieve.drop(DAMAGED)
        else:
            _take(found, found.get("now", found.get("timestamp")), sieve, types)
    return sieve.recording(FORM)


def _objects(source: str, content: bytes, sieve: Sieve) -> Iterator[dict[str, Any]]:
    """JSON objects, one a line; or a single one over many lines."""
    lines = content.splitlines()
    whole = content.endswith(b"\n")
    if not _parses(lines[0]):
        try:
            yield json.loads(content)
            return
        except (ValueError, RecursionError) as cause:
            if len(lines) == 1 or lines[0].strip() in (b"{", b"["):
                raise InputError(source, f"no whole JSON object, truncated? ({cause})") from cause
    for place, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            found = json.loads(line)
        except (ValueError, RecursionError) as cause:
            if place == len(lines) and not whole:
                raise InputError(
                    source, f"truncated: line {place}, the last one, ends in the middle: {cause}"
                ) from cause
            sieve.drop(DAMAGED, f"line {place}: no JSON object ({cause})")
            continue
        if isinstance(found, dict):
            yield found
        else:
            sieve.drop(DAMAGED, f"line {place}: no JSON object but {str(found)[:40]!r}")


def _parses(line: bytes) -> bool:
    try:
        json.loads(line)
    except (ValueError, RecursionError):
        return False
    return True


def _take(row: dict[str, Any], now: Any, sieve: Sieve, types: dict[str, Any]) -> None:
    """One row into the sieve; `types` remembers what each aircraft's reports come from."""
    more = row.get("flightdict")
    details: dict[str, Any] = {**more, **row} if isinstance(more, dict) else row
    address = address_of(row.get("hex", row.get("icao")))
    if address:
        types[address] = details.get("type") or types.get(address)
    told = sieve.complete(number(now), address, row.get("lat"), row.get("lon"))
    if told is None:
        return
    now_s, _, place_deg = told
    rate = details.get("baro_rate")
    sieve.take(
        report_of(
            now_s - (number(row.get("seen_pos")) or 0.0),
            address,
            place_deg,
            altitude_of(details.get("alt_baro"), details.get("alt_geom"), sieve),
            (
                row.get("gs", row.get("gscp")),
                row.get("track"),
                details.get("geom_rate") if rate is None else rate,
            ),
            text(details.get("flight")).replace("N/A", ""),
            source_of(types[address], address),
        )
    )
