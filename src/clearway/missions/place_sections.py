"""`[[obstacle]]`, `[point_cloud]` and `[map]` of a mission file: what stands in the world."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from clearway.io.choices import OneOf
from clearway.io.maps.plausible import LARGEST_POINT_RADIUS_M
from clearway.io.scans.optical import Axes
from clearway.io.toml import Section
from clearway.missions.sections import ObstacleSection, Point, Positive, state_problems
from clearway.obstacles.columns import Columns
from clearway.sim.column_fields import COLUMN_WORLDS


class WorldObstacleSection(ObstacleSection):
    """`[[obstacle]]`: a shape of the world, of the map, or of both."""

    known: Literal["world", "map", "both"] = "world"
    """world: really there, not on the map; map: on the map only, a false positive; both."""


Column = Annotated[tuple[float, float, float, float, float], Field(strict=False)]


class ColumnsSection(Section):
    """`[columns]`: upright cylinders, flat at both ends: trees, pillars, masts; one of `file`,
    `rows_m` and `made` says where they stand."""

    file: str | None = None
    """A table (.csv) with a header line and columns x, y, radius and height (or z_max) in metres,
    relative to the mission file. Each stands on height 0."""
    rows_m: Annotated[tuple[Column, ...], Field(strict=False)] = ()
    """x, y, radius, lowest and highest height of each."""
    made: Annotated[str, OneOf(COLUMN_WORLDS)] | None = None
    """A made-up field of columns, with its ground."""
    seed: int = Field(default=0, ge=0)
    """Of what is made up."""
    ground_m: float | None = None
    """Height of level ground, which is solid; default: that of what is made up, else none."""
    known: Literal["world", "map", "both"] = "world"
    """world: really there, not on the map; map: on the map only; both. On a map the ends of columns
    are rounded, beyond their heights."""

    @model_validator(mode="after")
    def _is_one_of_three(self) -> Self:
        if (self.file is not None) + bool(self.rows_m) + (self.made is not None) > 1:
            raise ValueError("give one of file, rows_m and made")
        state_problems(lambda: Columns(self.rows_m))
        return self

    def to_columns(self) -> Columns:
        """The columns; raises InputError for a file that cannot be read."""
        from clearway.io.maps.column_table import read_column_table

        rows: npt.ArrayLike = self.rows_m
        ground_m = -np.inf
        made = None if self.made is None else COLUMN_WORLDS[self.made](self.seed).world
        if isinstance(made, Columns):
            rows, ground_m = made.rows_m, made.ground_m
        elif self.file is not None:
            rows = read_column_table(Path(self.file))
        return Columns(rows, ground_m=ground_m if self.ground_m is None else self.ground_m)


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
    `complete` is given, which may be declared of `[[obstacle]]` alone."""
    complete: bool | Annotated[tuple[Point, Point], Field(strict=False)] = False
    """Where what is known, by files and by `[[obstacle]]`, is all that stands there: true for
    everywhere, or lowest and highest corner of a box, world frame. With `safety.escape = "mapped"`
    unobserved space counts as free there, and nowhere else."""
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
