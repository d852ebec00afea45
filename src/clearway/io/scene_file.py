"""The scene file of `clearway assess`: its tables and keys, with defaults, as typed sections."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from clearway.errors import ClearwayError, InputError
from clearway.frames import FloatArray
from clearway.grid import AvoidanceGrid
from clearway.intruders import Intruder
from clearway.io.toml import Section
from clearway.obstacles import Obstacle

Numbers = Annotated[tuple[float, ...], Field(strict=False)]
Point = Annotated[tuple[float, float, float], Field(strict=False)]
Pair = Annotated[tuple[float, float], Field(strict=False)]
ModelName = Literal["line", "body", "spread"]
TimedRule = Literal["vehicle", "intruder", "shorter", "future", "future-printed"]
Count = Annotated[int, Field(ge=1, le=1000)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
MOST_CELLS = 100_000


def said(make: Callable[[], object]) -> None:
    """Turn what a value refuses into a problem of the section that it comes from."""
    try:
        make()
    except InputError as error:
        raise ValueError("; ".join(error.problems)) from error


class GridSection(Section):
    """`[grid]`: even cells, or edges; without any key the paper's 10 x 7 x 5 cells to 10 m."""

    range_m: float | Numbers = 10.0
    """Outer radius, or [near, far]; more than two numbers are the edges themselves."""
    layers: Count = 10
    azimuth_deg: float | Numbers = 45.0
    """Half of the field of view, or [right, left]; left is positive."""
    columns: Count = 7
    elevation_deg: float | Numbers = 30.0
    """Half of the field of view, or [bottom, top]; up is positive."""
    rows: Count = 5
    range_edges_m: Numbers | None = None
    azimuth_edges_deg: Numbers | None = None
    elevation_edges_deg: Numbers | None = None

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        said(self.to_grid)
        return self

    def to_grid(self) -> AvoidanceGrid:
        """The grid; raises ClearwayError with every axis that is impossible."""
        axes = (
            ("range_m", "range_edges_m", "layers", 0.0, np.inf),
            ("azimuth_deg", "azimuth_edges_deg", "columns", -180.0, 180.0),
            ("elevation_deg", "elevation_edges_deg", "rows", -90.0, 90.0),
        )
        edges, problems = [], []
        for span, listed, count, low, high in axes:
            try:
                edges.append(self._edges(span, listed, count, low, high))
            except ClearwayError as error:
                problems.append(str(error))
        cells = math.prod(len(axis) - 1 for axis in edges)
        if not problems and cells > MOST_CELLS:
            problems.append(f"{cells:,} cells are too many; at most {MOST_CELLS:,}")
        if problems:
            raise ClearwayError("; ".join(problems))
        return AvoidanceGrid(edges[0], np.radians(edges[1]), np.radians(edges[2]))

    def _edges(self, span: str, listed: str, count: str, low: float, high: float) -> FloatArray:
        """Edges of one axis, in the file's unit."""
        given, cells = getattr(self, listed), getattr(self, count)
        key, value = (span, getattr(self, span)) if given is None else (listed, given)
        if given is not None and span in self.model_fields_set:
            raise ClearwayError(f"{listed} takes the place of {span}: give only one of them")
        if not isinstance(value, tuple):
            start = 0.0 if span == "range_m" else -value
            edges = np.linspace(start, value, cells + 1)
        elif len(value) == 2 and given is None:
            edges = np.linspace(*value, cells + 1)
        else:
            edges = np.array(value)
            if count in self.model_fields_set and cells != len(edges) - 1:
                raise ClearwayError(
                    f"{key} has {len(edges)} edges, which bound {len(edges) - 1} cells, "
                    f"but {count} = {cells}"
                )
        if len(edges) < 2 or not np.all(np.diff(edges) > 1e-7):
            raise ClearwayError(f"{key}: edges must be at least two and ascend, got {_text(value)}")
        if edges[0] < low or edges[-1] > high:
            raise ClearwayError(f"{key}: must lie within {low:g} to {high:g}, got {_text(value)}")
        return edges

    def effective(self) -> dict[str, Any]:
        """The grid as plain keys without contradictions: edges where edges were given."""
        keys: dict[str, Any] = {}
        for span, listed, count in (
            ("range_m", "range_edges_m", "layers"),
            ("azimuth_deg", "azimuth_edges_deg", "columns"),
            ("elevation_deg", "elevation_edges_deg", "rows"),
        ):
            edges, value = getattr(self, listed), getattr(self, span)
            if edges is None and isinstance(value, tuple) and len(value) != 2:
                edges = value
            keys |= {span: value, count: getattr(self, count)} if edges is None else {listed: edges}
        return keys


