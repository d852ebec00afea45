"""The digital obstacle file of the FAA: 128 columns a record, degrees, feet above ground and sea.

Columns after the FAA's description of the file (DOF README), counted from 0 here. A position is
good to the accuracy that its record states, so an obstacle grows by that much.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M, NAUTICAL_MILE_M
from clearway.io.foreign import read_text
from clearway.io.maps.map_features import Disc, Height, MapFeature, ParsedMap
from clearway.io.maps.plausible import feature_problem

RECORD = re.compile(r"[0-9A-Z]{2}-\d{6}")
"""States have numbers, other countries letters."""
HEADER = re.compile(r"\s*CURRENCY DATE|\s*LATITUDE\s+LONGITUDE|OAS#|\s{20}|-{20}")
"""Lines above the records, which stand in the midst where files were put together."""
LEAST_COLUMNS = 127
HORIZONTAL_M = {
    "1": 20 * FOOT_M,
    "2": 50 * FOOT_M,
    "3": 100 * FOOT_M,
    "4": 250 * FOOT_M,
    "5": 500 * FOOT_M,
    "6": 1000 * FOOT_M,
    "7": 0.5 * NAUTICAL_MILE_M,
    "8": NAUTICAL_MILE_M,
}
"""Horizontal accuracy by its code; 9 is unknown."""
VERTICAL_M = {
    "A": 3 * FOOT_M,
    "B": 10 * FOOT_M,
    "C": 20 * FOOT_M,
    "D": 50 * FOOT_M,
    "E": 125 * FOOT_M,
    "F": 250 * FOOT_M,
    "G": 500 * FOOT_M,
    "H": 1000 * FOOT_M,
}
"""Vertical accuracy by its code; I is unknown."""
DISMANTLED = "D"


def read_faa_obstacles(path: Path, radius_m: float) -> ParsedMap:
    """Obstacles of a digital obstacle file, grown by the accuracy that each record states.

    radius_m: of the obstacle itself, which the file does not tell. Records of dismantled obstacles
    are left out. Raises InputError with every bad line.
    """
    features: list[MapFeature] = []
    problems: list[str] = []
    counts: dict[str, int] = {}
    unknown = 0
    for line, record in enumerate(read_text(path, western=True).splitlines(), start=1):
        if not record.strip() or not (RECORD.match(record) or features or counts):
            continue
        if HEADER.match(record):
            continue
        try:
            if not RECORD.match(record) or len(record) < LEAST_COLUMNS:
                raise ValueError(f"{len(record)} of 128 columns: truncated?")
            if record[118] == DISMANTLED:
                counts["dismantled"] = counts.get("dismantled", 0) + 1
                continue
            features.append(_feature(record, radius_m))
            unknown += record[97] not in HORIZONTAL_M or record[99] not in VERTICAL_M
        except ValueError as cause:
            problems.append(f"line {line}: {cause}")
    if problems:
        raise InputError(str(path), problems)
    if not features and not counts:
        raise InputError(
            str(path),
            "no record of a digital obstacle file in it; "
            "valid: 128 columns that begin with a number such as 01-001307",
        )
    return faa_map(features, counts, radius_m, unknown)


def faa_map(
    features: Sequence[MapFeature], counts: Mapping[str, int], radius_m: float, unknown: int
) -> ParsedMap:
    """The map of a file's records; unknown: how many of them state no accuracy."""
    notes = [
        f"no radius in the file: {radius_m:g} m assumed, plus the stated horizontal accuracy; "
        "tops are raised by the vertical one"
    ]
    if unknown:
        notes.append(f"{unknown} records state no accuracy: not grown by it")
    return ParsedMap(
        kind="FAA digital obstacle file",
        crs="WGS 84 latitude and longitude",
        features=tuple(features),
        counts=counts,
        notes=tuple(notes),
    )


def _feature(record: str, radius_m: float) -> MapFeature:
    latitude = _angle(record[35:37], record[38:40], record[41:46], record[46], "NS", 90.0)
    longitude = _angle(record[48:51], record[52:54], record[55:60], record[60], "EW", 180.0)
    above_ground = _number("height above ground", record[83:88]) * FOOT_M
    top = _number("height above sea level", record[89:94]) * FOOT_M
    name = f"{record[0:9]} {record[62:80].strip()}, {record[18:34].strip()}"
    accuracy = (record[97], record[99])
    return grow_by_accuracy(name, (latitude, longitude), (above_ground, top), accuracy, radius_m)


def grow_by_accuracy(
    name: str,
    place_deg: tuple[float, float],
    heights_m: tuple[float, float],
    accuracy: tuple[str, str],
    radius_m: float,
) -> MapFeature:
    """An obstacle grown by its accuracy codes (across, up); heights above ground and sea level."""
    above_ground, top = heights_m
    if not above_ground > 0.0:
        raise ValueError(f"height above ground {above_ground / FOOT_M:g} ft is not above 0")
    across, up = accuracy
    feature = MapFeature(
        name,
        Disc(*place_deg, radius_m + HORIZONTAL_M.get(across, 0.0)),
        Height(top - above_ground, "sea level"),
        Height(top + VERTICAL_M.get(up, 0.0), "sea level"),
    )
    problem = feature_problem(feature)
    if problem is not None:
        raise ValueError(problem)
    return feature


def _angle(
    degrees: str, minutes: str, seconds: str, hemisphere: str, signs: str, limit: float
) -> float:
    name = "latitude" if limit == 90.0 else "longitude"
    if hemisphere not in signs:
        raise ValueError(f"{name}: hemisphere {hemisphere!r} is none of {signs[0]}, {signs[1]}")
    angle = _number(name, degrees) + _number(name, minutes) / 60.0 + _number(name, seconds) / 3600.0
    if not angle <= limit:
        raise ValueError(f"{name} {angle:g} is not within +-{limit:g} degrees")
    return angle if hemisphere in "NE" else -angle


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{name} is no number: {text!r}") from None
