"""Fence (.fen) and rally (.ral) files of ArduPilot's ground stations: limits, not missions."""

from __future__ import annotations

from pathlib import Path

from clearway.base.errors import InputError
from clearway.io.maps.map_features import Geodetic
from clearway.io.plans.flight_plan import NO_HOME, FlightPlan
from clearway.io.plans.plan_items import read_geodetic
from clearway.io.plans.plan_limits import polygon_fence
from clearway.io.plans.waypoint_file import list_written_lines

MOST_TOLD = 10


def read_fence(path: Path) -> FlightPlan:
    """The fence in a file of `latitude longitude` lines: a place to return to, then the corners."""
    places = _rows(path, ("latitude", "longitude"))
    try:
        corners = [list(place[:2]) for place in places[1:]]
        fence = polygon_fence(0, corners, inclusion=True)
    except ValueError as cause:
        raise InputError(
            str(path), f"{cause}; valid: a place to return to, then the corners, one a line"
        ) from cause
    counts = {"place to return to of the fence": 1}
    return FlightPlan(str(path), path.stem, NO_HOME, (), fences=(fence,), counts=counts)


def read_rally(path: Path) -> FlightPlan:
    """The rally points in a file of `RALLY latitude longitude height ...` lines."""
    points = _rows(path, ("RALLY", "latitude", "longitude", "height"))
    return FlightPlan(str(path), path.stem, NO_HOME, (), rally=tuple(points))


def _rows(path: Path, columns: tuple[str, ...]) -> list[Geodetic]:
    """The place in every line; InputError naming the lines that have none."""
    found, problems = [], []
    for place, line in list_written_lines(path):
        words = line.split()
        try:
            if len(words) < len(columns):
                raise ValueError(f"{len(words)} of {len(columns)} columns")
            if columns[0].isupper() and words.pop(0) != columns[0]:
                raise ValueError(f"does not begin with {columns[0]}")
            latitude, longitude, height = (float(word) for word in [*words, "0"][:3])
            found.append(read_geodetic(latitude, longitude, height if len(columns) > 2 else 0.0))
        except ValueError as cause:
            problems.append(f"{place}: {cause}; valid: {' '.join(columns)}")
    if problems or not found:
        raise InputError(str(path), problems[:MOST_TOLD] or f"no {' '.join(columns)} in it")
    return found
