"""Trajectories in rows, as the `traffic` library writes them (OpenSky's fields, in feet)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from clearway.base.errors import InputError
from clearway.io.foreign import NoJsonError, parse_json
from clearway.io.json_objects import json_objects
from clearway.io.traffic.traffic_rows import (
    Sieve,
    address_of,
    altitude_of,
    clean_text,
    epoch_s,
    report_of,
)
from clearway.traffic.recorded.report import TrafficRecording

TRAJECTORIES_FORM = "trajectories"


def read_trajectories(source: str, content: bytes) -> TrafficRecording:
    """Rows with `timestamp`, `icao24`, `latitude`, `longitude`, `altitude`, `geoaltitude` ...

    Feet, knots, degrees, feet a minute; times in milliseconds, seconds, or as dates. Where a row
    tells `last_position`, that is the time of its position, and rows that only repeat it are left
    out. Raises InputError where the list, or its last line, is cut off.
    """
    sieve = Sieve(source)
    for _, row in json_objects(source, content, sieve):
        take_trajectory(row, sieve)
    return sieve.recording(TRAJECTORIES_FORM)


def read_trajectory_columns(source: str, content: bytes) -> TrafficRecording:
    """The same as pandas writes it by default, and with it `Traffic.to_json`: values by column.

    Raises InputError where the object is cut off, or a column is no object.
    """
    try:
        columns = parse_json(source, content)
    except NoJsonError as cause:
        raise InputError(source, f"no whole JSON object, truncated? ({cause})") from cause
    named = {name: values for name, values in columns.items() if isinstance(values, dict)}
    if "icao24" not in named:
        raise InputError(source, "no column icao24 in it")
    sieve = Sieve(source)
    for index in named["icao24"]:
        take_trajectory({name: values.get(index) for name, values in named.items()}, sieve)
    return sieve.recording(TRAJECTORIES_FORM)


def take_trajectory(row: Mapping[str, Any], sieve: Sieve) -> None:
    """One row into the sieve."""
    time_s = epoch_s(row.get("last_position"))
    if time_s is None:
        time_s = epoch_s(row.get("timestamp"))
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
            clean_text(row.get("callsign")),
            "adsb",
        )
    )
