"""Sections and types that scene and mission files share."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Annotated, Any, Self, TypeVar

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from clearway.base.checks import geodetic_problem
from clearway.base.errors import ClearwayError, InputError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.version import SCHEMA_VERSION, __version__
from clearway.io.choices import OneOf
from clearway.io.toml import Section
from clearway.obstacles.obstacle import Obstacle, ObstacleShape
from clearway.traffic.models.combined import MODELS
from clearway.vehicle.scale import RANGE_M

Numbers = Annotated[tuple[float, ...], Field(strict=False)]
Point = Annotated[tuple[float, float, float], Field(strict=False)]
Count = Annotated[int, Field(ge=1, le=1000)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Positive = Annotated[float, Field(gt=0.0, le=1e9)]
NotNegative = Annotated[float, Field(ge=0.0, le=1e9)]
Coordinate = Annotated[float, Field(ge=-1e9, le=1e9)]
Place = Annotated[tuple[Coordinate, Coordinate, Coordinate], Field(strict=False)]
Turn = Annotated[float, Field(ge=-1e6, le=1e6)]
Attitude = Annotated[tuple[Turn, Turn, Turn], Field(strict=False)]
ModelName = Annotated[str, OneOf(MODELS, without=("tube", "lattice"))]
MOST_CELLS = 100_000
MOST_RANGE_M = 1e6
S = TypeVar("S", bound=Section)


def _on_earth(place: tuple[float, float, float]) -> tuple[float, float, float]:
    if problem := geodetic_problem(*place):
        raise ValueError(problem)
    return place


OnEarth = Annotated[Point, AfterValidator(_on_earth)]


def without_version(data: Any) -> Any:
    """The tables of a file without `schema_version`, which files that clearway writes begin with.

    Raises ValueError where it is none, or of a later version than this one.
    """
    if not isinstance(data, Mapping) or "schema_version" not in data:
        return data
    version = data["schema_version"]
    if type(version) is not int or not 1 <= version <= SCHEMA_VERSION:
        raise ValueError(
            f"schema_version: {version!r} is of another version of clearway; this one, "
            f"{__version__}, reads 1 to {SCHEMA_VERSION}"
        )
    return {key: value for key, value in data.items() if key != "schema_version"}


def state_problems(make: Callable[[], object]) -> None:
    """Turn what a value refuses into a problem of the section that it comes from."""
    try:
        make()
    except InputError as error:
        raise ValueError("; ".join(error.problems)) from error


def values_for(target: Any, *sections: Section) -> dict[str, Any]:
    """Arguments of a dataclass: values of the keys that are called as its fields are.

    So a key is added in two places, the section and what it sets. Raises TypeError where two
    sections have a key of that name.
    """
    names = {field.name for field in fields(target) if field.init}
    values: dict[str, Any] = {}
    for section in sections:
        keys = names & set(type(section).model_fields)
        if not keys.isdisjoint(values):
            raise TypeError(f"{target.__name__}: {sorted(keys & set(values))} twice")
        values |= {key: getattr(section, key) for key in keys}
    return values


def fill_left_out(section: S, **values: Any) -> S:
    """Return the section with values in place of keys that were left out, which still count so."""
    left_out = {key: value for key, value in values.items() if key not in section.model_fields_set}
    filled = section.model_copy()
    vars(filled).update(left_out)
    return filled


class GridSection(Section):
    """`[grid]`: even cells, or edges; without any key the paper's 10 x 7 x 5 cells to 10 m."""

    range_m: float | Numbers = RANGE_M
    """Outer radius, or [near, far]; more than two numbers are the edges themselves. Default:
    [what suits the vehicle](missions.md#what-suits-the-vehicle), the value here at 1 m/s."""
    layers: Count = 10
    """Layers from near to far."""
    azimuth_deg: float | Numbers = 45.0
    """Half of the field of view, or [right, left]; left is positive."""
    columns: Count = 7
    """Columns from right to left."""
    elevation_deg: float | Numbers = 30.0
    """Half of the field of view, or [bottom, top]; up is positive."""
    rows: Count = 5
    """Rows from bottom to top."""
    range_edges_m: Numbers | None = None
    """Uneven layers, in place of `range_m`."""
    azimuth_edges_deg: Numbers | None = None
    """Uneven columns, in place of `azimuth_deg`."""
    elevation_edges_deg: Numbers | None = None
    """Uneven rows, in place of `elevation_deg`."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        state_problems(self.to_grid)
        return self

    def to_grid(self) -> AvoidanceGrid:
        """The grid; raises ClearwayError with every axis that is impossible."""
        axes = (
            ("range_m", "range_edges_m", "layers", 0.0, MOST_RANGE_M),
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
        return AvoidanceGrid(
            edges[0], np.radians(edges[1]), elevation_edges_rad=np.radians(edges[2])
        )

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


class ObstacleSection(Section):
    """`[[obstacle]]`: in the grid's frame, or the world's where a `[vehicle]` is given."""

    shape: ObstacleShape
    """A box along its local axes, rotated, then rounded by the radius."""
    position_m: Point
    """Its middle."""
    orientation_deg: Point = (0.0, 0.0, 0.0)
    """Roll, pitch (nose down positive), yaw (left positive)."""
    size_m: Numbers = ()
    """Full lengths along local x, y, z: [], [l], [l, w] or [l, w, d]."""
    radius_m: float = 0.0
    """Of a ball or a line; how far a plane or a cuboid is inflated."""
    name: str = ""
    """For messages and logs."""

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        state_problems(self.to_obstacle)
        return self

    def to_obstacle(self) -> Obstacle:
        return Obstacle(
            self.shape,
            np.array(self.position_m),
            orientation_rad=np.radians(self.orientation_deg),
            size_m=self.size_m,
            radius_m=self.radius_m,
            name=self.name,
        )


def _text(value: object) -> str:
    return str(list(value)) if isinstance(value, tuple) else str(value)
