"""Fusion (4.17)-(4.23): evidence per cell to ratings of cells, nodes and trajectories.

Evidence comes as flat [cells] arrays from rooms that do not know each other: sensors, obstacle
map, intruders. What follows here is the same for whatever they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from clearway.avoidance.rate.calibration import calibration, classes_of
from clearway.base.arrays import Floats
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.errors import OwnCodeError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.own_code import callable_own, guard_call
from clearway.base.state import BoolArray
from clearway.base.variants import Variants


@dataclass(frozen=True, eq=False)
class Evidence:
    """What every source says of every cell; `Evidence.free` is the start of (4.19)."""

    grid: AvoidanceGrid
    detected: FloatArray
    """[cells] P_OD, probability of a detected obstacle (5.38)."""
    visibility: FloatArray
    """[cells] P_V (5.47)."""
    map_base: FloatArray
    """[cells] share of the cell that map obstacles fill (5.53)."""
    intruder: FloatArray
    """[cells] P_OI, probability of meeting an intruder (5.37)."""
    coated: BoolArray
    """[cells] true where the safety margin around points and shapes reaches into the cell: the
    inflated obstacles (def. 5, def. 6)."""
    seen: BoolArray
    """[cells] true where some beam of some sensor looks into the cell's column."""

    __repr__ = brief

    @classmethod
    def free(cls, grid: AvoidanceGrid) -> Evidence:
        """Nothing known and everything visible, as (4.19) starts."""
        zeros, nothing = np.zeros(grid.cells), np.zeros(grid.cells, dtype=np.bool_)
        return cls(grid, zeros, np.ones(grid.cells), zeros, zeros, nothing, ~nothing)

    @property
    def map(self) -> FloatArray:
        """[cells] P_OM (5.54)."""
        return self._obstacles[0]

    @property
    def obstacle(self) -> FloatArray:
        """[cells] P_O (4.17)."""
        return self._obstacles[1]

    @cached_property
    def _obstacles(self) -> tuple[FloatArray, FloatArray]:
        """P_OM and P_O, computed when first asked for: the rating `total` needs neither."""
        return obstacle_of(self.detected, self.visibility, self.map_base, self.intruder)


Rating = Callable[[Evidence, FloatArray], FloatArray]
"""(evidence, unknown [cells]) -> how safe each cell is, [cells] in [0, 1]."""
OwnRating = Callable[[Evidence, FloatArray, FloatArray], FloatArray]
"""(evidence, obstacle [cells], unknown [cells]) -> the same, as a user writes it."""


def rate_as_printed(evidence: Evidence, unknown: FloatArray) -> FloatArray:
    """1 - P_O P_V, the factor of (4.22) as printed: what is hidden costs nothing."""
    rating = 1.0 - evidence.obstacle * evidence.visibility
    return np.where(evidence.seen, rating, rating * (1.0 - unknown))


def visible(evidence: Evidence, unknown: FloatArray) -> FloatArray:
    """P_V (1 - P_O), as 2.2.2 says it: only what is seen to be free is safe."""
    rating = evidence.visibility * (1.0 - evidence.obstacle)
    return np.where(evidence.seen, rating, rating * (1.0 - unknown))


def evidence_only(evidence: Evidence, unknown: FloatArray) -> FloatArray:
    """1 - P_O: visibility only as far as P_OD and P_OM contain it."""
    rating = 1.0 - evidence.obstacle
    return np.where(evidence.seen, rating, rating * (1.0 - unknown))


def total(evidence: Evidence, unknown: FloatArray) -> FloatArray:
    """(1 - P_OI) [max(0, P_V - P_OD) + (1 - P_V)(1 - base)(1 - u)]: by total probability.

    A visible part of the cell is free unless a beam returned from it; a hidden part is free
    unless the map fills it or unknown space counts as blocked.
    """
    return total_of(
        evidence.detected,
        evidence.visibility,
        evidence.map_base,
        evidence.intruder,
        unknown,
    )


