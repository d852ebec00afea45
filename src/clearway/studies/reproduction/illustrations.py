"""Figs. 2.3 and 2.4, which the paper draws by hand: what they say, computed."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from clearway.avoidance.scene import SceneAssessment, assess_scene
from clearway.base.frames import FloatArray, spherical_from_cartesian
from clearway.missions.scene_reading import scene_of
from clearway.reach.tree import LAST_LAYER
from clearway.studies.reproduction.intruder_cases import (
    Assessed,
    assess_intruder_alone,
    intruder_of_6_3,
    model_cells,
)
from clearway.studies.reproduction.intruder_figures import cone_border, obstacle_colors, track_of
from clearway.studies.reproduction.target import Exhibit, Findings, Measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POLE_M = (6.0, 0.7, 0.0)
POLE_RADIUS_M = 0.5
SCENE = {
    "grid": {"rows": 1},
    "obstacle": [
        {
            "shape": "line",
            "position_m": POLE_M,
            "orientation_deg": (0.0, 90.0, 0.0),
            "size_m": [12.0],
            "radius_m": POLE_RADIUS_M,
        }
    ],
    "scan": {"simulate": {"beams_per_cell": (40, 10)}},
    "rating": {"name": "visible"},
    "reach_set": {"method": "combined", "spread": 40, "harmonic": 20},
}
"""A pole ahead, seen by a LiDAR, in a grid of one row; rated as 2.2.2 says, P_V (1 - P_O)."""

DESTINATION = (9, 2)
"""Layer and column of the cell to which the three trajectories lead, behind the pole."""

QUESTIONABLE = 0.5
LOWERED = 0.95
"""Cells rated below it count as not wholly safe."""


def illustrations() -> tuple[Exhibit, ...]:
    """Both figures."""
    spread = assess_intruder_alone(model_cells("spread")[0])
    scene = assess_scene(scene_of("figure 2.4", SCENE, Path(), "figure 2.4").scene)
    chosen = trajectories_of_2_4(scene)
    return (
        Exhibit(
            "Figure 2.3",
            "collision probability of an intruder with spread",
            _spread_findings(spread),
            partial(_draw_spread, spread),
        ),
        Exhibit(
            "Figure 2.4",
            "trajectories to the same cell with different safety",
            _safety_findings(scene, chosen),
            partial(_draw_safety, scene, chosen),
        ),
    )


def trajectories_of_2_4(scene: SceneAssessment) -> tuple[int, int, int]:
    """End nodes of the least safe, a questionable, and the safest trajectory to the cell.

    Of equals the one that stays most level.
    """
    reach_set = scene.reach_set
    layer, column = DESTINATION
    cell = layer * reach_set.grid.columns + column
    there = np.flatnonzero((reach_set.exit_kind == LAST_LAYER) & (reach_set.end_cell == cell))
    rating = scene.reach.node_rating[there]
    height = np.array(
        [np.abs(reach_set.samples_m[reach_set.path(int(leaf)), :, 2]).max() for leaf in there]
    )
    least, middle, best = (
        int(there[np.lexsort((height, np.abs(rating - wanted).round(9)))[0]])
        for wanted in (0.0, QUESTIONABLE, 1.0)
    )
    return least, middle, best


def count_lowered_cells(scene: SceneAssessment, leaf: int) -> int:
    """Cells on the way to a node that are not wholly safe."""
    reach_set = scene.reach_set
    passed = [
        reach_set.cell_index[reach_set.cell_start[n] : reach_set.cell_start[n + 1]]
        for n in reach_set.path(leaf)
    ]
    return int(np.sum(scene.cells.rating[np.concatenate(passed)] < LOWERED))


def _spread_findings(spread: Assessed) -> Findings:
    middle = spread.row(spread.probability)
    largest = middle.max(axis=0)[::-1]
    return Findings(
        claim="Without regard to time, cells on the intruder's line have the highest probability, "
        "those between it and the lines of its spread a lower one.",
        ours="With the intruder of 6.3, the largest of each column from left to right, along its "
        f"flight: {', '.join(f'{value:.2f}' for value in largest)}.",
        difference="The text speaks of the distance from the line alone; computed, the probability "
        "falls as much with the way flown, as the spread widens.",
        measures=(
            Measure("cells of the middle layer met", int(np.count_nonzero(middle))),
            Measure("largest", float(middle.max())),
        ),
    )


def _safety_findings(scene: SceneAssessment, chosen: tuple[int, int, int]) -> Findings:
    ratings = [float(scene.reach.node_rating[leaf]) for leaf in chosen]
    lowered = [count_lowered_cells(scene, leaf) for leaf in chosen]
    names = ("dangerous", "questionable", "safe")
    return Findings(
        claim="Three trajectories lead to the same destination: one through many unsafe cells is "
        "dangerous, one through a few is questionable, and one through a single cell of medium "
        "safety is safe.",
        ours="Behind a pole, "
        + ", ".join(
            f"{name}: {rating:.2f} through {count} unsafe cells"
            for name, rating, count in zip(names, ratings, lowered, strict=True)
        )
        + ".",
        difference="The drawing gives no numbers: here a pole of 0.5 m radius at [6, 0.7] stands "
        "for its obstacle, and the safest trajectory to the cell meets no lowered cell at all.",
        measures=tuple(
            Measure(f"rating of the {name} trajectory", rating)
            for name, rating in zip(names, ratings, strict=True)
        ),
    )


def _draw_spread(spread: Assessed) -> Figure:
    from clearway.view.plot.assessment import draw_cells_alone
    from clearway.view.plot.cells import CellView

    intruder = intruder_of_6_3()
    return draw_cells_alone(
        spread.reach_set.grid,
        obstacle_colors("spread", spread),
        "Figure 2.3: collision probability of an intruder with spread",
        CellView((2,), "up", (track_of(intruder),), cone_border(intruder)),
    )


def _draw_safety(scene: SceneAssessment, chosen: tuple[int, int, int]) -> Figure:
    from clearway.view.plot.assessment import PASSABLE, draw_cells_alone
    from clearway.view.plot.cells import Border, CellView, Line, Quantity
    from clearway.view.plot.reach import path_m

    def outside(points_m: FloatArray) -> FloatArray:
        # At eye level, though the row is high: points are drawn at their range.
        distance, azimuth, _ = spherical_from_cartesian(points_m).T
        level = distance[:, None] * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
        return np.asarray(np.linalg.norm(level - np.array(POLE_M[:2]), axis=1) - POLE_RADIUS_M)

    names = (("dangerous", "#111111"), ("questionable", "#d95f02"), ("safe", "#1a9850"))
    lines = tuple(
        Line(path_m(scene.reach_set, leaf), f"{name}: {rating:.2f}", color)
        for (name, color), leaf, rating in zip(
            names, chosen, scene.reach.node_rating[list(chosen)], strict=True
        )
    )
    nothing = np.zeros(scene.scene.grid.cells, dtype=np.bool_)
    return draw_cells_alone(
        scene.scene.grid,
        Quantity("safety of the cell: 0 blocked, 1 free", scene.cells.rating, PASSABLE, nothing),
        "Figure 2.4: trajectories to the same cell with different safety",
        CellView(lines=lines, border=Border(outside, "obstacle O", "#c51b8a")),
    )