class VehicleSection(Section):
    """`[vehicle]`: pose of the vehicle, and of the grid with it, in the world."""

    position_m: Point = (0.0, 0.0, 0.0)
    attitude_deg: Point = (0.0, 0.0, 0.0)
    """Roll, pitch (nose down positive), yaw (left positive)."""


class ObstacleSection(Section):
    """`[[obstacle]]`: in the grid's frame, or the world's where a `[vehicle]` is given."""

    shape: Literal["ball", "line", "plane", "cuboid"]
    position_m: Point
    orientation_deg: Point = (0.0, 0.0, 0.0)
    size_m: Numbers = ()
    """Full lengths along local x, y, z: [], [l], [l, w] or [l, w, d]."""
    radius_m: float = 0.0
    name: str = ""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        said(self.to_obstacle)
        return self

    def to_obstacle(self) -> Obstacle:
        return Obstacle(
            self.shape,
            np.array(self.position_m),
            np.radians(self.orientation_deg),
            self.size_m,
            self.radius_m,
            self.name,
        )


Obstacles = Annotated[tuple[ObstacleSection, ...], Field(strict=False)]


class SimulateSection(Section):
    """`[scan.simulate]`: a scan of obstacles by ray casting."""

    obstacles: Annotated[tuple[int, ...], Field(strict=False)] | None = None
    """Which of the map's obstacles are really there, by index from 0."""
    obstacle: Obstacles = ()
    """What is there besides; without both keys, all obstacles of the map are there."""
    beams_per_cell: Annotated[tuple[int, int], Field(strict=False)] = (20, 10)
    """Azimuths and elevations through every column of cells, at angular midpoints."""
    azimuth_deg: Numbers | None = None
    elevation_deg: Numbers | None = None
    """Beams at every azimuth and elevation listed, in place of `beams_per_cell`."""
    max_range_m: float | None = Field(default=None, gt=0.0)
    """Default: the grid's range."""
    sigma_m: float = Field(default=0.0, ge=0.0)
    dropout: float = Field(default=0.0, ge=0.0, lt=1.0)
    seed: int = Field(default=0, ge=0)

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if (self.azimuth_deg is None) != (self.elevation_deg is None):
            raise ValueError("azimuth_deg and elevation_deg are needed together")
        if self.azimuth_deg is not None and "beams_per_cell" in self.model_fields_set:
            raise ValueError("give beams_per_cell, or azimuth_deg and elevation_deg, not both")
        if self.azimuth_deg == () or self.elevation_deg == ():
            raise ValueError("azimuth_deg and elevation_deg need at least one angle each")
        if min(self.beams_per_cell) < 1:
            raise ValueError(f"beams_per_cell must be at least [1, 1], got {self.beams_per_cell}")
        return self


class ScanSection(Section):
    """`[scan]`: what the LiDAR returned, from a file or simulated."""

    file: str | None = None
    """Point cloud in the sensor's frame: x forward, y left, z up; relative to the scene file."""
    pattern: str = "auto"
    """Name of the sensor whose beams these are, or "auto" to estimate them from the points."""
    simulate: SimulateSection | None = None

    @model_validator(mode="after")
    def _is_one_of_two(self) -> Self:
        if (self.file is None) == (self.simulate is None):
            raise ValueError("either `file` or [scan.simulate] is needed, and not both")
        if self.simulate is not None and "pattern" in self.model_fields_set:
            raise ValueError("`pattern` belongs to `file`; [scan.simulate] states its beams itself")
        return self