@compiled
def total_of(
    detected: Floats,
    visibility: Floats,
    map_base: Floats,
    intruder: Floats,
    unknown: Floats,
) -> Floats:
    """The rating `total` of every cell."""
    rating = np.empty(len(detected))
    for cell in range(len(detected)):
        seen_free = visibility[cell] - detected[cell]
        if seen_free < 0.0:  # What is not a number stays so.
            seen_free = 0.0
        hidden_free = (1.0 - visibility[cell]) * (1.0 - map_base[cell]) * (1.0 - unknown[cell])
        rating[cell] = (1.0 - intruder[cell]) * (seen_free + hidden_free)
    return rating


def calibrate(evidence: Evidence, unknown: FloatArray) -> FloatArray:
    """The total rating as what came of it: of passages rated so, the share that kept the margin."""
    said = total(evidence, unknown)
    classes = classes_of(evidence.coated, evidence.visibility, evidence.intruder)
    rating = calibration()(said, classes)
    return np.where(evidence.seen, rating, rating * (1.0 - unknown))


def own_rating(label: str, found: Any) -> Rating:
    """Return a user's `OwnRating` as a `Rating` that checks each result, in flight too.

    Raises
    ------
    OwnCodeError
        At once for what cannot be called with the three arguments. In flight for what raises, and
        for a result that is not one number within [0, 1] for every cell.
    """
    function = guard_call(label, callable_own(label, found, ("evidence", "obstacle", "unknown")))

    def rating(evidence: Evidence, unknown: FloatArray) -> FloatArray:
        returned = function(evidence, evidence.obstacle, unknown)
        try:
            rated = np.ascontiguousarray(returned, dtype=np.float64)
        except (TypeError, ValueError):
            raise OwnCodeError(label, f"gave {type(returned).__name__}, no numbers") from None
        if rated.shape != unknown.shape:
            raise OwnCodeError(
                label, f"gave an array {rated.shape}; one number a cell is {unknown.shape}"
            )
        if not (rated.min() >= 0.0 and rated.max() <= 1.0):
            raise OwnCodeError(
                label, f"gave {rated.min():g} to {rated.max():g}: a rating is within [0, 1]"
            )
        return rated

    return rating


RATINGS: Variants[Rating] = Variants(
    "rating",
    {
        "total": total,
        "printed": rate_as_printed,
        "visible": visible,
        "evidence": evidence_only,
        "calibrated": calibrate,
    },
    own_rating,
)
"""Ratings by name; add one here."""


def rating_named(name: str) -> Rating:
    """The rating of that name, or a user's as `module:name`; else ClearwayError with the valid."""
    return RATINGS.find(name)


@dataclass(frozen=True, slots=True, eq=False)
class CellAssessment:
    """Probabilities and rating of every cell."""

    evidence: Evidence
    rating: FloatArray
    """[cells] how safe a passage is, in [0, 1]."""

    __repr__ = brief

    @property
    def map(self) -> FloatArray:
        """[cells] P_OM (5.54)."""
        return self.evidence.map

    @property
    def obstacle(self) -> FloatArray:
        """[cells] P_O (4.17)."""
        return self.evidence.obstacle


def assess_cells(
    evidence: Evidence,
    rating: Rating = total,
    unknown: float = 0.0,
    unknown_unseen: float = 1.0,
) -> CellAssessment:
    """Rate all cells; P_O (4.17) and P_OM (5.54) are computed only for a rating that needs them.

    Parameters
    ----------
    evidence
        What every source says of every cell.
    rating
        One of `RATINGS`, or a user's by `own_rating`.
    unknown
        How far hidden space counts as blocked, u in [0, 1].
    unknown_unseen
        The same for columns without any beam.
    """
    unknown_cells = np.where(evidence.seen, float(unknown), float(unknown_unseen))
    return CellAssessment(evidence, rating(evidence, unknown_cells))


@compiled
def obstacle_of(
    detected: Floats,
    visibility: Floats,
    map_base: Floats,
    intruder: Floats,
) -> tuple[Floats, Floats]:
    """P_OM (5.54) and P_O (4.17) of every cell."""
    cells = len(detected)
    map_probability, obstacle = np.empty(cells), np.empty(cells)
    for cell in range(cells):
        map_probability[cell] = map_base[cell] * (1.0 - visibility[cell])
        free = (1.0 - intruder[cell]) * (1.0 - map_probability[cell]) * (1.0 - detected[cell])
        obstacle[cell] = 1.0 - free
    return map_probability, obstacle
