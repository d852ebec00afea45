"""Zones of the airspace for unmanned aircraft: ED-318 (GeoJSON), and what ED-269 shares."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime, time
from pathlib import Path
from typing import Any, Literal

from clearway.base.errors import InputError
from clearway.base.units import FOOT_M
from clearway.io.foreign import Foreign, position_of, rings_of
from clearway.io.maps.map_features import (
    UNLIMITED_M,
    Above,
    Daily,
    Disc,
    Height,
    MapFeature,
    ParsedMap,
    Period,
    Polygon,
    ZoneFeature,
)
from clearway.io.toml import MOST_PRINTED_PROBLEMS, each_parsed

UNLIMITED = 99_999.0
"""Written for no upper limit, in either unit."""
ABOVE: Mapping[str, Above] = {"AGL": "ground", "AMSL": "sea level", "WGS84": "ellipsoid"}
UNRESTRICTED = ("NO_RESTRICTION",)
WEEK = ("MON", "TUE", "WED", "THU", "FRI", "SAT", "SUN")
Reference = Literal["AGL", "AMSL", "WGS84"]


class Layer(Foreign):
    """Limits of height of ED-318."""

    upper: float | None = None
    upperReference: Reference = "AGL"
    lower: float | None = None
    lowerReference: Reference = "AGL"
    uom: str = "m"


class Extent(Foreign):
    subType: Literal["Circle"]
    radius: float


class Ed318Geometry(Foreign):
    type: str
    coordinates: Any = None
    layer: Layer | None = None
    extent: Extent | None = None
    geometries: tuple[Ed318Geometry, ...] = ()


class Schedule(Foreign):
    """Hours of days, of both formats."""

    day: tuple[str, ...] | None = None
    startTime: str | None = None
    endTime: str | None = None
    startEvent: str | None = None
    endEvent: str | None = None


class Applicability(Foreign):
    """A time of both formats."""

    permanent: str = "NO"
    startDateTime: datetime | None = None
    endDateTime: datetime | None = None
    schedule: tuple[Schedule, ...] | None = None
    dailyPeriod: tuple[Schedule, ...] | None = None


class Text(Foreign):
    text: str
    lang: str = ""


class Properties(Foreign):
    identifier: str = ""
    name: str | tuple[Text, ...] = ""
    type: str
    limitedApplicability: tuple[Applicability, ...] | None = None


class Ed318Feature(Foreign):
    geometry: Ed318Geometry
    properties: Properties


def is_ed318(data: Mapping[str, Any]) -> bool:
    """Whether a GeoJSON object has features with a layer of heights."""
    features = data.get("features")
    return isinstance(features, list) and any(
        isinstance(part, dict) and _has_layer(part.get("geometry")) for part in features
    )


def _has_layer(geometry: object) -> bool:
    if not isinstance(geometry, dict):
        return False
    parts = geometry.get("geometries")
    return "layer" in geometry or (isinstance(parts, list) and any(map(_has_layer, parts)))


def read_ed318(path: Path, data: Mapping[str, Any]) -> ParsedMap:
    """Zones of an ED-318 file with limits and times; InputError with every zone that has none."""
    zones, problems = [], []
    for number, part in each_parsed(str(path), "features", data.get("features"), Ed318Feature):
        properties = part.properties
        try:
            features = _layers(part.geometry, _name(properties))
            periods = periods_of(properties.limitedApplicability)
        except ValueError as cause:
            problems.append(f"features[{number}] ({properties.identifier}): {cause}")
            if len(problems) == MOST_PRINTED_PROBLEMS:
                break
            continue
        zones.append(
            ZoneFeature(
                properties.identifier, _name(properties), properties.type, periods, features
            )
        )
    return parse_zones(path, "ED-318 zones", zones, problems)


def parse_zones(
    path: Path,
    kind: str,
    zones: list[ZoneFeature],
    problems: list[str],
    notes: tuple[str, ...] = (),
) -> ParsedMap:
    """The zones of a file, without those that restrict nothing; InputError with its problems."""
    if problems:
        raise InputError(str(path), problems)
    if not zones:
        raise InputError(str(path), "no zone in it")
    kept = tuple(zone for zone in zones if zone.restriction not in UNRESTRICTED)
    free = len(zones) - len(kept)
    return ParsedMap(
        kind=kind,
        crs="WGS 84 latitude and longitude",
        zones=kept,
        counts={"zone without restriction": free} if free else {},
        notes=(
            "zones are kept out of, whatever authorization or condition would open them",
            *notes,
        ),
    )


def _name(properties: Properties) -> str:
    """The name in English, else in the first language given, else the identifier."""
    if isinstance(properties.name, str):
        return properties.name or properties.identifier
    english = [text.text for text in properties.name if text.lang.startswith("en")]
    return next(iter(english + [text.text for text in properties.name]), properties.identifier)


def _layers(geometry: Ed318Geometry, name: str) -> tuple[MapFeature, ...]:
    if geometry.type == "GeometryCollection":
        return tuple(one for part in geometry.geometries for one in _layers(part, name))
    layer = geometry.layer or Layer()
    low, high = limits_of(
        (layer.lower, layer.lowerReference), (layer.upper, layer.upperReference), layer.uom
    )
    outlines: list[Disc | Polygon]
    if geometry.type == "Point" and geometry.extent is not None:
        radius = radius_of(geometry.extent.radius)
        outlines = [Disc(*position_of(geometry.coordinates), radius)]
    elif geometry.type == "Polygon":
        outlines = [Polygon(rings_of(geometry.coordinates))]
    elif geometry.type == "MultiPolygon" and isinstance(geometry.coordinates, list):
        outlines = [Polygon(rings_of(part)) for part in geometry.coordinates]
    else:
        raise ValueError(
            f"geometry of type {geometry.type}; valid: Polygon, MultiPolygon, Point with a circle "
            "as extent, GeometryCollection of these"
        )
    return tuple(MapFeature(name, outline, low, high) for outline in outlines)


def radius_of(radius_m: float | None) -> float:
    """The radius of a circle in metres; raises ValueError where it is none."""
    if radius_m is None or not radius_m > 0.0:
        raise ValueError(f"a circle needs a radius above 0 m, got {radius_m}")
    return radius_m


def limits_of(
    lower: tuple[float | None, Reference], upper: tuple[float | None, Reference], unit: str
) -> tuple[Height, Height]:
    """Limits in metres; none below is the ground, none above is out of reach.

    Raises ValueError for an unknown unit, or an upper limit that is not above the lower one.
    """
    if unit.lower() not in ("m", "ft"):
        raise ValueError(f"unit of heights {unit!r} is neither m nor ft")
    metres = 1.0 if unit.lower() == "m" else FOOT_M
    value, reference = lower
    low = Height(0.0, "ground") if value is None else Height(value * metres, ABOVE[reference])
    value, reference = upper
    if value is None or value >= UNLIMITED:
        return low, Height(UNLIMITED_M, "sea level")
    high = Height(value * metres, ABOVE[reference])
    if high.above == low.above and not high.value_m > low.value_m:
        raise ValueError(f"upper limit {value:g} is not above the lower limit, {lower[0]:g}")
    return low, high


def periods_of(applicability: Iterable[Applicability] | None) -> tuple[Period, ...]:
    """When a zone is in force; none means always."""
    periods = []
    for part in applicability or ():
        if part.permanent.upper() == "YES":
            return ()
        hours = tuple(_daily(one) for one in (*(part.schedule or ()), *(part.dailyPeriod or ())))
        periods.append(Period(part.startDateTime, part.endDateTime, hours))
    return tuple(periods)


def _daily(schedule: Schedule) -> Daily:
    """Days and hours; days that are not of the week, such as holidays, count as every day."""
    days = tuple(day.upper() for day in schedule.day or ())
    if not all(day in WEEK for day in days):
        days = ()
    return Daily(days, _hour(schedule.startTime), _hour(schedule.endTime))


def _hour(text: str | None) -> time | None:
    if not text:
        return None
    try:
        return time.fromisoformat(text)
    except ValueError:
        raise ValueError(f"{text!r} is no time of day") from None
