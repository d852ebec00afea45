"""What any map file comes down to: outlines on the ground between two heights, some with times."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime, time
from typing import TYPE_CHECKING, Literal, NamedTuple

from clearway.base.frames import FloatArray

if TYPE_CHECKING:
    from clearway.io.maps.terrain import Terrain

Above = Literal["sea level", "ground", "ellipsoid"]
UNLIMITED_M = 20_000.0
"""Height that stands for no upper limit."""


class Geodetic(NamedTuple):
    """A place; heights are above mean sea level, or the file's own vertical datum."""

    latitude_deg: float
    longitude_deg: float
    height_m: float


class Height(NamedTuple):
    """A height and what it is above."""

    value_m: float
    above: Above


@dataclass(frozen=True, slots=True, eq=False)
class Disc:
    """A round outline: a mast, or a zone around a point."""

    latitude_deg: float
    longitude_deg: float
    radius_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Polygon:
    """An outline with straight sides."""

    rings: tuple[FloatArray, ...]
    """Each [n, 2] latitude, longitude in degrees: the outer one, then holes."""


@dataclass(frozen=True, slots=True, eq=False)
class MapFeature:
    """Everything over an outline, from one height to another."""

    name: str
    outline: Disc | Polygon
    low: Height
    high: Height


class Daily(NamedTuple):
    """Hours of some days of the week; a time without a zone is in UTC."""

    days: tuple[str, ...]
    """MON to SUN; none means every day."""
    start: time | None
    end: time | None
    """None where the file gives no hour, or an event such as sunset: then all day counts."""


class Period(NamedTuple):
    """When a zone is in force: between two moments, and then at these hours."""

    start: datetime | None
    end: datetime | None
    hours: tuple[Daily, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class ZoneFeature:
    """A zone of the airspace, not yet placed."""

    identifier: str
    name: str
    restriction: str
    periods: tuple[Period, ...]
    features: tuple[MapFeature, ...]


@dataclass(frozen=True, slots=True, eq=False)
class ParsedMap:
    """What one file holds, in geodetic coordinates; `maps` places it in a local frame."""

    kind: str
    """What the format is called."""
    crs: str
    features: tuple[MapFeature, ...] = ()
    zones: tuple[ZoneFeature, ...] = ()
    terrain: Terrain | None = None
    counts: Mapping[str, int] = field(default_factory=dict)
    """What was left out, by reason."""
    notes: tuple[str, ...] = ()


def as_stated(crs: str) -> str:
    """The note that a file's reference system is the one that was given beside it."""
    return f"{crs} as stated"
