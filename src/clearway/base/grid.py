"""The avoidance grid (4.18): polar cells in front of the vehicle, uniform or not.

Cells are indexed [layer][column][row]: near to far, azimuth ascending (last is left), elevation
ascending (last is top). Per-cell arrays elsewhere are flat, [cells], in that order; `reshape`
gives them their three axes. `grid_frame` says where it sits at the time of decision.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.brief import brief, one_line
from clearway.base.checks import check_floats, fits_float, number_problem, shape_of
from clearway.base.compiled import compiled
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, cartesian_from_spherical
from clearway.base.state import IntArray

BORDER_TOLERANCE = 1e-9
"""Within it an angle belongs to the cell nearer the axis (rad)."""
RANGE_TOLERANCE = 1e-10
"""Share of the range within which a radius belongs to the nearer layer: 1e-9 m of 10 m."""


MOST_IN_A_ROW = 100_000
"""Cells along an axis: more is a slip of the keys, and takes all memory."""


class GridEdges(NamedTuple):
    """The grid as compiled loops take it."""

    range_m: Floats
    azimuth_rad: Floats
    elevation_rad: Floats

    def __repr__(self) -> str:
        return brief(self)


@dataclass(frozen=True, eq=False)
class AvoidanceGrid:
    """Polar cells between edges; `AvoidanceGrid.uniform` makes the usual ones.

    Raises
    ------
    ClearwayError
        Naming the axis when edges do not ascend, are not finite or leave their interval.

    Examples
    --------
    >>> import clearway as cw
    >>> grid = cw.AvoidanceGrid.uniform(range_m=10.0)
    >>> grid.shape, grid.cells, grid.range_m
    ((10, 7, 5), 350, 10.0)
    """

    range_edges_m: FloatArray
    """[layers + 1] ascending, the first >= 0."""
    azimuth_edges_rad: FloatArray
    """[columns + 1] ascending within [-pi, pi], left positive."""
    _: KW_ONLY
    elevation_edges_rad: FloatArray
    """[rows + 1] ascending within [-pi/2, pi/2], up positive."""

    def __post_init__(self) -> None:
        limits = {
            "range_edges_m": (0.0, np.inf),
            "azimuth_edges_rad": (-np.pi, np.pi),
            "elevation_edges_rad": (-np.pi / 2, np.pi / 2),
        }
        for name, (low, high) in limits.items():
            edges = np.array(check_floats(f"grid {name}", getattr(self, name)))
            _check_edges(name, edges, low, high)
            edges.setflags(write=False)
            object.__setattr__(self, name, edges)

    @classmethod
    def uniform(
        cls,
        range_m: float | tuple[float, float] = 10.0,
        layers: int = 10,
        *,
        azimuth_deg: float | tuple[float, float] = 45.0,
        columns: int = 7,
        elevation_deg: float | tuple[float, float] = 30.0,
        rows: int = 5,
    ) -> AvoidanceGrid:
        """Make a grid of evenly spaced cells.

        Parameters
        ----------
        range_m
            Nearest and farthest edge; a single one means from 0.
        layers
            Cells along the range.
        azimuth_deg
            Rightmost and leftmost edge, left positive; a single one means plus and minus it.
        columns
            Cells along the azimuth.
        elevation_deg
            Lowest and highest edge, up positive; a single one means plus and minus it.
        rows
            Cells along the elevation.

        Returns
        -------
        AvoidanceGrid
            Of layers x columns x rows cells.

        Raises
        ------
        ClearwayError
            For edges that are no numbers or leave their interval, and for no cells.
        """
        for name, count in (("layers", layers), ("columns", columns), ("rows", rows)):
            if not isinstance(count, int | np.integer) or not 1 <= count <= MOST_IN_A_ROW:
                raise ClearwayError(
                    f"grid {name}: a whole number from 1 to {MOST_IN_A_ROW:,} is needed, "
                    f"got {count!r}"
                )
        near, far = _span("range_m", range_m, from_zero=True)
        right, left = _span("azimuth_deg", azimuth_deg)
        bottom, top = _span("elevation_deg", elevation_deg)
        with np.errstate(invalid="ignore"):  # What is infinite is refused like all that is no edge.
            return cls(
                np.linspace(near, far, layers + 1),
                np.radians(np.linspace(right, left, columns + 1)),
                elevation_edges_rad=np.radians(np.linspace(bottom, top, rows + 1)),
            )

    def __repr__(self) -> str:
        near, far = self.range_edges_m[[0, -1]]
        right, left = np.degrees(self.azimuth_edges_rad[[0, -1]])
        bottom, top = np.degrees(self.elevation_edges_rad[[0, -1]])
        return one_line(
            "AvoidanceGrid",
            (
                f"{self.layers} x {self.columns} x {self.rows} cells",
                f"{near:g} to {far:g} m",
                f"azimuth {right:g} to {left:g} deg",
                f"elevation {bottom:g} to {top:g} deg",
            ),
        )

    @property
    def layers(self) -> int:
        return len(self.range_edges_m) - 1

    @property
    def columns(self) -> int:
        return len(self.azimuth_edges_rad) - 1

    @property
    def rows(self) -> int:
        return len(self.elevation_edges_rad) - 1

    @property
    def shape(self) -> tuple[int, int, int]:
        """(layers, columns, rows)."""
        return self.layers, self.columns, self.rows

    @property
    def cells(self) -> int:
        """Number of cells."""
        return self.layers * self.columns * self.rows

    @property
    def range_m(self) -> float:
        """Outer radius."""
        return float(self.range_edges_m[-1])

    @property
    def layer_m(self) -> float:
        """Mean thickness of a layer: the length that tolerances in this grid count in."""
        return self.range_m / self.layers

    @cached_property
    def edges(self) -> GridEdges:
        """The three edge arrays, as compiled loops take them."""
        return GridEdges(self.range_edges_m, self.azimuth_edges_rad, self.elevation_edges_rad)

    @cached_property
    def volumes_m3(self) -> FloatArray:
        """[cells] (d_e^3 - d_s^3)/3 (sin el_e - sin el_s)(az_e - az_s)."""
        radial = np.diff(self.range_edges_m**3) / 3.0
        return (
            radial[:, None, None]
            * np.diff(self.azimuth_edges_rad)[None, :, None]
            * np.diff(np.sin(self.elevation_edges_rad))[None, None, :]
        ).ravel()

    @cached_property
    def centers_m(self) -> FloatArray:
        """[cells, 3] points at the middle distance and angles, grid frame."""
        middle = [0.5 * (edges[1:] + edges[:-1]) for edges in self.edges]
        distance, azimuth, elevation = np.meshgrid(*middle, indexing="ij")
        return cartesian_from_spherical(np.stack([distance, azimuth, elevation], axis=-1)).reshape(
            -1, 3
        )

    def patch_area_m2(self, radius_m: float) -> FloatArray:
        """Return the area of each column's patch at a radius: (5.43), (5.44).

        The integral of the area element (3.54), whose E, F and G are those of (3.53).

        Parameters
        ----------
        radius_m
            Distance from the origin of the grid.

        Returns
        -------
        FloatArray
            [columns, rows] in square metres.

        Raises
        ------
        ClearwayError
            For what is no finite radius from 0.
        """
        if problem := number_problem("grid radius_m", radius_m):
            raise ClearwayError(problem)
        return (
            radius_m**2
            * np.diff(self.azimuth_edges_rad)[:, None]
            * np.diff(np.sin(self.elevation_edges_rad))[None, :]
        )

    def cell_of(self, points_m: npt.ArrayLike) -> IntArray:
        """Find the cells that points lie in.

        Parameters
        ----------
        points_m
            [n, 3] grid frame.

        Returns
        -------
        IntArray
            [n] flat cell index; -1 outside the grid.

        Raises
        ------
        ClearwayError
            For points of another shape.
        """
        points = np.ascontiguousarray(check_floats("grid points_m", points_m))
        if points.shape[-1:] != (3,):
            raise ClearwayError(f"grid: points must have shape [n, 3], got {list(points.shape)}")
        return _cells_of(points.reshape(-1, 3), self.edges).reshape(points.shape[:-1])

    def reshape(self, per_cell: npt.NDArray[np.generic]) -> npt.NDArray[np.generic]:
        """Return values of cells by layer, column and row.

        Parameters
        ----------
        per_cell
            [cells] values.

        Returns
        -------
        ndarray
            [layers, columns, rows] the same values.

        Raises
        ------
        ClearwayError
            For another number of values.
        """
        if shape_of(per_cell) != (self.cells,):
            raise ClearwayError(
                f"grid per_cell: must have shape [{self.cells}], one value a cell, "
                f"got {list(shape_of(per_cell))}"
            )
        return np.reshape(per_cell, self.shape)


def _span(
    name: str, end_or_both: float | tuple[float, float], *, from_zero: bool = False
) -> tuple[float, float]:
    """First and last edge; raises ClearwayError for what is neither a number nor two."""
    both = end_or_both if isinstance(end_or_both, tuple) else (end_or_both,)
    if len(both) not in (1, 2) or not all(map(fits_float, both)):
        raise ClearwayError(f"grid {name}: a number or two are needed, got {end_or_both!r}")
    return (0.0 if from_zero else -both[0], both[0]) if len(both) == 1 else (both[0], both[1])


def _check_edges(name: str, edges: FloatArray, low: float, high: float) -> None:
    if edges.ndim != 1 or len(edges) < 2:
        raise ClearwayError(f"grid {name}: at least two edges are needed, got {edges.size}")
    if not np.all(np.isfinite(edges)):
        raise ClearwayError(f"grid {name}: edges must be finite numbers")
    tolerance = RANGE_TOLERANCE * edges[-1] if high == np.inf else BORDER_TOLERANCE
    if not np.all(np.diff(edges) > 4.0 * tolerance):
        raise ClearwayError(f"grid {name}: edges must ascend, got {edges.tolist()}")
    if edges[0] < low - tolerance or edges[-1] > high + tolerance:
        raise ClearwayError(
            f"grid {name}: edges must lie within [{low:.6g}, {high:.6g}], "
            f"got {edges[0]:.6g} to {edges[-1]:.6g}"
        )


@compiled
def layer_of(distance: float, edges: Floats) -> int:
    """Layer of a radius, nearer one within the tolerance; -1 outside. Both outer borders closed."""
    tolerance = RANGE_TOLERANCE * edges[len(edges) - 1]
    if not (distance >= edges[0] - tolerance):
        return -1
    for i in range(1, len(edges)):
        if distance <= edges[i] + tolerance:
            return i - 1
    return -1


@compiled
def interval_of(angle: float, edges: Floats) -> int:
    """Column or row of an angle: the cell nearer the axis on a border, left or up on the axis."""
    last = len(edges) - 1
    if not (angle >= edges[0] - BORDER_TOLERANCE and angle <= edges[last] + BORDER_TOLERANCE):
        return -1
    for j in range(1, last):
        # Borders on the right of the axis and on it belong to the upper cell, others to the lower.
        shift = BORDER_TOLERANCE if edges[j] > BORDER_TOLERANCE else -BORDER_TOLERANCE
        if angle <= edges[j] + shift and not (shift < 0 and angle == edges[j] + shift):
            return j - 1
    return last - 1


def range_borders(edges: FloatArray) -> FloatArray:
    """[layers + 1] radii at which `layer_of` changes, beyond the edges by the tolerance."""
    shift = np.full(len(edges), RANGE_TOLERANCE * edges[-1])
    shift[0] *= -1.0
    borders: FloatArray = edges + shift
    return borders


def angle_borders(edges: FloatArray) -> FloatArray:
    """[n + 1] angles at which `interval_of` changes, off the edges by the tolerance."""
    shift = np.where(edges > BORDER_TOLERANCE, BORDER_TOLERANCE, -BORDER_TOLERANCE)
    shift[[0, -1]] = -BORDER_TOLERANCE, BORDER_TOLERANCE
    borders: FloatArray = edges + shift
    return borders


@compiled
def cell_of_point(x: float, y: float, z: float, edges: GridEdges) -> int:
    """Flat cell index of one point in the grid frame; -1 outside, also for NaN."""
    horizontal = np.sqrt(x * x + y * y)
    i = layer_of(np.sqrt(x * x + y * y + z * z), edges.range_m)
    if i < 0:
        return -1
    j = interval_of(np.arctan2(y, x), edges.azimuth_rad)
    if j < 0:
        return -1
    k = interval_of(np.arctan2(z, horizontal), edges.elevation_rad)
    if k < 0:
        return -1
    columns = len(edges.azimuth_rad) - 1
    rows = len(edges.elevation_rad) - 1
    return (i * columns + j) * rows + k


@compiled
def _cells_of(points: Floats2, edges: GridEdges) -> Ints:
    cells = np.empty(len(points), dtype=np.int64)
    for n in range(len(points)):
        cells[n] = cell_of_point(points[n, 0], points[n, 1], points[n, 2], edges)
    return cells
