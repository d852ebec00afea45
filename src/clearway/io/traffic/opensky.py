"""State vectors of the OpenSky Network: answers of its REST interface, and rows of its history."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from clearway.io.json_objects import json_objects
from clearway.io.traffic.traffic_rows import (
    DAMAGED,
    Altitude,
    Sieve,
    address_of,
    clean_text,
    epoch_s,
    number,
)
from clearway.traffic.recorded.report import Source, TrafficRecording, TrafficReport

OPENSKY_FORM = "OpenSky state vectors"
FIELDS = (
    "icao24", "callsign", "country", "lastposupdate", "lastcontact", "lon", "lat", "baroaltitude",
    "onground", "velocity", "heading", "vertrate", "sensors", "geoaltitude", "squawk", "spi",
    "source",
)  # fmt: skip
"""Of a state in a list, by the names that the history has for them."""
LEAST_FIELDS = 12
SOURCES: Mapping[float | None, Source] = {0.0: "adsb", 2.0: "mlat"}
"""By `position_source`."""


def read_states(source: str, content: bytes) -> TrafficRecording:
    """Objects with `time` and `states`: metres, m/s, degrees, seconds since 1970.

    Raises InputError where the object, or the last line, is cut off.
    """
    sieve = Sieve(source)
    for place, found in json_objects(source, content, sieve):
        rows = found.get("states")
        for number_, row in enumerate(rows if isinstance(rows, list) else []):
            if isinstance(row, list) and len(row) >= LEAST_FIELDS:
                told = dict(zip(FIELDS, row, strict=False))
                take_state({"time": found.get("time"), **told}, sieve)
            else:
                sieve.drop(DAMAGED, f"{place} states[{number_}]: no list of a state".strip())
    return sieve.recording(OPENSKY_FORM)


def take_state(row: Mapping[str, Any], sieve: Sieve) -> None:
    """One state into the sieve; `time` counts where that of its position is not reported."""
    time_s = epoch_s(row.get("lastposupdate"))
    if time_s is None:
        time_s = epoch_s(row.get("time"))
    told = sieve.complete(time_s, address_of(row.get("icao24")), row.get("lat"), row.get("lon"))
    if told is None:
        return
    moment_s, address, (latitude_deg, longitude_deg) = told
    heading = number(row.get("heading"))
    sieve.take(
        TrafficReport(
            moment_s,
            address,
            latitude_deg,
            longitude_deg,
            *_altitude(row),
            number(row.get("velocity")),
            None if heading is None else math.radians(heading),
            number(row.get("vertrate")),
            clean_text(row.get("callsign")),
            SOURCES.get(number(row.get("source", 0)), "unknown"),
        )
    )


def _altitude(row: Mapping[str, Any]) -> Altitude:
    """Altitude, its kind, and the geometric altitude, in metres."""
    barometric, geometric = number(row.get("baroaltitude")), number(row.get("geoaltitude"))
    if row.get("onground") is True:
        return None, "ground", geometric
    if barometric is not None:
        return barometric, "barometric", geometric
    return geometric, None if geometric is None else "geometric", geometric
