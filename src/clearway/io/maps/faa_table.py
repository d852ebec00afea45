"""The digital obstacle file of the FAA as a table (DOF.CSV): degrees, feet above ground and sea."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M
from clearway.io.maps.faa_obstacles import (
    DISMANTLED,
    HORIZONTAL_M,
    VERTICAL_M,
    faa_map,
    grow_by_accuracy,
)
from clearway.io.maps.map_features import MapFeature, ParsedMap

NEEDED = ("latdec", "londec", "agl", "amsl")


def is_faa_table(names: Sequence[str]) -> bool:
    """Whether these columns, in small letters, are the FAA's."""
    return set(NEEDED) <= set(names)


def read_faa_table(path: Path, rows: Sequence[Sequence[str]], radius_m: float) -> ParsedMap:
    """As `read_faa_obstacles`, of the rows of a table whose first one names the columns."""
    names = [name.strip().lower() for name in rows[0]]
    features: list[MapFeature] = []
    problems: list[str] = []
    counts: dict[str, int] = {}
    unknown = 0
    for line, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        try:
            if len(row) < len(names):
                raise ValueError(f"{len(row)} of {len(names)} columns: truncated?")
            cells = dict(zip(names, (cell.strip() for cell in row), strict=False))
            if cells.get("action") == DISMANTLED:
                counts["dismantled"] = counts.get("dismantled", 0) + 1
                continue
            features.append(_feature(cells, radius_m))
        except ValueError as cause:
            problems.append(f"line {line}: {cause}")
            continue
        across, up = _accuracy(cells)
        unknown += across not in HORIZONTAL_M or up not in VERTICAL_M
    if problems:
        raise InputError(str(path), problems)
    return faa_map(features, counts, radius_m, unknown)


def _feature(cells: dict[str, str], radius_m: float) -> MapFeature:
    numbers = {}
    for name in NEEDED:
        try:
            numbers[name] = float(cells[name])
        except ValueError:
            raise ValueError(f"{name} is no number: {cells[name]!r}") from None
    for name, limit in (("latdec", 90.0), ("londec", 180.0)):
        if not abs(numbers[name]) <= limit:
            raise ValueError(f"{name} {numbers[name]:g} is not within +-{limit:g} degrees")
    oas, kind, city = (cells.get(name, "") for name in ("oas", "type", "city"))
    return grow_by_accuracy(
        f"{oas} {kind}, {city}",
        (numbers["latdec"], numbers["londec"]),
        (numbers["agl"] * FOOT_M, numbers["amsl"] * FOOT_M),
        _accuracy(cells),
        radius_m,
    )


def _accuracy(cells: dict[str, str]) -> tuple[str, str]:
    """Codes across and up."""
    code = cells.get("accuracy", "").ljust(2)
    return code[0], code[1]
