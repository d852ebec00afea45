"""Rows of outlines with columns, as GIS files have them, into features: heights as of GeoJSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clearway.base.errors import InputError
from clearway.io.maps.coordinates import Projection
from clearway.io.maps.geojson import (
    BASE,
    GROUND,
    HEIGHT,
    NAMES,
    RADIUS,
    TOP,
    radius_notes,
    read_heights,
    read_length,
)
from clearway.io.maps.map_features import Disc, MapFeature, ParsedMap, Polygon
from clearway.io.maps.rectangles import shapely_or_refuse

KNOWN = (*HEIGHT, *BASE, *TOP, *GROUND, *RADIUS, *NAMES)
SHORT = 10
"""Letters of a column's name in a Shapefile."""
COLUMNS = {name.lower(): name for name in KNOWN} | {
    name.lower()[:SHORT]: name for name in KNOWN if len(name) > SHORT
}
"""Names as files write them, in small letters, perhaps cut: what they mean."""
TOLD = 10


class VectorRow(NamedTuple):
    """One feature of a file."""

    where: str
    """Its place in the file, for errors and as its name where it has none."""
    columns: Mapping[str, Any]
    geometry: Any
    """Of shapely, in the file's reference system; None where there is none."""
    place: Projection


def vector_map(
    path: Path,
    kind: str,
    crs: str,
    rows: Iterable[VectorRow],
    radius_m: float,
    counts: Counter[str],
) -> ParsedMap:
    """Polygons and points that state a height; what else there is is counted.

    radius_m: of points that state none. Raises InputError with every value that cannot be read,
    or where nothing with a height is left.
    """  # fmt: skip
    features: list[MapFeature] = []
    problems: list[str] = []
    tilted = 0
    for row in rows:
        columns = {COLUMNS.get(name.lower(), name): value for name, value in row.columns.items()}
        try:
            span = read_heights(columns)
            radius = read_length(columns, RADIUS) or radius_m
        except ValueError as cause:
            problems.append(f"{row.where}: {str(cause).removeprefix('properties.')}")
            if len(problems) == TOLD:
                break
            continue
        if row.geometry is None or row.geometry.is_empty:
            counts["no geometry"] += 1
        elif isinstance(span, str):
            counts[span] += 1
        else:
            name = str(next((columns[key] for key in NAMES if columns.get(key)), row.where))
            outlines = _outlines(row, radius, counts)
            tilted += bool(outlines) and bool(row.geometry.has_z)
            features += [MapFeature(name, outline, *span) for outline in outlines]
    if problems:
        raise InputError(str(path), problems)
    if not features:
        told = ", ".join(f"{count} {reason}" for reason, count in counts.items())
        raise InputError(
            str(path),
            f"no polygon or point with a height in it (left out: {told or 'nothing'}); valid "
            f"columns: {', '.join(HEIGHT + TOP)}",
        )
    notes = (f"{tilted} outlines have heights at their corners, which are not read",)
    return ParsedMap(
        kind, crs, tuple(features), counts=dict(counts),
        notes=(*radius_notes(features, radius_m), *(notes if tilted else ())),
    )  # fmt: skip


def _outlines(row: VectorRow, radius_m: float, counts: Counter[str]) -> list[Disc | Polygon]:
    """Outlines of a geometry, however it nests them; lines are counted."""
    shapely = shapely_or_refuse("outlines of buildings")
    found: list[Disc | Polygon] = []
    for part in shapely.get_parts(shapely.get_parts([row.geometry])):
        if part.geom_type == "Polygon":
            rings = [shapely.get_coordinates(ring) for ring in shapely.get_rings(part)]
            found.append(Polygon(tuple(row.place.latitude_longitude(ring[:-1]) for ring in rings)))
        elif part.geom_type == "Point":
            at = np.array([[part.x, part.y]])
            latitude, longitude = row.place.latitude_longitude(at)[0]
            found.append(Disc(float(latitude), float(longitude), radius_m))
        else:
            counts[f"{part.geom_type}: no outline"] += 1
    return found
