"""Figs. 5.5-5.8: what is visible of a row of ten cells behind up to three hindrances."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.sensors.cells.visibility import visibility
from clearway.studies.reproduction.target import Exhibit, Findings, Measure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CELLS = 10
HINDRANCES = ((3, 0.25), (5, 0.15), (7, 0.20))
"""Cell, counted from 1, and hindrance of each obstacle, in the order of their detection."""

FIGURES = (
    ("5.5", "free space", "All cells are completely visible.", {10: 1.0}),
    ("5.6", "first obstacle", "Cell 3 is visible, cells 4-10 are at 75 %.", {3: 1.0, 10: 0.75}),
    ("5.7", "second obstacle", "Cells 6-10 are lowered by 15 to 60 %.", {4: 0.75, 10: 0.6}),
    ("5.8", "third obstacle", "Cells 8-10 are lowered by 20 to 40 %.", {7: 0.6, 10: 0.4}),
)
"""Number, title, claim, and visibility that it gives of some cells."""

OF_HINDRANCE = (
    "None in the figure. It needs the hindrance of a cell to be its share of hits, as used here; "
    "(5.42) as printed is 1 minus that share, so that empty cells would hide what is behind them."
)


def visibility_figures() -> tuple[Exhibit, ...]:
    """The four figures, obstacles added one by one."""
    grid = AvoidanceGrid.uniform(float(CELLS), CELLS, columns=1, rows=1)
    exhibits = []
    for count, (figure, title, claim, stated) in enumerate(FIGURES):
        hindrance = np.zeros(CELLS)
        for cell, value in HINDRANCES[:count]:
            hindrance[cell - 1] = value
        visible = visibility(grid, hindrance, np.ones(1, dtype=np.int64))
        exhibits.append(
            Exhibit(
                f"Figure {figure}",
                f"visibility of a row of cells, {title}",
                _findings(claim, stated, visible, count > 0),
                partial(
                    _draw, f"Figure {figure}: visibility of a row, {title}", hindrance, visible
                ),
            )
        )
    return tuple(exhibits)


def _findings(
    claim: str, stated: dict[int, float], visible: FloatArray, hindered: bool
) -> Findings:
    return Findings(
        claim=claim,
        ours=f"From cell 1 to 10: {', '.join(f'{value:g}' for value in visible.round(9))}.",
        difference=OF_HINDRANCE if hindered else "",
        measures=tuple(
            Measure(f"visibility of cell {cell}", float(visible[cell - 1]), value, "paper", 1e-8)
            for cell, value in stated.items()
        ),
    )


def _draw(title: str, hindrance: FloatArray, visible: FloatArray) -> Figure:
    from clearway.view.plot.row import draw_row

    return draw_row(title, hindrance, visible)
