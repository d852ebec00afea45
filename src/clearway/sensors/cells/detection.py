"""Detected obstacles: from raw returns to hits, P_OL (5.41) and visibility (5.47) of every cell."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from clearway.base.brief import brief
from clearway.base.checks import array_problem, check_points, collect_problems, number_problem
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray, IntArray
from clearway.base.variants import Variants
from clearway.sensors.beams.lidar import Lidar, Scan
from clearway.sensors.cells.placing import Ground, layers_within, place_scan
from clearway.sensors.cells.return_block import REASONS
from clearway.sensors.cells.returns import keep_returns
from clearway.sensors.cells.scan_cells import PlacedScan, compute_hit_share, detect_cells
from clearway.sensors.cells.visibility import surface_probability, visible_behind

DetectionRule = str
"""How hits become P_OD: a name of RULES."""

REFERENCE_AREA_M2 = np.pi / 4.0
"""Frontal area A_O of a ball of 1 m diameter."""


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """What one scan of one sensor says of every cell.

    Raises InputError naming every array that cannot be used: of the wrong shape, not finite, or
    beyond what its numbers can be.
    """

    grid: AvoidanceGrid
    sensor: str
    time_s: float
    hits: IntArray
    """[cells] |H| of (5.40)."""
    beams: IntArray
    """[columns * rows] |L| of (5.39): beams of the pattern, whether or not they returned."""
    probability: FloatArray
    """[cells] P_OD of this sensor: (5.41), or the rule that was asked for."""
    hindrance: FloatArray
    """[cells] share of the column's beams that end in the cell: P_OL, and ground returns too.

    (5.42) corrected: as printed, empty cells would hide what is behind them.
    """
    visibility: FloatArray
    """[cells] P_V (5.47); 0 where no beam looks."""
    points_m: FloatArray
    """[kept, 3] valid returns in the grid frame, also those outside the field of view."""
    radius_m: FloatArray
    """[kept] half the beam spacing at the return's distance from the sensor."""
    counts: Mapping[str, int]
    """Returns kept, outside the grid, and dropped, by reason."""
    weight: float = 1.0
    """Precision times present trust of the sensor, in (0, 1]; the rule "weighted" uses it."""
    placed: PlacedScan | None = field(default=None, repr=False)
    """The scan that it is of, where that is at hand: what it says of the cells, and `points_m` and
    `radius_m`, are then worked out when first asked for. A decision works the cells out itself, and
    flight goes by what is remembered."""
    to_probability: OfHits | None = field(default=None, repr=False)
    """How hits become P_OD, where not by (5.41)."""

    def __getattr__(self, name: str) -> Any:
        """Of what is not there yet."""
        if name not in LATER or self.placed is None:
            raise AttributeError(name)
        there = self._of_returns if name in OF_RETURNS else self._of_cells
        for key, value in there(self.placed).items():
            object.__setattr__(self, key, value)
        return getattr(self, name)

    def _of_returns(self, placed: PlacedScan) -> dict[str, Any]:
        points_m, radius_m = keep_returns(placed.points_m, placed.filters)
        return {"points_m": points_m, "radius_m": radius_m}

    def _of_cells(self, placed: PlacedScan) -> dict[str, Any]:
        found, probability = detect_cells(placed), self.to_probability
        return {
            "hits": found.hits,
            "probability": found.share
            if probability is None
            else probability(self.grid, found.hits, found.squared_ranges_m2, placed.beams),
            "hindrance": found.hindrance,
            "visibility": found.visibility,
            "counts": MappingProxyType(dict(zip(REASONS, found.counts.tolist(), strict=True))),
        }

    def __post_init__(self) -> None:
        cells, columns = (self.grid.cells,), (self.grid.columns * self.grid.rows,)
        shares = ("probability", "hindrance", "visibility")
        problems = collect_problems(
            (
                *(array_problem(key, getattr(self, key), cells, 0.0, 1.0) for key in shares),
                array_problem("hits", self.hits, cells, 0.0),
                array_problem("beams", self.beams, columns, 0.0),
                array_problem("points_m", self.points_m, (None, 3)),
                array_problem("radius_m", self.radius_m, (len(self.points_m),), 0.0),
                number_problem("weight", self.weight, 0.0, 1.0),
            )
        )
        if problems:
            raise InputError(f"detection {self.sensor}", problems)
        object.__setattr__(self, "placed", None)  # All is told, and may be other than a scan says.

    @classmethod
    def trust(cls, **values: object) -> Detection:
        """One of values that need no checks, all of them by name."""
        detection = object.__new__(cls)
        for name, value in values.items():
            object.__setattr__(detection, name, value)
        return detection

    __repr__ = brief

    def weighing(self, weight: float) -> Detection:
        """The same with another weight."""
        names = [one.name for one in fields(self) if self.placed is None or one.name not in LATER]
        values = {name: getattr(self, name) for name in names}
        return Detection.trust(**values | {"weight": weight})

    @property
    def seen(self) -> BoolArray:
        """[cells] true where some beam looks into the cell's column."""
        looks = np.asarray(self.beams) > 0
        return np.repeat(looks[None], self.grid.layers, axis=0).ravel()


