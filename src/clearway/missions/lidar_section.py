"""`[[lidar]]` of a mission file: a sensor, its beams and its faults."""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from clearway.base.grid import AvoidanceGrid
from clearway.io.choices import OneOf
from clearway.io.toml import Section
from clearway.missions.sections import NotNegative, Numbers, Point, Positive, values_for
from clearway.sensors import BeamPattern, Lidar, Mounting, Standing, named_pattern
from clearway.sim.lying_lidar import LIES, LyingLidar


class LidarSection(Section):
    """`[[lidar]]`: a sensor, its beams and its faults."""

    name: str = "lidar"
    """Differs from sensor to sensor."""
    pattern: str | None = None
    """A sensor by name; otherwise `beams_per_cell`, or lists of angles."""
    beams_per_cell: Annotated[tuple[int, int], Field(strict=False)] | None = None
    """Azimuths and elevations through every column; [20, 10] without any pattern."""
    azimuth_deg: Numbers | None = None
    """With `elevation_deg`: a beam at every azimuth and elevation listed."""
    elevation_deg: Numbers | None = None
    """Up positive."""
    position_m: Point = (0.0, 0.0, 0.0)
    """Where the sensor sits, body frame."""
    attitude_deg: Point = (0.0, 0.0, 0.0)
    """How it is turned in the body: roll, pitch (nose down positive), yaw."""
    min_range_m: NotNegative = 0.0
    """Blind range: nearer returns are dropped."""
    max_range_m: Positive | None = None
    """Default: the grid's range."""
    sigma_m: NotNegative = 0.0
    """Standard deviation of the range."""
    dropout: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Share of returns that get lost."""
    airframe_radius_m: NotNegative = 0.0
    """Returns within this distance of the body's origin come from the own airframe."""
    precision: float = Field(default=1.0, gt=0.0, le=1.0)
    """Among several sensors: share of its hits that lie in the cell that they are told for."""
    trust: float = Field(default=1.0, gt=0.0, le=1.0)
    """Among several sensors: how far its word counts; contradiction by others lowers it."""
    lie: Annotated[str, OneOf(LIES, besides=("none",))] = "none"
    """What it tells in place of the truth: nothing at all, or a wall at half its range that travels
    along."""
    lies_from_s: NotNegative = 0.0
    """Time from which it lies."""

    @model_validator(mode="after")
    def _is_one_of_three(self) -> Self:
        if (self.azimuth_deg is None) != (self.elevation_deg is None):
            raise ValueError("azimuth_deg and elevation_deg are needed together")
        ways = [self.pattern, self.beams_per_cell, self.azimuth_deg]
        if sum(way is not None for way in ways) > 1:
            raise ValueError(
                "give one of pattern, beams_per_cell, or azimuth_deg and elevation_deg"
            )
        if self.beams_per_cell is not None and min(self.beams_per_cell) < 1:
            raise ValueError(f"beams_per_cell must be at least [1, 1], got {self.beams_per_cell}")
        if self.azimuth_deg == () or self.elevation_deg == ():
            raise ValueError("azimuth_deg and elevation_deg need at least one angle each")
        return self

    def to_lidar(self, grid: AvoidanceGrid) -> Lidar:
        """The sensor, with beams evenly through the grid's cells unless the file says otherwise."""
        keys = values_for(Lidar, self) | {
            "pattern": self._pattern(grid),
            "mounting": Mounting(np.array(self.position_m), np.radians(self.attitude_deg)),
            "standing": Standing(**values_for(Standing, self)),
        }
        return Lidar(**keys)

    def to_lie(self, grid: AvoidanceGrid) -> LyingLidar | None:
        """What tells the system something else than what is there; None if it is honest."""
        if self.lie == "none":
            return None
        return LyingLidar(self.to_lidar(grid), self.lie, self.lies_from_s)

    def _pattern(self, grid: AvoidanceGrid) -> BeamPattern:
        near, far = self.min_range_m, self.max_range_m or grid.range_m
        if self.pattern is not None:
            return named_pattern(self.pattern)
        if self.azimuth_deg is not None:
            return BeamPattern.from_angles(
                np.radians(self.azimuth_deg),
                np.radians(self.elevation_deg or ()),
                min_range_m=near,
                max_range_m=far,
            )
        azimuths, elevations = self.beams_per_cell or (20, 10)
        return BeamPattern.per_cell(
            grid, azimuths, elevations_per_cell=elevations, min_range_m=near, max_range_m=far
        )
