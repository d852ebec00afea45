"""GeoPackages (.gpkg): SQLite tables of features, whose outlines are WKB after a small head."""

from __future__ import annotations

import sqlite3
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from clearway.base.errors import InputError
from clearway.io.maps.coordinates import Projection, projection
from clearway.io.maps.map_features import ParsedMap
from clearway.io.maps.rectangles import shapely_or_refuse
from clearway.io.maps.vector_features import VectorRow, vector_map
from clearway.io.sqlite_file import INTERRUPTED, open_sqlite, query_rows

MAGIC = b"GP"
HEAD = 8
ENVELOPES = (0, 32, 48, 48, 64)
"""Bytes, by three bits of the head's flags."""
DAMAGED = "geometry that cannot be read"


class FeatureTable(NamedTuple):
    """A table of features."""

    name: str
    column: str
    """With the geometry."""
    place: Projection


def read_geopackage(path: Path, radius_m: float) -> ParsedMap:
    """All tables of features, each in its own reference system; errors as of `vector_map`."""
    shapely_or_refuse(f"reading {path}")
    with open_sqlite(path) as base:
        base.text_factory = lambda data: data.decode("utf-8", "replace")
        tables = _tables(path, base)
        counts: Counter[str] = Counter()
        rows = (row for table in tables for row in _rows(path, base, table, counts))
        names = ", ".join(table.name for table in tables)
        parsed = vector_map(
            path, f"GeoPackage, {names}", ", ".join(dict.fromkeys(t.place.name for t in tables)),
            rows, radius_m, counts,
        )  # fmt: skip
    if counts[DAMAGED] > len(parsed.features):
        raise InputError(str(path), f"damaged: {counts[DAMAGED]} geometries cannot be read")
    return parsed


def _tables(path: Path, base: sqlite3.Connection) -> list[FeatureTable]:
    try:
        rows = base.execute(
            "SELECT g.table_name, g.column_name, s.organization, s.organization_coordsys_id, "
            "s.definition FROM gpkg_geometry_columns g "
            "LEFT JOIN gpkg_spatial_ref_sys s ON s.srs_id = g.srs_id ORDER BY g.table_name"
        )
        found = list(query_rows(path, rows))
    except sqlite3.OperationalError as cause:
        if INTERRUPTED in str(cause):
            raise
        raise InputError(
            str(path), f"no GeoPackage with features: {cause}; a robot recording is for --scan"
        ) from cause
    if not found:
        raise InputError(str(path), "no table of features in it (gpkg_geometry_columns is empty)")
    tables = []
    for name, column, organization, number, definition in found:
        known = str(organization).upper() == "EPSG"
        if not known and str(definition or "undefined") == "undefined":
            raise InputError(
                str(path),
                f"table {name}: no reference system; valid: one of EPSG, or its WKT "
                "(`ogr2ogr -a_srs EPSG:25832` states it)",
            )
        stated = f"EPSG:{number}" if known else definition
        tables.append(FeatureTable(str(name), str(column), projection(path, stated)))
    return tables


def _rows(
    path: Path, base: sqlite3.Connection, table: FeatureTable, counts: Counter[str]
) -> Iterator[VectorRow]:
    shapely = shapely_or_refuse(f"reading {path}")
    cursor = base.execute(f"SELECT * FROM {_quote(table.name)}")
    columns = [str(one[0]) for one in cursor.description]
    if table.column not in columns:
        raise InputError(str(path), f"table {table.name}: no column {table.column!r}")
    for number, values in enumerate(query_rows(path, cursor), start=1):
        told = dict(zip(columns, values, strict=True))
        blob = told.pop(table.column)
        geometry = None if blob is None else _geometry(shapely, blob)
        if blob is not None and geometry is None:
            counts[DAMAGED] += 1
            continue
        yield VectorRow(f"{table.name} row {number}", told, geometry, table.place)


def _quote(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _geometry(shapely: Any, blob: Any) -> Any:
    """A geometry of shapely; None where the bytes are none."""
    if not isinstance(blob, bytes) or blob[:2] != MAGIC or len(blob) < HEAD:
        return None
    envelope = (blob[3] >> 1) & 7
    if envelope >= len(ENVELOPES):
        return None
    return shapely.from_wkb(blob[HEAD + ENVELOPES[envelope] :], on_invalid="ignore")
