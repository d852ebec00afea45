"""Shapefiles (.shp with .dbf and .prj beside it) through pyshp."""

from __future__ import annotations

import logging
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from clearway.base.errors import InputError, MissingExtraError, naming
from clearway.io.foreign_errors import damage_told
from clearway.io.maps.coordinates import Projection, projection
from clearway.io.maps.map_features import ParsedMap, as_stated
from clearway.io.maps.rectangles import shapely_or_refuse
from clearway.io.maps.vector_features import VectorRow, vector_map

LONGEST_PRJ = 20_000
LONGEST_NOTE = 160
DAMAGED = "geometry that cannot be read"


def read_shapefile(path: Path, radius_m: float, crs: str | None) -> ParsedMap:
    """Polygons and points with columns; errors as of `vector_map`.

    crs: reference system where there is no .prj. Raises MissingExtraError without pyshp.
    """
    try:
        import shapefile
    except ImportError as cause:
        raise MissingExtraError(f"reading {path}", "map") from cause
    place = _place(path, crs)
    counts: Counter[str] = Counter()
    complaints = (shapefile.ShapefileException, shapefile.GeoJSON_Error)
    with damage_told(path, "Shapefile", complaints), warnings.catch_warnings(record=True) as odd:
        warnings.simplefilter("always")
        with _open_reader(path, shapefile) as reader:
            kind = f"Shapefile of {reader.shapeTypeName.lower()}s"
            rows = _rows(path, reader, place, counts)
            parsed = vector_map(path, kind, place.name, rows, radius_m, counts)
    told = [" ".join(str(one.message).split())[:LONGEST_NOTE] for one in odd]
    if crs is not None and _beside(path, ".prj") is None:
        told.insert(0, as_stated(crs))
    return replace(parsed, notes=(*parsed.notes, *dict.fromkeys(told)))


def _beside(path: Path, suffix: str) -> Path | None:
    """The file of the same name with another suffix, in small or capital letters."""
    both = (path.with_suffix(suffix), path.with_suffix(suffix.upper()))
    return next((one for one in both if one.is_file()), None)


def _place(path: Path, crs: str | None) -> Projection:
    stated = _beside(path, ".prj")
    if stated is not None:
        with naming(stated, "read"):
            return projection(stated, stated.read_text("utf-8", "replace")[:LONGEST_PRJ].strip())
    if crs is None:
        raise InputError(
            str(path),
            f"no {path.stem}.prj beside it, which tells its reference system; state it (--crs "
            "EPSG:25832, `crs` of [map]) if you know it",
        )
    return projection(path, crs)


@contextmanager
def _open_reader(path: Path, shapefile: Any) -> Iterator[Any]:
    """pyshp's reader of files that are opened here: given names, it may ask for web addresses."""
    table = _beside(path, ".dbf")
    if table is None:
        raise InputError(
            str(path), f"no {path.stem}.dbf beside it, which tells the heights of its outlines"
        )
    page = _beside(path, ".cpg")
    encoding = "utf-8" if page is None else page.read_text("ascii", "replace").strip()[:40]
    logging.getLogger("shapefile").setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        with naming(path, "read"):
            shp, dbf = stack.enter_context(path.open("rb")), stack.enter_context(table.open("rb"))
        try:
            "".encode(encoding)
        except LookupError:
            encoding = "utf-8"
        yield stack.enter_context(
            shapefile.Reader(shp=shp, dbf=dbf, encoding=encoding, encodingErrors="replace")
        )


def _rows(path: Path, reader: Any, place: Projection, counts: Counter[str]) -> Iterator[VectorRow]:
    shapely = shapely_or_refuse(f"reading {path}")
    from shapely.geometry import shape

    for number, one in enumerate(reader.iterShapeRecords(), start=1):
        where = f"record {number}"
        if one.record is None:
            counts["deleted record"] += 1
        elif one.shape.shapeTypeName in ("NULL", "MULTIPATCH"):
            counts[f"{one.shape.shapeTypeName.lower()}: no outline"] += 1
        else:
            try:
                geometry = shape(one.shape.__geo_interface__)
            except (ValueError, TypeError, IndexError, shapely.errors.ShapelyError):
                counts[DAMAGED] += 1
                continue
            yield VectorRow(where, one.record.as_dict(), geometry, place)
