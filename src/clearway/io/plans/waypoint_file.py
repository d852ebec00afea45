"""Waypoint files of ground stations (QGC WPL): one item a line, the first is home."""

from __future__ import annotations

import math
from pathlib import Path

from clearway.base.errors import InputError
from clearway.io.foreign import read_text
from clearway.io.maps.map_features import Geodetic
from clearway.io.plans.flight_plan import FlightPlan
from clearway.io.plans.plan_items import CHANGE_SPEED, ItemsRead, geodetic_of

COLUMNS = 12
"""Index, current, frame, command, four parameters, latitude, longitude, height, autocontinue."""


def read_waypoints(path: Path) -> FlightPlan:
    """The plan in a waypoint file; InputError with every bad line."""
    lines = read_text(path).splitlines()
    if not lines[0].startswith("QGC WPL"):
        raise InputError(
            str(path), f"line 1: {lines[0][:40]!r}; valid: QGC WPL 110 and one item a line"
        )
    rows, problems = [], []
    for number, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        try:
            rows.append((f"line {number}", _numbers(line.split())))
        except ValueError as cause:
            problems.append(f"line {number}: {cause}")
    if problems:
        raise InputError(str(path), problems)
    if not rows:
        raise InputError(str(path), "no item in it; the first is home")
    return _plan(path, rows)


def _numbers(words: list[str]) -> list[float]:
    if len(words) < COLUMNS:
        raise ValueError(f"{len(words)} of {COLUMNS} columns: truncated?")
    try:
        numbers = [float(word) for word in words[:COLUMNS]]
    except ValueError as cause:
        raise ValueError(f"{cause}") from None
    if not all(math.isfinite(number) for number in (*numbers[2:4], *numbers[8:11])):
        raise ValueError("frame, command, latitude, longitude and height must be finite")
    return numbers


def _plan(path: Path, rows: list[tuple[str, list[float]]]) -> FlightPlan:
    items, speed = ItemsRead(), None
    (_, first), others = rows[0], rows[1:]
    home = Geodetic(first[8], first[9], first[10])
    try:
        geodetic_of(*home)
    except ValueError as cause:
        items.problems.append(f"{rows[0][0]}: home: {cause}")
    for place, row in others:
        command = int(row[3])
        if command == CHANGE_SPEED and not items.found and row[5] > 0.0:
            speed = row[5]
        else:
            items.take(place, command, int(row[2]), (row[8], row[9], row[10]))
    if items.problems:
        raise InputError(str(path), items.problems)
    return FlightPlan(str(path), path.stem, home, tuple(items.found), speed, counts=items.left_out)
