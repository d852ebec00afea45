"""GeoJSON outlines and points with heights: buildings, masts, whatever stands on the ground."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from clearway.errors import InputError
from clearway.io.foreign import Foreign, position_of, rings_of
from clearway.io.map_features import Disc, Height, MapFeature, ParsedMap, Polygon
from clearway.io.toml import parse_model

HEIGHT = ("height_m", "height", "measuredHeight", "building:height")
BASE = ("min_height_m", "min_height", "base_m")
TOP = ("top_m", "elevation_top", "amsl_m")
GROUND = ("ground_m", "ground_elevation")
RADIUS = ("radius_m", "radius")
NAMES = ("name", "id", "identifier")


class Geometry(Foreign):
    type: str
    coordinates: Any = None
    geometries: tuple[Geometry, ...] = ()


class Feature(Foreign):
    id: Any = None
    geometry: Geometry | None = None
    properties: dict[str, Any] | None = None


class Collection(Foreign):
    features: tuple[Feature, ...]


def read_geojson(path: Path, data: Mapping[str, Any], radius_m: float) -> ParsedMap:
    """Polygons and points that state a height in their properties, in metres.

    Heights above ground: `height_m` or `height`, from `min_height` up; above sea level: `top_m`,
    from `ground_m` up. radius_m: of points that state none. Raises InputError with every geometry
    that cannot be read.
    """
    collection = parse_model(str(path), data, Collection)
    features: list[MapFeature] = []
    counts: dict[str, int] = {}
    problems: list[str] = []
    for number, part in enumerate(collection.features):
        properties = part.properties or {}
        try:
            span = _span(properties)
            outlines, skipped = _outlines(part.geometry, properties, radius_m)
        except ValueError as cause:
            problems.append(f"features[{number}]: {cause}")
            continue
        reason = "no height" if span is None else skipped
        if span is None or reason:
            counts[reason] = counts.get(reason, 0) + 1
        if span is not None:
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
        notes=_notes(features, radius_m),
    )


def _notes(features: list[MapFeature], radius_m: float) -> tuple[str, ...]:
    if any(isinstance(feature.outline, Disc) for feature in features):
        return (f"points without a radius stand for {radius_m:g} m around them",)
    return ()


def _name(part: Feature, properties: Mapping[str, Any], number: int) -> str:
    named = next((properties[key] for key in NAMES if properties.get(key)), part.id)
    return f"feature {number}" if named is None else str(named)


def _span(properties: Mapping[str, Any]) -> tuple[Height, Height] | None:
    """From where to where a feature stands; None if it states no height."""
    height, top = _number(properties, HEIGHT), _number(properties, TOP)
    ground = _number(properties, GROUND)
    if top is not None:
        low = Height(ground, "sea level") if ground is not None else Height(0.0, "ground")
        return low, Height(top, "sea level")
    if height is None:
        return None
    base = _number(properties, BASE) or 0.0
    if not height > base:
        raise ValueError(f"height {height:g} m is not above its base, {base:g} m")
    if ground is not None:
        return Height(ground + base, "sea level"), Height(ground + height, "sea level")
    return Height(base, "ground"), Height(height, "ground")


def _number(properties: Mapping[str, Any], names: tuple[str, ...]) -> float | None:
    for name in names:
        value = properties.get(name)
        if value is None or value == "":
            continue
        try:
            return float(str(value).removesuffix("m").strip())
        except ValueError:
            raise ValueError(f"properties.{name}: {value!r} is no number of metres") from None
    return None


def _outlines(
    geometry: Geometry | None, properties: Mapping[str, Any], radius_m: float
) -> tuple[list[Disc | Polygon], str]:
    """Outlines of a geometry and why it has none, which is empty if it has."""
    if geometry is None:
        return [], "no geometry"
    coordinates = geometry.coordinates
    radius = _number(properties, RADIUS) or radius_m
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
