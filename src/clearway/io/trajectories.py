"""Trajectories as rows of a JSON list, as the `traffic` library writes them (OpenSky's fields)."""

from __future__ import annotations

import json
from typing import Any

from clearway.errors import InputError
from clearway.io.traffic_rows import (
    DAMAGED,
    Sieve,
    address_of,
    altitude_of,
    report_of,
    text,
    times,
)
from clearway.recordings.report import TrafficRecording

FORM = "trajectories"
MILLISECOND_S = 1e-3


def read_trajectories(source: str, content: bytes) -> TrafficRecording:
    """Rows with `timestamp` (ms), `icao24`, `latitude`, `longitude`, `altitude`, `geoaltitude` ...

    Feet, knots, degrees, feet a minute. Where a row tells `last_position`, that is the time of its
    position, and rows that only repeat it are left out. Raises InputError where there are no rows.
    """
    try:
        rows = json.loads(content)
    except (ValueError, RecursionError) as cause:
        raise InputError(source, f"no whole JSON list, truncated? ({cause})") from cause
    if not isinstance(rows, list) or not any(isinstance(row, dict) for row in rows):
        raise InputError(source, "a JSON list without rows; valid: rows with timestamp, icao24 ...")
    sieve = Sieve(source)
    for place, row in enumerate(rows):
        if isinstance(row, dict):
            _take(row, sieve)
        else:
            sieve.drop(DAMAGED, f"row {place}: no JSON object but {str(row)[:40]!r}")
    return sieve.recording(FORM)


def _take(row: dict[str, Any], sieve: Sieve) -> None:
    time_s = times(row.get("last_position"), MILLISECOND_S)
    if time_s is None:
        time_s = times(row.get("timestamp"), MILLISECOND_S)
    address = address_of(row.get("icao24"))
    told = sieve.complete(time_s, address, row.get("latitude"), row.get("longitude"))
    if told is None:
        return
    barometric = "ground" if row.get("onground") is True else row.get("altitude")
    sieve.take(
        report_of(
            *told,
            altitude_of(barometric, row.get("geoaltitude"), sieve),
            (row.get("groundspeed"), row.get("track"), row.get("vertical_rate")),
            text(row.get("callsign")),
            "adsb",
        )
    )
