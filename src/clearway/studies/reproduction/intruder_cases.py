"""The intruder of section 6.3 by each model that figs. 6.2-6.13 show, all in reference accuracy.

The vehicle moves straight out at 1 m/s: it is in layer i of the grid from i - 1 to i seconds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from clearway.avoidance.rate.fusion import CellAssessment, Evidence, assess_cells
from clearway.avoidance.rate.reach_rating import ReachAssessment, rate_reach_set
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray
from clearway.reach.sets import build_reach_set
from clearway.reach.tree import ReachSet
from clearway.traffic import (
    Intruder,
    ModelCells,
    VehicleTimes,
    assess_intruders,
    radial_vehicle_times,
)
from clearway.vehicle.automaton import MovementAutomaton

SPEED_MPS = 1.0
BODY_RADIUS_M = 1.0
"""The text of fig. 6.8; section 6.3 says 2 m."""

REACHABLE = 0.5
"""Reachability from which a cell counts as reachable."""

MIDDLE_ROW = 2


@dataclass(frozen=True, slots=True)
class IntersectionCase:
    """One intersection model, shown in two figures."""

    obstacle_figure: str
    reach_figure: str
    title: str
    model: str
    timed: bool | str
    all_layers: bool
    """All five layers are shown, or only the middle one."""


CASES = (
    IntersectionCase("6.2", "6.3", "static line", "line", False, False),
    IntersectionCase("6.4", "6.5", "timed line", "line", True, False),
    IntersectionCase("6.6", "6.7", "timed line with future movement", "line", "future", False),
    IntersectionCase("6.8", "6.9", "timed body volume", "body", True, True),
    IntersectionCase("6.10", "6.11", "static uncertainty spread", "spread", False, True),
    IntersectionCase("6.12", "6.13", "timed uncertainty spread", "spread", True, True),
)


@dataclass(frozen=True, slots=True, eq=False)
class Assessed:
    """What an intruder leaves of the reach set."""

    cells: CellAssessment
    reach_set: ReachSet
    reach: ReachAssessment

    @property
    def probability(self) -> FloatArray:
        """[cells] of meeting the intruder."""
        return self.cells.evidence.intruder

    @property
    def rated(self) -> FloatArray:
        """[trajectories] rating at the end of each."""
        return self.reach.node_rating[self.reach_set.trajectories]

    def row(self, per_cell: FloatArray, row: int = MIDDLE_ROW) -> FloatArray:
        """[layers, columns] of a row, counted from the bottom."""
        shaped: FloatArray = per_cell.reshape(self.reach_set.grid.shape)[:, :, row]
        return shaped

    def row_reachability(self, row: int = MIDDLE_ROW) -> FloatArray:
        """[layers, columns] of a row; NaN without a trajectory."""
        return self.row(np.where(self.reach.passed, self.reach.reachability, np.nan), row)

    def count_lost(self, row: int = MIDDLE_ROW) -> tuple[int, int]:
        """Cells of a row with a trajectory: those not reachable, and all."""
        values = self.row_reachability(row)
        return int(np.sum(values < REACHABLE)), int(np.sum(~np.isnan(values)))


@lru_cache(maxsize=1)
def grid_of_6_3() -> AvoidanceGrid:
    """10 m, 10 x 7 x 5 cells, +-45 and +-30 deg."""
    return AvoidanceGrid.uniform()


def intruder_of_6_3(radius_m: float = BODY_RADIUS_M) -> Intruder:
    """From the left flank straight across, in the grid's frame."""
    return Intruder(
        np.array([6.0, 8.0, 0.0]),
        np.array([0.0, -1.0, 0.0]),
        spread_rad=np.array([math.pi / 12, math.pi / 16]),
        radius_m=radius_m,
    )


@lru_cache(maxsize=1)
def reach_set_of_6_3() -> ReachSet:
    """The combined method with table 6.1's tuning, from level flight, pitch not limited."""
    automaton = MovementAutomaton.plane(SPEED_MPS, 15.0, pitch_limit_deg=None)
    return build_reach_set(automaton, grid_of_6_3(), method="combined", spread=8, harmonic=1)


def model_cells(
    model: str, timed: bool | str = False, radius_m: float = BODY_RADIUS_M
) -> tuple[FloatArray, ModelCells]:
    """P_OI [cells] (5.36) of one model, and all that the model says, [cells]."""
    return meet_at(model, timed, radius_m, radial_vehicle_times(grid_of_6_3(), SPEED_MPS))


def meet_at(
    model: str, timed: bool | str, radius_m: float, times: VehicleTimes
) -> tuple[FloatArray, ModelCells]:
    """The same with other times of the vehicle."""
    cells = assess_intruders(
        grid_of_6_3(), [intruder_of_6_3(radius_m)], [model], timed, times, accuracy="reference"
    )
    return cells.probability, cells.intruders[0][model]


def assess_intruder_alone(probability: FloatArray) -> Assessed:
    """The reach set rated where nothing but an intruder is known, P_OI [cells].

    Everything is visible, so all four ratings are 1 - P_OI.
    """
    reach_set = reach_set_of_6_3()
    cells = assess_cells(replace(Evidence.free(reach_set.grid), intruder=probability))
    return Assessed(cells, reach_set, rate_reach_set(reach_set, cells.rating, REACHABLE))


def ends_left(assessed: Assessed) -> tuple[BoolArray, BoolArray]:
    """[trajectories] that end on the left, where the intruder comes from, and on the right."""
    left_m = assessed.reach_set.states[assessed.reach_set.trajectories, 1]
    return left_m > 1e-9, left_m < -1e-9
