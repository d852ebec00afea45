"""Zones of the airspace in ED-269, the predecessor of ED-318."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from clearway.io.foreign import Foreign, position_of, rings_of
from clearway.io.maps.geozones import (
    Applicability,
    Reference,
    limits_of,
    parse_zones,
    periods_of,
    radius_of,
)
from clearway.io.maps.map_features import Disc, MapFeature, ParsedMap, Polygon, ZoneFeature
from clearway.io.toml import MOST_PRINTED_PROBLEMS, each_parsed


class Ed269Projection(Foreign):
    type: str
    coordinates: Any = None
    center: Any = None
    radius: float | None = None


class Volume(Foreign):
    """Outline and limits of ED-269, whose numbers may be text."""

    uomDimensions: str = "M"
    lowerLimit: float | None = None
    lowerVerticalReference: Reference = "AGL"
    upperLimit: float | None = None
    upperVerticalReference: Reference = "AGL"
    horizontalProjection: Ed269Projection


class OldZone(Foreign):
    identifier: str = ""
    name: str | None = None
    restriction: str
    applicability: tuple[Applicability, ...] | None = None
    geometry: tuple[Volume, ...]


def is_ed269(data: Mapping[str, Any]) -> bool:
    """Whether an object has zones of ED-269: a list of them, or features that are no GeoJSON."""
    features = data.get("features")
    return "UASZoneList" in data or (
        isinstance(features, list)
        and any(isinstance(part, dict) and "restriction" in part for part in features)
    )


def read_ed269(path: Path, data: Mapping[str, Any]) -> ParsedMap:
    """Zones of an ED-269 file with limits and times; InputError with every zone that has none."""
    zones, problems, round_in_feet = [], [], False
    key = "UASZoneList" if "UASZoneList" in data else "features"
    for number, part in each_parsed(str(path), key, data[key], OldZone):
        name = part.name or part.identifier
        round_in_feet = round_in_feet or any(map(_is_round_in_feet, part.geometry))
        try:
            features = tuple(_volume(volume, name) for volume in part.geometry)
            periods = periods_of(part.applicability)
        except ValueError as cause:
            problems.append(f"{key}[{number}] ({part.identifier}): {cause}")
            if len(problems) == MOST_PRINTED_PROBLEMS:
                break
            continue
        zones.append(ZoneFeature(part.identifier, name, part.restriction, periods, features))
    notes: tuple[str, ...] = ()
    if round_in_feet:
        notes = ("radii are taken in metres, also of zones whose limits are in feet",)
    return parse_zones(path, "ED-269 zones", zones, problems, notes)


def _is_round_in_feet(volume: Volume) -> bool:
    return volume.horizontalProjection.type == "Circle" and volume.uomDimensions.upper() == "FT"


def _volume(volume: Volume, name: str) -> MapFeature:
    low, high = limits_of(
        (volume.lowerLimit, volume.lowerVerticalReference),
        (volume.upperLimit, volume.upperVerticalReference),
        volume.uomDimensions,
    )
    across = volume.horizontalProjection
    outline: Disc | Polygon
    if across.type == "Circle":
        outline = Disc(*position_of(across.center), radius_of(across.radius))
    elif across.type == "Polygon":
        outline = Polygon(rings_of(across.coordinates))
    else:
        raise ValueError(f"outline of type {across.type}; valid: Polygon, Circle")
    return MapFeature(name, outline, low, high)