OF_RETURNS = ("points_m", "radius_m")
LATER = ("hits", "probability", "hindrance", "visibility", "counts", *OF_RETURNS)
"""What is worked out when first asked for, of a detection whose scan is at hand."""


def detect(
    grid: AvoidanceGrid,
    lidar: Lidar,
    scan: Scan,
    *,
    grid_from_body: tuple[FloatArray, FloatArray] | None = None,
    rule: DetectionRule = "ratio",
    reference_area_m2: float = REFERENCE_AREA_M2,
    ground: Ground | None = None,
) -> Detection:
    """Hits (5.40), P_OL (5.41) and visibility (5.47) of one scan.

    grid_from_body: rotation [3, 3] and translation [3] where the body has moved since the scan.
    Beams are counted by direction: the sensor's offset from the grid's origin is neglected there.
    NaN, infinite, blind, too far, own-airframe and ground returns are counted, not binned.
    Raises ClearwayError for a rule that does not exist.
    """
    hits_to_probability = RULES.find(rule)
    placed = place_scan(grid, lidar, scan, grid_from_body, ground)
    return Detection.trust(
        grid=grid,
        sensor=lidar.name,
        time_s=scan.time_s,
        beams=placed.beams,
        weight=lidar.standing.weight,
        placed=placed,
        to_probability=None
        if hits_to_probability is _ratio
        else partial(hits_to_probability, area_m2=reference_area_m2),
    )


def detection_of_cells(
    grid: AvoidanceGrid,
    sensor: str,
    time_s: float,
    probability: FloatArray,
    looks: BoolArray,
    points_m: FloatArray,
    radius_m: FloatArray,
    max_range_m: float = np.inf,
) -> Detection:
    """What a sensor of any kind says of the cells, without beams that could be counted.

    probability: [cells] P_OD. looks: [columns * rows] whether it looks into a column; what it finds
    in a cell hinders the view of those behind, (5.46). points_m, radius_m: returns [n, 3] in the
    grid frame and the balls [n] that they stand for. Cells beyond `max_range_m` are not seen.
    """
    blocked = np.ascontiguousarray(np.clip(probability, 0.0, 1.0), dtype=np.float64)
    points = check_points(f"detection of {sensor}: points_m", points_m)
    layers = layers_within(grid, float(max_range_m))
    return Detection(
        grid,
        sensor,
        float(time_s),
        hits=np.bincount(_inside(grid, points), minlength=grid.cells).astype(np.int64),
        beams=np.asarray(looks, dtype=np.int64).ravel(),
        probability=blocked,
        hindrance=blocked,
        visibility=visible_behind(blocked, np.asarray(looks, dtype=np.float64).ravel(), layers),
        points_m=points,
        radius_m=np.ascontiguousarray(radius_m, dtype=np.float64).ravel(),
        counts=MappingProxyType(dict.fromkeys(REASONS, 0) | {"kept": len(points)}),
    )


def _inside(grid: AvoidanceGrid, points_m: FloatArray) -> IntArray:
    """Cells of the points that lie in the grid."""
    cells = grid.cell_of(points_m)
    return cells[cells >= 0]


class Named(Protocol):
    """Anything with a name."""

    @property
    def name(self) -> str: ...


def detect_nothing(grid: AvoidanceGrid, sensor: Named, time_s: float = -np.inf) -> Detection:
    """What a sensor that gave no reading says: no beam looks anywhere, so nothing is visible."""
    zeros = np.zeros(grid.cells)
    return Detection(
        grid,
        sensor.name,
        time_s,
        hits=np.zeros(grid.cells, dtype=np.int64),
        beams=np.zeros(grid.columns * grid.rows, dtype=np.int64),
        probability=zeros,
        hindrance=zeros,
        visibility=zeros,
        points_m=np.zeros((0, 3)),
        radius_m=np.zeros(0),
        counts=MappingProxyType(dict.fromkeys(REASONS, 0)),
    )


def _ratio(
    grid: AvoidanceGrid, hits: IntArray, squared: FloatArray, beams: IntArray, area_m2: float
) -> FloatArray:
    """Hits by beams of the column (5.41)."""
    del grid, squared, area_m2
    return compute_hit_share(hits, beams)


def _surface(
    grid: AvoidanceGrid, hits: IntArray, squared: FloatArray, beams: IntArray, area_m2: float
) -> FloatArray:
    """Hits by those that a reference surface at that range returns."""
    solid_angle = np.ascontiguousarray(grid.patch_area_m2(1.0)).ravel()
    return surface_probability(hits, squared, beams, solid_angle, float(area_m2))


OfHits = Callable[[AvoidanceGrid, IntArray, FloatArray, IntArray], FloatArray]
"""(grid, hits [cells], squared ranges [cells], beams [columns * rows]) -> P_OD [cells]."""
HitsToProbability = Callable[..., FloatArray]
"""The same, with `area_m2` of a reference surface besides."""
RULES: Variants[HitsToProbability] = Variants(
    "detection rule", {"ratio": _ratio, "surface": _surface}
)
"""How hits become P_OD; `detect` takes the name."""
