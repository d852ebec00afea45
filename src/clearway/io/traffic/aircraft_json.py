"""Aircraft as readsb, dump1090, tar1090 and those who collect from them tell of them in JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from clearway.io.json_objects import json_objects
from clearway.io.traffic.traffic_rows import (
    DAMAGED,
    Sieve,
    address_of,
    altitude_of,
    clean_text,
    epoch_s,
    number,
    report_of,
    source_of,
)
from clearway.traffic.recorded.report import TrafficRecording

FORM = "aircraft JSON"
AIRCRAFT = ("aircraft", "ac")
ALTITUDE = ("alt_baro", "altitude")
SPEED = ("gs", "gscp", "speed")
RATE = ("baro_rate", "geom_rate", "vert_rate")
"""Names of one and the same, newest first: receivers of before 2018 wrote the last ones."""


def read_aircraft(source: str, content: bytes) -> TrafficRecording:
    """Rows with `now`, `hex`, `lat`, `lon`, `alt_baro` ..., or snapshots that list them.

    Feet, knots, degrees and feet a minute; `now` in seconds or milliseconds since 1970. A
    snapshot's positions are `seen_pos` seconds old. Raises InputError when the last line is cut
    off.
    """
    sieve = Sieve(source)
    types: dict[str, Any] = {}
    for _, found in json_objects(source, content, sieve):
        rows = _first(found, AIRCRAFT)
        if isinstance(rows, list):
            for row in rows:
                if isinstance(row, dict):
                    _take(row, found.get("now"), sieve, types)
                else:
                    sieve.drop(DAMAGED)
        else:
            _take(found, found.get("now", found.get("timestamp")), sieve, types)
    return sieve.recording(FORM)


def _first(row: Mapping[str, Any], names: tuple[str, ...]) -> Any:
    """The first of some values that is reported."""
    return next((row[name] for name in names if row.get(name) is not None), None)


def _take(row: dict[str, Any], now: Any, sieve: Sieve, types: dict[str, Any]) -> None:
    """One row into the sieve; `types` remembers what each aircraft's reports come from."""
    more = row.get("flightdict")
    details: dict[str, Any] = {**more, **row} if isinstance(more, dict) else row
    address = address_of(row.get("hex", row.get("icao")))
    if address:
        types[address] = details.get("type") or types.get(address)
    told = sieve.complete(epoch_s(now), address, row.get("lat"), row.get("lon"))
    if told is None:
        return
    now_s, _, place_deg = told
    sieve.take(
        report_of(
            now_s - (number(row.get("seen_pos")) or 0.0),
            address,
            place_deg,
            altitude_of(_first(details, ALTITUDE), details.get("alt_geom"), sieve),
            (_first(row, SPEED), row.get("track"), _first(details, RATE)),
            clean_text(details.get("flight")).replace("N/A", ""),
            source_of(types[address], address),
        )
    )
