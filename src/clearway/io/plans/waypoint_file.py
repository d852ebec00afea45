"""Waypoint files of ground stations (QGC WPL): one item a line, the first is home.

The same form holds fences and rally points, and then has no home.
"""

from __future__ import annotations

import math
from pathlib import Path

from clearway.base.errors import InputError
from clearway.io.foreign import read_text
from clearway.io.maps.map_features import Geodetic
from clearway.io.plans.flight_plan import FlightPlan, plan_of
from clearway.io.plans.plan_commands import FENCE_AND_RALLY_ITEMS
from clearway.io.plans.plan_items import Entry, ItemsRead, read_geodetic

HEAD = "QGC WPL"
VERSIONS = {"110": True, "120": False}
"""Whether the first item is home; QGroundControl wrote 120 without it."""
COLUMNS = 12
"""Index, current, frame, command, four parameters, latitude, longitude, height, autocontinue."""
LARGEST_WHOLE = 65_535


def list_written_lines(path: Path) -> list[tuple[str, str]]:
    """Lines of a file with their places, without empty ones and comments (`#`)."""
    found = [(f"line {number}", line.strip())
             for number, line in enumerate(read_text(path).splitlines(), start=1)]  # fmt: skip
    return [(place, line) for place, line in found if line and not line.startswith("#")]


def read_waypoints(path: Path) -> FlightPlan:
    """The plan in a waypoint file; InputError with every bad line."""
    lines = list_written_lines(path)
    place, head = lines[0] if lines else ("line 1", "")
    version = head.removeprefix(HEAD).strip()
    if not head.startswith(HEAD) or version not in VERSIONS:
        known = f"{HEAD} {' or '.join(VERSIONS)}"
        raise InputError(str(path), f"{place}: {head[:40]!r}; valid: {known} and one item a line")
    rows, problems = [], []
    for place, line in lines[1:]:
        try:
            rows.append((place, _numbers(line.split())))
        except ValueError as cause:
            problems.append(f"{place}: {cause}")
    if problems:
        raise InputError(str(path), problems)
    if not rows:
        raise InputError(str(path), "no item in it; the first is home")
    has_home = VERSIONS[version] and int(rows[0][1][3]) not in FENCE_AND_RALLY_ITEMS
    return _plan(path, rows, has_home=has_home)


def _numbers(words: list[str]) -> list[float]:
    if len(words) < COLUMNS:
        raise ValueError(f"{len(words)} of {COLUMNS} columns: truncated?")
    try:
        numbers = [float(word) for word in words[:COLUMNS]]
    except ValueError as cause:
        raise ValueError(f"{cause}") from None
    if not all(math.isfinite(number) for number in (*numbers[2:4], *numbers[8:11])):
        raise ValueError("frame, command, latitude, longitude and height must be finite")
    for name, number in (("frame", numbers[2]), ("command", numbers[3])):
        if number != int(number) or not 0 <= number <= LARGEST_WHOLE:
            raise ValueError(f"{name} {number:g}; valid: whole, 0 to {LARGEST_WHOLE}")
    return numbers


def _plan(path: Path, rows: list[tuple[str, list[float]]], *, has_home: bool) -> FlightPlan:
    items, home = ItemsRead(), Geodetic(0.0, 0.0, 0.0)
    if has_home:
        place, first = rows[0]
        home = Geodetic(first[8], first[9], first[10])
        try:
            read_geodetic(*home)
        except ValueError as cause:
            items.problems.append(f"{place}: home: {cause}")
    for number, (place, row) in enumerate(rows):
        if number or not has_home:
            params, position = (
                (_read_stated(row[4]), _read_stated(row[5])),
                (row[8], row[9], row[10]),
            )
            items.take(Entry(place, number, int(row[3]), int(row[2]), params, position))
    return plan_of(path, home, items)


def _read_stated(value: float) -> float | None:
    """A parameter; None for nan, which is how files leave one out."""
    return None if math.isnan(value) else value
