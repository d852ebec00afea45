"""Beam patterns: the directions in which a LiDAR looks, whether or not anything answers.

A beam without return is evidence of free space, so the set of beams through a cell, (5.39), comes
from here and not from the returns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clearway.base.brief import in_brief, one_line
from clearway.base.checks import check_floats, fits_float, kind_of, take_floats
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, cartesian_from_spherical
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import freeze_array

MOST_BEAMS = 5_000_000
"""Of a pattern."""


@dataclass(frozen=True, eq=False)
class BeamPattern:
    """Directions of one sweep in the sensor frame, and the ranges that the sensor can measure.

    Raises
    ------
    ClearwayError
        Naming the field when angles are missing or not finite, or ranges are impossible.

    Examples
    --------
    >>> import numpy as np
    >>> import clearway as cw
    >>> pattern = cw.BeamPattern.rotating(np.linspace(-15.0, 15.0, 16), 0.2, max_range_m=100.0)
    >>> pattern.beams, pattern.directions.shape
    (28800, (28800, 3))
    """

    name: str
    azimuth_rad: FloatArray
    """[beams] left positive."""
    _: KW_ONLY
    elevation_rad: FloatArray
    """[beams] up positive."""
    min_range_m: float = 0.0
    """Blind range: nearer returns are dropped."""
    max_range_m: float = np.inf
    spacing_rad: float = 0.0
    """Typical angle between neighbouring beams, along the axis where they lie farther apart."""

    def __post_init__(self) -> None:
        for name in ("azimuth_rad", "elevation_rad"):
            check_floats(f"beam pattern {self.name}: {name}", getattr(self, name))
        count = np.size(self.azimuth_rad)
        if count == 0 or np.size(self.elevation_rad) != count:
            raise ClearwayError(
                f"beam pattern {self.name}: needs as many elevations as azimuths and at least one, "
                f"got {np.size(self.elevation_rad)} and {count}"
            )
        for name in ("azimuth_rad", "elevation_rad"):
            angles = freeze_array(np.ravel(getattr(self, name)), (count,))
            if not np.all(np.isfinite(angles)):
                raise ClearwayError(f"beam pattern {self.name}: {name} must be finite numbers")
            object.__setattr__(self, name, angles)
        ranges = self.min_range_m, self.max_range_m
        if not (all(map(fits_float, ranges)) and 0.0 <= ranges[0] < ranges[1]):
            raise ClearwayError(
                f"beam pattern {self.name}: needs 0 <= min_range_m < max_range_m, "
                f"got {self.min_range_m} and {self.max_range_m}"
            )
        if not (fits_float(self.spacing_rad) and 0.0 <= self.spacing_rad < np.inf):
            raise ClearwayError(
                f"beam pattern {self.name}: spacing_rad must be a number >= 0, "
                f"got {self.spacing_rad}"
            )
        take_floats(self, BeamPattern)

    def __repr__(self) -> str:
        ranges = f"{self.min_range_m:g} to {self.max_range_m:g} m"
        return one_line("BeamPattern", (in_brief(self.name), f"{self.beams:,} beams", ranges))

    @property
    def beams(self) -> int:
        """Number of beams in a sweep."""
        return len(self.azimuth_rad)

    @cached_property
    def directions(self) -> FloatArray:
        """[beams, 3] unit vectors in the sensor frame."""
        spherical = np.stack([np.ones(self.beams), self.azimuth_rad, self.elevation_rad], axis=-1)
        directions = np.ascontiguousarray(cartesian_from_spherical(spherical))
        directions.setflags(write=False)
        return directions

    @classmethod
    def from_angles(
        cls,
        azimuths_rad: npt.ArrayLike,
        elevations_rad: npt.ArrayLike,
        *,
        name: str = "angles",
        min_range_m: float = 0.0,
        max_range_m: float = np.inf,
        spacing_rad: float | None = None,
    ) -> BeamPattern:
        """Make a pattern of every azimuth at every elevation, azimuth outermost.

        Parameters
        ----------
        azimuths_rad
            [n] left positive.
        elevations_rad
            [m] up positive.
        name
            Of the pattern.
        min_range_m
            Blind range: nearer returns are dropped.
        max_range_m
            Farthest return.
        spacing_rad
            Typical angle between neighbouring beams; by default as measured.

        Returns
        -------
        BeamPattern
            Of n x m beams, sensor frame.

        Raises
        ------
        ClearwayError
            For angles or ranges that cannot be used, and for too many beams.
        """
        azimuths = np.ravel(check_floats(f"beam pattern {name}: azimuths_rad", azimuths_rad))
        elevations = np.ravel(check_floats(f"beam pattern {name}: elevations_rad", elevations_rad))
        _refuse_too_many(len(azimuths) * len(elevations))
        if spacing_rad is None:
            spacing_rad = max(_typical_step(azimuths), _typical_step(elevations))
        azimuth, elevation = np.meshgrid(azimuths, elevations, indexing="ij")
        return cls(
            name,
            azimuth.ravel(),
            elevation_rad=elevation.ravel(),
            min_range_m=min_range_m,
            max_range_m=max_range_m,
            spacing_rad=spacing_rad,
        )

    @classmethod
    def rotating(
        cls,
        elevations_deg: Sequence[float] | FloatArray,
        azimuth_step_deg: float,
        *,
        azimuth_span_deg: float = 360.0,
        name: str = "rotating",
        min_range_m: float = 0.0,
        max_range_m: float = np.inf,
    ) -> BeamPattern:
        """Make the pattern of a stack of lasers that turns.

        Its azimuths are the middles of equal steps about ahead.

        Parameters
        ----------
        elevations_deg
            [n] of the lasers, up positive.
        azimuth_step_deg
            Between two shots of a laser.
        azimuth_span_deg
            Width of the sweep.
        name
            Of the pattern.
        min_range_m
            Blind range: nearer returns are dropped.
        max_range_m
            Farthest return.

        Returns
        -------
        BeamPattern
            Of one sweep, sensor frame.

        Raises
        ------
        ClearwayError
            For angles or ranges that cannot be used, and for too many beams.
        """
        sweep = azimuth_step_deg, azimuth_span_deg
        if not (all(map(fits_float, sweep)) and 0.0 < sweep[0] <= sweep[1] <= 360.0):
            raise ClearwayError(
                f"beam pattern {name}: needs 0 < azimuth_step_deg <= azimuth_span_deg <= 360, "
                f"got {azimuth_step_deg} and {azimuth_span_deg}"
            )
        steps = round(azimuth_span_deg / azimuth_step_deg)
        azimuths_deg = _midpoints(np.linspace(-0.5, 0.5, 2) * azimuth_span_deg, steps)
        return cls.from_angles(
            np.radians(azimuths_deg),
            np.radians(check_floats(f"beam pattern {name}: elevations_deg", elevations_deg)),
            name=name,
            min_range_m=min_range_m,
            max_range_m=max_range_m,
        )

    @classmethod
    def per_cell(
        cls,
        grid: AvoidanceGrid,
        azimuths_per_cell: int = 20,
        *,
        elevations_per_cell: int = 10,
        min_range_m: float = 0.0,
        max_range_m: float = np.inf,
    ) -> BeamPattern:
        """Make a pattern with the same number of beams through every column of a grid.

        Parameters
        ----------
        grid
            Whose columns are subdivided; beams are the angular midpoints.
        azimuths_per_cell
            Subdivisions of a column's azimuth.
        elevations_per_cell
            Subdivisions of its elevation.
        min_range_m
            Blind range: nearer returns are dropped.
        max_range_m
            Farthest return.

        Returns
        -------
        BeamPattern
            Of one sweep, in the grid's frame.

        Raises
        ------
        ClearwayError
            For no subdivisions, ranges that cannot be used, and too many beams.
        """
        kind_of("beam pattern per cell: grid", grid, AvoidanceGrid)
        counts = azimuths_per_cell, elevations_per_cell
        if not all(isinstance(count, int | np.integer) and count >= 1 for count in counts):
            raise ClearwayError(
                "beam pattern per cell: at least one azimuth and one elevation are needed, "
                f"got {azimuths_per_cell} and {elevations_per_cell}"
            )
        columns, rows = len(grid.azimuth_edges_rad) - 1, len(grid.elevation_edges_rad) - 1
        _refuse_too_many(columns * azimuths_per_cell * rows * elevations_per_cell)
        return cls.from_angles(
            _midpoints(grid.azimuth_edges_rad, azimuths_per_cell),
            _midpoints(grid.elevation_edges_rad, elevations_per_cell),
            name=f"{azimuths_per_cell} x {elevations_per_cell} beams per cell",
            min_range_m=min_range_m,
            max_range_m=max_range_m,
        )


def _refuse_too_many(beams: int) -> None:
    if beams > MOST_BEAMS:
        raise ClearwayError(f"beam pattern: {beams:,} beams; at most {MOST_BEAMS:,}")


def _midpoints(edges: FloatArray, pieces: int) -> FloatArray:
    """Middles of `pieces` equal parts of every interval, ascending."""
    parts = (np.arange(pieces) + 0.5) / pieces
    return (edges[:-1, None] + np.diff(edges)[:, None] * parts).ravel()


def _typical_step(angles_rad: FloatArray) -> float:
    """Median angle between neighbours; 0 for a single angle."""
    steps = np.diff(np.unique(angles_rad))
    return float(np.median(steps)) if len(steps) else 0.0
