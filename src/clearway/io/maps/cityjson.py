"""Buildings of CityJSON models: surfaces seen from above, by height, as outlines with a top.

Whatever the level of detail, an object is filled from its lowest point up to its surfaces, which
are taken in steps of height: a sloping roof becomes a stair that holds it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.io.foreign import Foreign
from clearway.io.maps.coordinates import Projection, projection
from clearway.io.maps.map_features import Height, MapFeature, ParsedMap, Polygon, as_stated
from clearway.io.maps.rectangles import polygons_in, shapely_or_refuse, union_of
from clearway.io.toml import each_parsed, parse_model

GROUND_TYPES = (
    "CityObjectGroup",
    "LandUse",
    "Railway",
    "Road",
    "TINRelief",
    "TransportSquare",
    "WaterBody",
    "Waterway",
)
"""Kinds of objects that are the ground: a terrain file serves for that."""
SURFACES = ("Solid", "MultiSolid", "CompositeSolid", "MultiSurface", "CompositeSurface")
"""Kinds of geometry that are read; points, lines and instances of templates are not."""
STEP_M = 2.0
"""Surfaces whose heights differ by less share a top."""
STANDS_M = 1.0
"""What is no higher above an object's lowest point is the ground."""
FARTHEST_M = 1e8
HIGHEST_M = 1e5
"""Coordinates of projected systems, and heights, are smaller."""
FINEST_LOD = 2.9
"""Windows and door knobs of finer models are left to the LiDAR."""
GAP_M = 2.0
"""Gaps between parts of one object that are narrower are closed."""
NO_AREA_M2 = 1e-4
MOST_SURFACES = 20_000
"""Of one object; those of a cathedral in every detail are fewer."""


class Transform(Foreign):
    """Of the integers that vertices are stored as."""

    scale: tuple[float, float, float]
    translate: tuple[float, float, float]


class CityGeometry(Foreign):
    type: str
    lod: float = 1.0
    boundaries: tuple[Any, ...] = ()


class CityObject(Foreign):
    type: str
    geometry: tuple[CityGeometry, ...] = ()


class Metadata(Foreign):
    referenceSystem: str | None = None


class CityFile(Foreign):
    transform: Transform = Transform(scale=(1.0, 1.0, 1.0), translate=(0.0, 0.0, 0.0))
    """Version 1.0 need not have it."""
    CityObjects: dict[str, Any]
    """Each a CityObject: parsed one by one, since there may be millions."""
    vertices: list[Any]
    """Each three numbers."""
    metadata: Metadata = Metadata()


def read_cityjson(path: Path, data: Mapping[str, Any], crs: str | None = None) -> ParsedMap:
    """Objects that stand above the ground, with outlines of the model's reference system.

    data: the object in the file. crs: of a file that states none. Raises InputError for a model
    that is not one, vertices that do not exist, or no reference system; MissingExtraError without
    pyproj or shapely.
    """
    city = parse_model(str(path), data, CityFile)
    stated = city.metadata.referenceSystem or crs
    if stated is None:
        raise InputError(
            str(path),
            "metadata.referenceSystem: missing, but needed to place the model; state it beside the "
            "file (--crs EPSG:7415, `crs` of [map]) if you know it",
        )
    place = projection(path, stated)
    if place.across_m is None:
        raise InputError(
            str(path),
            f"coordinates are in {place.unit}s of no plane (CRS {place.name}); valid: a projected "
            "reference system, in metres or feet",
        )
    vertices = _numbers_of(path, city.vertices)
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = vertices * city.transform.scale + city.transform.translate
    vertices *= [place.across_m, place.across_m, place.up_m or place.across_m]
    _check_vertices(path, vertices)
    features: list[MapFeature] = []
    counts: dict[str, int] = {}
    for name, part in each_parsed(str(path), "CityObjects", city.CityObjects, CityObject):
        if part.type in GROUND_TYPES:
            reason = f"{part.type}: ground"
        else:
            found = _features(path, name, part, vertices, place)
            features.extend(found)
            reason = "" if found else _why_none(part)
        if reason:
            counts[reason] = counts.get(reason, 0) + 1
    if not features:
        raise InputError(str(path), "no object that stands above the ground in it")
    return ParsedMap(
        kind=f"CityJSON of {len(city.CityObjects)} objects",
        crs=place.name,
        features=tuple(features),
        counts=counts,
        notes=(*_notes(place), *([] if city.metadata.referenceSystem else [as_stated(str(crs))])),
    )


def _numbers_of(path: Path, vertices: list[Any]) -> FloatArray:
    """[n, 3] as they are stored; InputError naming the first that is not three numbers."""
    try:
        numbers = np.array(vertices, dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        numbers = np.zeros(0)
    if numbers.shape == (len(vertices), 3) or not vertices:
        return numbers.reshape(-1, 3)
    number = next((n for n, one in enumerate(vertices) if not _is_vertex(one)), 0)
    raise InputError(
        str(path),
        f"vertices[{number}]: three numbers are needed, got {str(vertices[number])[:60]}",
    )


def _is_vertex(value: object) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(_is_number, value))


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _notes(place: Projection) -> tuple[str, ...]:
    note = f"surfaces within {STEP_M:g} m of height share a top, objects are solid below"
    if place.up_m is None and place.across_m != 1.0:
        return (note, f"no unit of heights in the reference system: {place.unit} assumed")
    return (note,)