class IntruderSection(Section):
    """`[[intruder]]`: in the same frame as the obstacles."""

    position_m: Point
    velocity_mps: Point
    spread_deg: float | Pair = 0.0
    """Half-angles of the cone of its uncertainty: [horizontal, vertical], or one for both."""
    radius_m: float = 0.0
    models: Annotated[tuple[ModelName, ...], Field(strict=False)] | None = None
    """Default: line, and body with a radius, and spread with a spread."""
    timed: bool | TimedRule = False
    """Whether meeting it at the vehicle's time counts; true is the paper's (5.5)."""
    up: Point | None = None
    """World up in the grid's frame; default: as the vehicle's attitude says."""
    name: str = ""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        said(self.to_intruder)
        if self.models == ():
            raise ValueError("models: at least one of line, body, spread is needed")
        if self.up is not None and not any(self.up):
            raise ValueError("up: a direction is needed, got [0, 0, 0]")
        return self

    def to_intruder(self) -> Intruder:
        return Intruder(
            np.array(self.position_m),
            np.array(self.velocity_mps),
            np.radians(self._spread_deg),
            self.radius_m,
            self.name,
        )

    @property
    def _spread_deg(self) -> tuple[float, float]:
        spread = self.spread_deg
        return spread if isinstance(spread, tuple) else (spread, spread)

    @property
    def chosen_models(self) -> tuple[str, ...]:
        """The models given, or those that the data call for."""
        if self.models is not None:
            return self.models
        body = ("body",) if self.radius_m > 0.0 else ()
        spread = ("spread",) if any(self._spread_deg) else ()
        return ("line", *body, *spread)


class TimingSection(Section):
    """`[vehicle_timing]`: when the vehicle is in which cell."""

    model: Literal["radial", "reach-set"] = "radial"
    speed_mps: float | None = Field(default=None, gt=0.0)
    """Default: the reach set's."""


class ReachSetSection(Section):
    """`[reach_set]`: the trajectories that are rated."""

    method: Literal["flying", "primitives", "combined", "harmonic", "chaotic", "full"] = "flying"
    start_pitch_deg: float | None = Field(default=None, ge=-90.0, le=90.0)
    """Nose down positive; default: the vehicle's pitch."""
    speed_mps: float | None = Field(default=None, gt=0.0)
    """Default: one layer a movement of 1 s."""
    turn_step_deg: float = Field(default=15.0, gt=0.0, le=90.0)
    pitch_limit_deg: float = Field(default=30.0, ge=0.0, le=90.0)


class RatingSection(Section):
    """`[rating]`: how evidence becomes a rating."""

    name: Literal["total", "printed", "visible", "evidence"] = "total"
    unknown: Share = 0.0
    """How far hidden space counts as blocked, u."""
    unknown_unseen: Share = 1.0
    """The same for columns that no beam looks into."""
    detection: Literal["ratio", "surface"] = "ratio"
    threshold: Share = 0.3
    """Rating from which a trajectory counts as passable."""
    safety_margin_m: float = Field(default=0.6, ge=0.0)
    """How far `coated` reaches around points and map obstacles."""


class SceneFile(Section):
    """All of a scene file; every table may be left out."""

    grid: GridSection = GridSection()
    vehicle: VehicleSection | None = None
    obstacle: Obstacles = ()
    scan: ScanSection | None = None
    intruder: Annotated[tuple[IntruderSection, ...], Field(strict=False)] = ()
    vehicle_timing: TimingSection = TimingSection()
    reach_set: ReachSetSection = ReachSetSection()
    rating: RatingSection = RatingSection()

    @model_validator(mode="after")
    def _indices_exist(self) -> Self:
        simulate = self.scan.simulate if self.scan else None
        bad = [n for n in (simulate and simulate.obstacles) or () if n not in self._indices]
        if bad:
            valid = f"0 to {len(self.obstacle) - 1}" if self.obstacle else "none, no [[obstacle]]"
            raise ValueError(f"scan.simulate.obstacles: no obstacle {bad}; valid indices: {valid}")
        return self

    @property
    def _indices(self) -> range:
        return range(len(self.obstacle))

    def effective(self, folder: Path) -> dict[str, Any]:
        """Tables that assess the same scene again from anywhere, defaults filled in."""
        tables = self.model_dump(exclude_none=True)
        tables["grid"] = self.grid.effective()
        if self.scan is not None and self.scan.file is not None:
            tables["scan"]["file"] = str((folder / self.scan.file).absolute())
        elif self.scan is not None:
            del tables["scan"]["pattern"]
            if "azimuth_deg" in tables["scan"]["simulate"]:
                del tables["scan"]["simulate"]["beams_per_cell"]
        return tables


def _text(value: object) -> str:
    return str(list(value)) if isinstance(value, tuple) else str(value)
