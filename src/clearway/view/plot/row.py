"""One row of cells from near to far: what each hides, and what is left to see (figs. 5.5-5.8)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from clearway.base.frames import FloatArray

SEEN = "#ded5a4"
HIDDEN = "#2d3463"
HINDERED = "#b2182b"


def draw_row(title: str, hindrance: FloatArray, visible: FloatArray) -> Figure:
    """Visibility [cells] as bars, and the hindrance [cells] of cells that have one within them."""
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    figure.suptitle(title)
    axes = figure.add_subplot()
    cells = np.arange(1, len(visible) + 1)
    axes.bar(cells, visible, 0.92, color=SEEN, label="visible")
    axes.bar(cells, 1.0 - visible, 0.92, visible, color=HIDDEN, label="hidden by nearer cells")
    hinders = np.flatnonzero(hindrance)
    if len(hinders):
        axes.bar(
            cells[hinders],
            hindrance[hinders],
            0.92,
            visible[hinders] - hindrance[hinders],
            facecolor="none",
            edgecolor=HINDERED,
            hatch="////",
            label="hidden by this cell from those behind",
        )
    for cell, value in zip(cells, visible, strict=True):
        axes.annotate(f"{value:.0%}", (cell, 0.03), horizontalalignment="center", color="#222222")
    axes.set_xticks(cells)
    axes.set_xlabel("cell of the row, from the vehicle outwards")
    axes.set_ylabel("share of the cell")
    axes.set_ylim(0.0, 1.0)
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return figure
