"""`[[lidar]]` of a mission file: a sensor, its beams and its faults."""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.io.choices import OneOf
from clearway.io.toml import Section
from clearway.missions.sections import NotNegative, Numbers, Point, Positive, values_for
from clearway.sensors import BeamPattern, Lidar, Mounting, Standing, find_pattern
from clearway.sim.lying_lidar import LIES, LyingLidar

PATTERN_KEYS = (
    ("pattern",),
    ("field_deg", "spacing_deg"),
    ("beams_per_cell",),
    ("azimuth_deg", "elevation_deg"),
)
"""Ways to say where beams look, of which a sensor has one."""


class LidarSection(Section):
    """`[[lidar]]`: a sensor, its beams and its faults."""

    name: str = "lidar"
    """Differs from sensor to sensor."""
    pattern: str | None = None
    """A sensor by name; otherwise `field_deg`, `beams_per_cell`, or lists of angles."""
    field_deg: Annotated[tuple[float, float], Field(strict=False)] | None = None
    """With `spacing_deg`: a field of view, its width and height about straight ahead, with a beam
    in the middle of every square. A depth camera: [90, 60], a rotating LiDAR: [360, 50]."""
    spacing_deg: Annotated[float, Field(gt=0.0, le=45.0)] | None = None
    """From beam to beam in the field of view."""
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
    false_returns: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Share of beams that return from anywhere within the range: rain, dust, the sun."""
    airframe_radius_m: NotNegative = 0.0
    """Returns within this distance of the body's origin come from the own airframe."""
    precision: float = Field(default=1.0, gt=0.0, le=1.0)
    """Among several sensors: share of its hits that lie in the cell that they are reported for."""
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
        if (self.field_deg is None) != (self.spacing_deg is None):
            raise ValueError("field_deg and spacing_deg are needed together")
        if sum(any(getattr(self, key) is not None for key in way) for way in PATTERN_KEYS) > 1:
            ways = ", ".join(" and ".join(way) for way in PATTERN_KEYS)
            raise ValueError(f"give only one of {ways}")
        if self.field_deg is not None:
            width, height = self.field_deg
            least = self.spacing_deg or 0.0
            if not (least <= width <= 360.0 and least <= height <= 180.0):
                raise ValueError(
                    f"field_deg: width and height must be spacing_deg at least, and 360 and 180 at "
                    f"most, got {list(self.field_deg)}"
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
            return find_pattern(self.pattern)
        if self.field_deg is not None and self.spacing_deg is not None:
            azimuth, elevation = (
                np.radians(spread_evenly(width, self.spacing_deg)) for width in self.field_deg
            )
            return BeamPattern.from_angles(
                azimuth, elevation, name="field of view", min_range_m=near, max_range_m=far
            )
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


def spread_evenly(width: float, spacing: float) -> FloatArray:
    """Middles of equal parts of an interval about 0, each as wide as the spacing or less."""
    parts = max(1, int(np.ceil(width / spacing - 1e-9)))
    half = 0.5 * width * (1.0 - 1.0 / parts)
    return np.linspace(-half, half, parts)
