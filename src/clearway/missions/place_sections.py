"""`[[obstacle]]`, `[point_cloud]` and `[map]` of a mission file: what stands in the world."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from clearway.io.toml import Section
from clearway.missions.sections import ObstacleSection, Point, Positive


class WorldObstacleSection(ObstacleSection):
    """`[[obstacle]]`: a shape of the world, of the map, or of both."""

    known: Literal["world", "map", "both"] = "world"
    """world: really there, not on the map; map: on the map only, a false positive; both."""


class PointCloudSection(Section):
    """`[point_cloud]`: a surveyed place as the world to fly in."""

    file: str
    """Relative to the mission file."""
    point_radius_m: Positive
    """What a stored point stands for: half the spacing of the survey, or more."""
    origin_m: Point | Literal["lowest-corner", "file"] = "lowest-corner"
    """What becomes the world's origin: a point of the survey, its lowest corner, or its own."""
    leave_out_classes: Annotated[tuple[int, ...], Field(strict=False)] = ()
    """ASPRS classes that are not there; noise never is."""


class MapSection(Section):
    """`[map]`: map files as obstacles that are known, and zones to keep out of."""

    files: Annotated[tuple[str, ...], Field(strict=False, min_length=1)]
    """Relative to the mission file; see [maps.md](maps.md) for the formats."""
    known: Literal["world", "map", "both"] = "both"
    """both: really there and on the map; world: there, but not on the map; map: on the map only.
    Zones to keep out of are always on the map only."""
    point_radius_m: Positive = 20.0
    """What an obstacle stands for that a file gives as a mere point."""
    crs: str | None = None
    """Reference system of a CityJSON model that states none, such as EPSG:7415."""
    beyond_m: Positive = 300.0
    """What lies farther than this from the box around the mission is left out."""
    keep_out: bool = True
    """Whether zones of the airspace are kept out of."""
    at: str | None = None
    """Moment of the flight, such as 2025-06-01T12:00Z: zones not in force then do not count."""
