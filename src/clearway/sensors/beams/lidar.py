"""A LiDAR on a vehicle, and what one sweep of it returns."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field

import numpy as np

from clearway.base.brief import brief, in_brief, one_line
from clearway.base.checks import fits_float, kind_of, number_problem, take_floats, time_problem
from clearway.base.compiled import read_only
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, world_from_body
from clearway.base.notebook import Marks, html_table, sketch_from_above
from clearway.base.state import freeze_array
from clearway.sensors.beams.pattern import BeamPattern
from clearway.sensors.standing import FULL, Standing

MOST_TILT_RAD = 1.5
"""Beams that may point higher or lower by more show nothing to be free."""


@dataclass(frozen=True, eq=False)
class Mounting:
    """Pose of a sensor in the body frame."""

    position_m: FloatArray = field(default_factory=lambda: np.zeros(3))
    """[3] origin of the sensor, body frame."""
    attitude_rad: FloatArray = field(default_factory=lambda: np.zeros(3))
    """[3] roll, pitch (nose down positive), yaw (left positive) of the sensor in the body."""
    body_from_sensor: FloatArray = field(init=False, repr=False)
    """[3, 3] rotation (3.37)."""
    is_body_frame: bool = field(init=False, repr=False)
    """Whether the sensor looks along the body's axes from its origin."""

    __repr__ = brief

    def __post_init__(self) -> None:
        for name in ("position_m", "attitude_rad"):
            values = freeze_array(getattr(self, name), (3,))
            if not np.all(np.isfinite(values)):
                raise ClearwayError(f"mounting: {name} must be three finite numbers")
            object.__setattr__(self, name, values)
        rotation = freeze_array(world_from_body(self.attitude_rad), (3, 3))
        object.__setattr__(self, "body_from_sensor", rotation)
        here = not self.position_m.any() and not self.attitude_rad.any()
        object.__setattr__(self, "is_body_frame", here)


@dataclass(frozen=True, eq=False)
class Lidar:
    """A LiDAR: where it looks, where it sits, how well it measures.

    Raises
    ------
    ClearwayError
        Naming the field that is out of its interval.

    Examples
    --------
    >>> import clearway as cw
    >>> grid = cw.AvoidanceGrid.uniform()
    >>> cw.Lidar("front", cw.BeamPattern.per_cell(grid, 4), sigma_m=0.03)
    Lidar('front', 1,400 beams to inf m, sigma 0.03 m)
    """

    name: str
    pattern: BeamPattern
    _: KW_ONLY
    mounting: Mounting = field(default_factory=Mounting)
    sigma_m: float = 0.0
    """Standard deviation of the range."""
    dropout: float = 0.0
    """Share of returns that get lost, in [0, 1)."""
    false_returns: float = 0.0
    """Share of beams that return from anywhere within the range, in [0, 1): rain, dust, the sun."""
    airframe_radius_m: float = 0.0
    """Returns within this distance of the body's origin come from the own airframe."""
    standing: Standing = FULL
    """Precision and trust, where there are several sensors."""
    dark_range_m: float | None = None
    """How far the darkest target to be reckoned with still returns: a beam without return shows no
    more than this to be free; None for the range of the pattern."""

    def __repr__(self) -> str:
        beams = f"{self.pattern.beams:,} beams to {self.pattern.max_range_m:g} m"
        return one_line("Lidar", (in_brief(self.name), beams, f"sigma {self.sigma_m:g} m"))

    def __post_init__(self) -> None:
        kind_of(f"lidar {self.name}: pattern", self.pattern, BeamPattern)
        if not (fits_float(self.dropout) and 0.0 <= self.dropout < 1.0):
            raise ClearwayError(f"lidar {self.name}: dropout must be in [0, 1), got {self.dropout}")
        self._refuse_false_returns()
        for name in ("sigma_m", "airframe_radius_m"):
            value = getattr(self, name)
            if not (fits_float(value) and 0.0 <= value < np.inf):
                raise ClearwayError(f"lidar {self.name}: {name} must be a number >= 0, got {value}")
        dark_m = self.dark_range_m
        if dark_m is not None and not (fits_float(dark_m) and dark_m > 0.0):
            raise ClearwayError(
                f"lidar {self.name}: dark_range_m must be a number > 0, got {self.dark_range_m}"
            )
        take_floats(self, Lidar)

    def _refuse_false_returns(self) -> None:
        """Raise ClearwayError for a share that is none, or of an endless range."""
        share = self.false_returns
        if not (fits_float(share) and 0.0 <= share < 1.0):
            raise ClearwayError(f"lidar {self.name}: false_returns must be in [0, 1), got {share}")
        if share > 0.0 and not self.pattern.max_range_m < np.inf:
            raise ClearwayError(f"lidar {self.name}: false_returns needs a range that ends")

    @property
    def clears_to_m(self) -> float:
        """How far a beam without return shows its way to be free."""
        far = self.pattern.max_range_m
        return far if self.dark_range_m is None else min(far, self.dark_range_m)


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """Returns of one sweep, a point cloud of scanned points (3.32), def. 14.

    Beams of the pattern without return are evidence of free space.

    >>> import numpy as np
    >>> import clearway as cw
    >>> cw.Scan(np.zeros((100, 3)), 2.5, sensor="front")
    Scan(100 points, at 2.5 s, by 'front')
    """

    points_m: FloatArray
    """[returns, 3] sensor frame; NaN and infinite ones are counted and skipped where used."""
    time_s: float = 0.0
    _: KW_ONLY
    sensor: str = ""
    """Name of the LiDAR."""
    tilt_rad: float = 0.0
    """By how much its beams may point higher or lower than the pattern says."""
    blind_m: float | None = None
    """How near it was blind, where not as the pattern says."""

    def __repr__(self) -> str:
        whose = [f"by {in_brief(self.sensor)}"] if self.sensor else []
        told = (f"{len(self.points_m):,} points", f"at {self.time_s:g} s", *whose)
        return one_line(type(self).__name__, told)

    def _repr_html_(self) -> str:
        """For notebooks: what it is, and its points from above."""
        marks = [Marks(self.points_m, "#1f5fbf", joined=False, size=0.8)]
        return html_table(repr(self), {}, sketch_from_above(marks))

    def __post_init__(self) -> None:
        late = time_problem("time_s", self.time_s)
        if late:
            raise ClearwayError(f"scan {self.sensor}: {late}")
        wrong = number_problem("tilt_rad", self.tilt_rad, 0.0, MOST_TILT_RAD)
        if self.blind_m is not None:
            wrong = wrong or number_problem("blind_m", self.blind_m)
        if wrong:
            raise ClearwayError(f"scan {self.sensor}: {wrong}")
        try:
            # What is masked is no place: NaN points are counted and skipped.
            given = self.points_m
            masked = isinstance(given, np.ma.MaskedArray)
            points = read_only(np.ma.filled(given, np.nan) if masked else given)
        except (TypeError, ValueError, OverflowError) as cause:
            raise ClearwayError(f"scan {self.sensor}: points must be numbers") from cause
        if points.ndim != 2 or points.shape[1] != 3:
            raise ClearwayError(
                f"scan {self.sensor}: points must have shape [n, 3], got {list(points.shape)}"
            )
        object.__setattr__(self, "points_m", points)
        take_floats(self, Scan)
