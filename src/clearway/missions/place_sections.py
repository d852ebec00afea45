"""`[[obstacle]]`, `[point_cloud]` and `[map]` of a mission file: what stands in the world."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from clearway.io.maps.plausible import LARGEST_POINT_RADIUS_M
from clearway.io.scans.optical import Axes
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
    frame: Axes = "auto"
    """Axes of its points. body: z up; optical: a camera's, z ahead, x right, y down; auto: optical
    where a recording calls the frame so, else body."""
    point_radius_m: Positive
    """What a stored point stands for: half the spacing of the survey, or more."""
    origin_m: Point | Literal["lowest-corner", "file"] = "lowest-corner"
    """What becomes the world's origin: a point of the survey, its lowest corner, or its own."""
    leave_out_classes: Annotated[tuple[int, ...], Field(strict=False)] = ()
    """ASPRS classes that are not there; noise never is."""


class MapSection(Section):
    """`[map]`: map files as obstacles that are known, zones to keep out of, and where all that
    stands is known."""

    files: Annotated[tuple[str, ...], Field(strict=False)] = ()
    """Relative to the mission file; see [maps.md](maps.md) for the formats. Needed unless
    `complete` is given, which may be said of `[[obstacle]]` alone."""
    complete: bool | Annotated[tuple[Point, Point], Field(strict=False)] = False
    """Where what is known, by files and by `[[obstacle]]`, is all that stands there: true for
    everywhere, or lowest and highest corner of a box, world frame. With `safety.escape = "mapped"`
    unseen space counts as free there, and nowhere else."""
    known: Literal["world", "map", "both"] = "both"
    """both: really there and on the map; world: there, but not on the map; map: on the map only.
    Zones to keep out of are always on the map only."""
    point_radius_m: float = Field(default=20.0, gt=0.0, le=LARGEST_POINT_RADIUS_M)
    """What an obstacle stands for that a file gives as a mere point."""
    crs: str | None = None
    """Reference system of a CityJSON model or a Shapefile that states none, such as EPSG:7415."""
    beyond_m: Positive = 300.0
    """What lies farther than this from the box around the mission is left out."""
    keep_out: bool = True
    """Whether zones of the airspace are kept out of."""
    at: str | None = None
    """Moment of the flight, such as 2025-06-01T12:00Z: zones not in force then do not count."""

    @model_validator(mode="after")
    def _holds_something(self) -> Self:
        if not self.files and self.complete is False:
            raise ValueError("files: at least one is needed, or complete")
        if not isinstance(self.complete, bool):
            low, high = self.complete
            if not all(a < b for a, b in zip(low, high, strict=True)):
                raise ValueError(
                    "complete: must be true, or the lowest and the highest corner of a box, got "
                    f"{[list(low), list(high)]}"
                )
        return self
