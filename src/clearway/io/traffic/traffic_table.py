"""Tables of positions (CSV): state vectors of OpenSky, trajectories of the `traffic` library."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from typing import Any

from clearway.io.foreign import note_unended
from clearway.io.traffic.opensky import OPENSKY_FORM as STATES
from clearway.io.traffic.opensky import take_state
from clearway.io.traffic.traffic_rows import DAMAGED, Sieve
from clearway.io.traffic.trajectories import TRAJECTORIES_FORM as TRAJECTORIES
from clearway.io.traffic.trajectories import take_trajectory
from clearway.traffic.recorded.report import TrafficRecording

Take = Callable[[Mapping[str, Any], Sieve], None]
KINDS: Mapping[frozenset[str], tuple[str, Take]] = {
    frozenset({"time", "icao24", "lat", "lon", "baroaltitude"}): (STATES, take_state),
    frozenset({"timestamp", "icao24", "latitude", "longitude"}): (TRAJECTORIES, take_trajectory),
}
"""Columns that tell which kind a table is of."""
TEXTS = ("icao24", "callsign")
TRUTHS = {"true": True, "false": False}


def is_table(head: bytes) -> bool:
    """Whether the content begins with the columns of a known kind."""
    return _kind(_columns(head.splitlines()[:1])) is not None


def read_table(source: str, content: bytes) -> TrafficRecording:
    """Rows of a table; the columns tell the units. InputError where the last row is cut off."""
    lines = content.decode("utf-8-sig", "replace").splitlines()
    names = _columns([content.splitlines()[0]])
    kind = _kind(names)
    assert kind is not None  # that is how the file was recognised
    form, take = kind
    sieve = Sieve(source)
    sieve.notes.extend(note_unended(content))
    for place, row in enumerate(csv.reader(lines[1:]), start=2):
        if not row:
            continue
        if len(row) == len(names):
            take({name: _value(name, word) for name, word in zip(names, row, strict=True)}, sieve)
        elif place == len(lines) and not content.endswith(b"\n"):
            sieve.cut_off(f"line {place}, the last one, has {len(row)} of {len(names)} values")
        else:
            sieve.drop(DAMAGED, f"line {place}: {len(row)} values, not {len(names)}")
    return sieve.recording(form)


def _columns(lines: list[bytes]) -> list[str]:
    text = [line.decode("utf-8-sig", "replace") for line in lines]
    return [name.strip().lower() for row in csv.reader(text) for name in row]


def _kind(names: list[str]) -> tuple[str, Take] | None:
    return next((kind for needed, kind in KINDS.items() if needed <= set(names)), None)


def _value(name: str, word: str) -> Any:
    """A text, truth value or number; None where there is nothing."""
    word = word.strip()
    if name in TEXTS:
        return word
    if word.lower() in TRUTHS:
        return TRUTHS[word.lower()]
    try:
        return float(word) if word else None
    except ValueError:
        return word