def _check_vertices(path: Path, vertices: FloatArray) -> None:
    """Refuse what lies off the Earth: heights are gone through in steps."""
    far = np.abs(vertices) > [FARTHEST_M, FARTHEST_M, HIGHEST_M]
    bad = np.flatnonzero(far.any(axis=1) | ~np.isfinite(vertices).all(axis=1))
    if len(bad):
        x, y, z = vertices[bad[0]]
        raise InputError(
            str(path),
            f"vertices[{bad[0]}]: {x:g}, {y:g}, {z:g} m is no place on Earth; "
            f"{len(bad)} of {len(vertices)} are none",
        )


def _why_none(part: CityObject) -> str:
    if not any(geometry.boundaries for geometry in part.geometry):
        return f"{part.type}: no geometry of its own"
    kinds = {geometry.type for geometry in part.geometry}
    if kinds.isdisjoint(SURFACES):
        return f"{part.type}: {', '.join(sorted(kinds))} instead of surfaces"
    return f"{part.type}: no higher than {STANDS_M:g} m above its lowest point"


def _features(
    path: Path, name: str, part: CityObject, vertices: FloatArray, place: Projection
) -> list[MapFeature]:
    """Outlines of one object, each with its top."""
    geometries = [one for one in part.geometry if one.boundaries and one.type in SURFACES]
    if not geometries:
        return []
    fine = [geometry for geometry in geometries if geometry.lod <= FINEST_LOD]
    chosen = max(fine, key=lambda one: one.lod) if fine else geometries[0]
    try:
        rings = list(islice(_faces(chosen.boundaries, len(vertices)), MOST_SURFACES + 1))
        if len(rings) > MOST_SURFACES:
            raise ValueError(f"more than {MOST_SURFACES:,} surfaces; valid: several objects")
        faces = [vertices[face] for face in rings]
    except ValueError as cause:
        raise InputError(str(path), f"CityObjects.{name}: {cause}") from cause
    if not faces:
        return []
    across_m = place.across_m or 1.0
    low = Height(min(float(face[:, 2].min()) for face in faces), "sea level")
    return [
        MapFeature(
            f"{part.type} {name}",
            Polygon(tuple(place.latitude_longitude(ring / across_m) for ring in rings)),
            low,
            Height(top, "sea level"),
        )
        for top, rings in _tops(faces, low.value_m)
    ]


def _faces(boundaries: Sequence[Any], count: int) -> Iterator[npt.NDArray[np.int64]]:
    """Outer rings of all surfaces, however deeply shells and solids nest them."""
    for part in boundaries:
        if not isinstance(part, list) or not part:
            raise ValueError("boundaries: lists of vertex numbers are needed")
        if isinstance(part[0], list) and part[0] and isinstance(part[0][0], int):
            wrong = [n for n in part[0] if not (isinstance(n, int) and 0 <= n < count)]
            if wrong:
                raise ValueError(f"boundaries: vertex {wrong[0]!r}, but there are {count}")
            if len(part[0]) >= 3:
                yield np.array(part[0], dtype=np.int64)
        else:
            yield from _faces(part, count)


def _tops(faces: list[FloatArray], low_m: float) -> Iterator[tuple[float, list[FloatArray]]]:
    """(top, rings of x, y) from the highest down; outlines grow on the way, so that each is simple.

    What a higher one covers already is covered again, which changes nothing.
    """
    shapely = shapely_or_refuse("outlines of buildings")
    tops = np.array([face[:, 2].max() for face in faces])
    flats = shapely.make_valid(np.array([shapely.Polygon(face[:, :2]) for face in faces]))
    outline = shapely.Polygon()
    while len(tops) and tops.max() > low_m + STANDS_M:
        top = float(tops.max())
        group = tops > top - STEP_M
        outline = _close_outline(shapely, union_of(shapely, [outline, *flats[group]]))
        for piece in polygons_in(shapely, outline):
            if piece.area > NO_AREA_M2:
                yield top, [shapely.get_coordinates(ring) for ring in shapely.get_rings(piece)]
        tops, flats = tops[~group], flats[~group]


def _close_outline(shapely: ModuleType, outline: Any) -> Any:
    """The outline with gaps and notches closed that no vehicle fits into."""
    wide = shapely.buffer(outline, 0.5 * GAP_M, join_style="mitre", mitre_limit=2.0)
    narrow = shapely.buffer(wide, -0.5 * GAP_M, join_style="mitre", mitre_limit=2.0)
    return union_of(shapely, [narrow, outline])
