"""GeoJSON outlines and points with heights: buildings, masts, whatever stands on the ground."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M
from clearway.io.foreign import Foreign, position_of, rings_of
from clearway.io.maps.map_features import Disc, Height, MapFeature, ParsedMap, Polygon
from clearway.io.toml import MOST_PRINTED_PROBLEMS, each_parsed, parse_model

HEIGHT = ("height_m", "height", "measuredHeight", "building:height")
BASE = ("min_height_m", "min_height", "base_m")
TOP = ("top_m", "elevation_top", "amsl_m")
GROUND = ("ground_m", "ground_elevation")
RADIUS = ("radius_m", "radius")
UNITS: Mapping[str, float] = {
    "": 1.0, "m": 1.0, "metres": 1.0, "meters": 1.0, "ft": FOOT_M, "feet": FOOT_M, "'": FOOT_M
}  # fmt: skip
LENGTH = re.compile(
    r"""([-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)\s*(|m|metres|meters|ft|feet|')\s*(?:(\d+)\")?""", re.I
)
"""As OpenStreetMap has them: 12, 12 m, 40 ft, 40'6"."""
INCH_M = FOOT_M / 12.0
LONGEST_M = 1e5
WGS84 = re.compile(r"CRS:?84|EPSG:+(4326|4979|4258)$|WGS ?84$", re.IGNORECASE)
NAMES = ("name", "id", "identifier")


class Geometry(Foreign):
    type: str
    coordinates: Any = None
    geometries: tuple[Geometry, ...] = ()


class Feature(Foreign):
    id: Any = None
    geometry: Geometry | None = None
    properties: dict[str, Any] | None = None


class NamedCrs(Foreign):
    properties: dict[str, Any]


class Collection(Foreign):
    features: list[Any]
    """Each a Feature: parsed one by one, since there may be millions."""
    crs: NamedCrs | None = None
    """Of files older than RFC 7946; since then all are in WGS 84."""


def read_geojson(path: Path, data: Mapping[str, Any], radius_m: float) -> ParsedMap:
    """Polygons and points that state a height in their properties, in metres unless they say feet.

    Heights above ground: `height_m` or `height`, from `min_height` up; above sea level: `top_m`,
    from `ground_m` up. radius_m: of points that state none. Raises InputError with every geometry
    that cannot be read, and for coordinates that are not of WGS 84.
    """
    if data.get("type") == "Feature":
        data = {"features": [data]}
    collection = parse_model(str(path), data, Collection)
    _check_crs(path, collection.crs)
    features: list[MapFeature] = []
    counts: dict[str, int] = {}
    problems: list[str] = []
    for number, part in each_parsed(str(path), "features", collection.features, Feature):
        properties = part.properties or {}
        try:
            span = read_heights(properties)
            outlines, skipped = _outlines(part.geometry, properties, radius_m)
        except ValueError as cause:
            problems.append(f"features[{number}]: {cause}")
            if len(problems) == MOST_PRINTED_PROBLEMS:
                break
            continue
        reason = skipped if isinstance(span, tuple) else span
        if reason:
            counts[reason] = counts.get(reason, 0) + 1
        if isinstance(span, tuple):
            name = _name(part, properties, number)
            features.extend(MapFeature(name, outline, *span) for outline in outlines)
    if problems:
        raise InputError(str(path), problems)
    if not features:
        left_out = ", ".join(f"{count} {reason}" for reason, count in counts.items())
        raise InputError(
            str(path),
            f"no polygon or point with a height in it (left out: {left_out or 'nothing'}); "
            f"valid properties: {', '.join(HEIGHT + TOP)}",
        )
    return ParsedMap(
        kind="GeoJSON",
        crs="WGS 84 latitude and longitude",
        features=tuple(features),
        counts=counts,
        notes=radius_notes(features, radius_m),
    )


def _check_crs(path: Path, crs: NamedCrs | None) -> None:
    name = "" if crs is None else str(crs.properties.get("name", ""))
    if name and not WGS84.search(name):
        raise InputError(
            str(path),
            f"coordinates in {name}; valid: longitude and latitude of WGS 84 "
            "(`ogr2ogr -t_srs EPSG:4326` converts them)",
        )


def radius_notes(features: Sequence[MapFeature], radius_m: float) -> tuple[str, ...]:
    """What is assumed of mere points."""
    if any(isinstance(feature.outline, Disc) for feature in features):
        return (f"points without a radius stand for {radius_m:g} m around them",)
    return ()


def _name(part: Feature, properties: Mapping[str, Any], number: int) -> str:
    named = next((properties[key] for key in NAMES if properties.get(key)), part.id)
    return f"feature {number}" if named is None else str(named)


def read_heights(properties: Mapping[str, Any]) -> tuple[Height, Height] | str:
    """From where to where a feature stands, or why it does not stand.

    Raises ValueError for a property that should be a length and is none.
    """
    height, top = read_length(properties, HEIGHT), read_length(properties, TOP)
    ground = read_length(properties, GROUND)
    if top is not None:
        low = Height(ground, "sea level") if ground is not None else Height(0.0, "ground")
        return low, Height(top, "sea level")
    if height is None:
        return "no height"
    base = read_length(properties, BASE) or 0.0
    if not height > base:
        return "height not above its base"
    if ground is not None:
        return Height(ground + base, "sea level"), Height(ground + height, "sea level")
    return Height(base, "ground"), Height(height, "ground")


def read_length(properties: Mapping[str, Any], names: tuple[str, ...]) -> float | None:
    """Metres of the first of these properties that is there; ValueError where it is no length."""
    for name in names:
        value = properties.get(name)
        if value is None or value == "":
            continue
        found = LENGTH.fullmatch(str(value).strip())
        if found is None:
            raise ValueError(
                f"properties.{name}: {value!r} is no length; valid: a number of metres, or with a "
                f"unit, {', '.join(unit for unit in UNITS if unit)}"
            )
        length = float(found[1]) * UNITS[found[2].lower()] + float(found[3] or 0.0) * INCH_M
        if not abs(length) < LONGEST_M:
            raise ValueError(f"properties.{name}: {value!r} is out of range")
        return length
    return None


def _outlines(
    geometry: Geometry | None, properties: Mapping[str, Any], radius_m: float
) -> tuple[list[Disc | Polygon], str]:
    """Outlines of a geometry and why it has none, which is empty if it has."""
    if geometry is None:
        return [], "no geometry"
    coordinates = geometry.coordinates
    radius = read_length(properties, RADIUS) or radius_m
    if radius < 0.0:
        raise ValueError(f"radius {radius:g} m is below 0")
    match geometry.type:
        case "Polygon":
            return [Polygon(rings_of(coordinates))], ""
        case "MultiPolygon" if isinstance(coordinates, list):
            return [Polygon(rings_of(part)) for part in coordinates], ""
        case "Point":
            return [Disc(*position_of(coordinates), radius)], ""
        case "MultiPoint" if isinstance(coordinates, list):
            return [Disc(*position_of(part), radius) for part in coordinates], ""
        case "GeometryCollection":
            parts = [_outlines(part, properties, radius_m) for part in geometry.geometries]
            found = [outline for outlines, _ in parts for outline in outlines]
            return found, next((reason for _, reason in parts if reason), "")
    return [], f"{geometry.type}: no outline"
