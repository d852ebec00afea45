"""Figs. 6.2-6.13: the obstacle space of an intruder by each model, and the reach set left by it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from clearway.base.frames import FloatArray
from clearway.studies.reproduction.intruder_cases import (
    CASES,
    MIDDLE_ROW,
    Assessed,
    IntersectionCase,
    assess_intruder_alone,
    intruder_of_6_3,
    model_cells,
)
from clearway.studies.reproduction.obstacle_spaces import OBSTACLE_SPACES
from clearway.studies.reproduction.reach_spaces import REACH_SPACES
from clearway.studies.reproduction.target import Exhibit
from clearway.traffic import Intruder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from clearway.view.plot.cells import Border, CellView, Line, Quantity

INTRUDER = "#1f3fd6"
OUTLINE = "#4f9be8"
TRACK_S = 16.0
"""Flight of the intruder that is drawn: into the grid and out of it."""


def intruder_figures() -> tuple[Exhibit, ...]:
    """The twelve figures in the paper's order."""
    exhibits = []
    for case in CASES:
        probability, _ = model_cells(case.model, case.timed)
        assessed = assess_intruder_alone(probability)
        exhibits += [
            Exhibit(
                f"Figure {case.obstacle_figure}",
                f"obstacle space, {case.title}",
                OBSTACLE_SPACES[case.obstacle_figure](assessed),
                partial(draw_obstacle_space, case, assessed),
            ),
            Exhibit(
                f"Figure {case.reach_figure}",
                f"reach set, {case.title}",
                REACH_SPACES[case.reach_figure](assessed),
                partial(draw_reach_space, case, assessed),
            ),
        ]
    return tuple(exhibits)


def draw_obstacle_space(case: IntersectionCase, assessed: Assessed) -> Figure:
    """Trajectories by the obstacle probability where they are, and that of cells."""
    from clearway.view.plot.assessment import draw_panels, largest_in_movement

    return draw_panels(
        assessed.reach_set,
        largest_in_movement(assessed.reach_set, assessed.cells.obstacle),
        obstacle_colors(case.model, assessed),
        np.zeros((0, 3)),
        f"Figure {case.obstacle_figure}: obstacle space, {case.title}",
        "Trajectories by the obstacle probability where they are",
        view_case(case),
    )


def obstacle_colors(model: str, assessed: Assessed) -> Quantity:
    """Obstacle probability of all cells."""
    from matplotlib.colors import PowerNorm

    from clearway.view.plot.assessment import obstacle_quantity

    cells = assessed.cells
    quantity = obstacle_quantity(cells, np.zeros_like(cells.evidence.coated))
    if model != "spread":
        return quantity
    # Most of what a spread has lies below a tenth.
    label = f"{quantity.label} (colours by its square root)"
    return replace(quantity, scale=PowerNorm(0.5, 0.0, 1.0), label=label)


def draw_reach_space(case: IntersectionCase, assessed: Assessed) -> Figure:
    """Trajectories by their rating so far, and the reachability of cells."""
    from clearway.view.plot.assessment import draw_panels, reachability_quantity

    return draw_panels(
        assessed.reach_set,
        assessed.reach.node_rating,
        reachability_quantity(assessed.reach),
        np.zeros((0, 3)),
        f"Figure {case.reach_figure}: reach set, {case.title}",
        "Trajectories by their reachability so far",
        view_case(case),
    )


def view_case(case: IntersectionCase) -> CellView:
    """The paper's panels: ahead to the right, so that the intruder comes from the top."""
    from clearway.view.plot.cells import CellView

    intruder = intruder_of_6_3()
    border = {"line": None, "body": body_border, "spread": cone_border}[case.model]
    return CellView(
        rows=None if case.all_layers else (MIDDLE_ROW,),
        ahead="right",
        lines=(track_of(intruder),),
        border=None if border is None else border(intruder),
    )


def track_of(intruder: Intruder) -> Line:
    """The straight line that the intruder flies."""
    from clearway.view.plot.cells import Line

    return Line(_ahead_of(intruder, np.zeros(3)), "intruder's line", INTRUDER, start="o")


def body_border(intruder: Intruder) -> Border:
    """Around all that the body flies through."""
    from clearway.view.plot.cells import Border

    def outside(points_m: FloatArray) -> FloatArray:
        along = intruder.velocity_mps / intruder.speed_mps
        offset = points_m - intruder.position_m
        ahead = np.maximum(offset @ along, 0.0)
        return np.asarray(
            np.linalg.norm(offset - ahead[:, None] * along, axis=1) - intruder.radius_m
        )

    return Border(outside, "border of its body's way", OUTLINE)


def cone_border(intruder: Intruder) -> Border:
    """Around the cone of uncertainty, semi-axes by (5.16); for an intruder that flies level."""
    from clearway.view.plot.cells import Border

    along = intruder.velocity_mps / intruder.speed_mps
    across = np.cross([0.0, 0.0, 1.0], along)
    horizontal, vertical = np.sin(intruder.spread_rad)

    def outside(points_m: FloatArray) -> FloatArray:
        offset = points_m - intruder.position_m
        semi_axis = np.hypot(offset @ across / horizontal, offset[:, 2] / vertical)
        return np.asarray(semi_axis - offset @ along)

    growth = (horizontal * across, vertical * np.array([0.0, 0.0, 1.0]))
    edges = [_ahead_of(intruder, sign * axis) for axis in growth for sign in (1.0, -1.0)]
    return Border(outside, "border of its spread", OUTLINE, tuple(edges))


def _ahead_of(intruder: Intruder, aside: FloatArray) -> FloatArray:
    """[n, 3] points of a ray from the intruder that goes to the side by so much per second of
    flight."""
    time_s = np.linspace(0.0, TRACK_S, 400)[:, None]
    velocity = intruder.velocity_mps + intruder.speed_mps * aside
    points: FloatArray = intruder.position_m + time_s * velocity
    return points
