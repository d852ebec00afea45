"""The drawn picture of how a decision is made, for the first page: docs/images/pipeline.svg."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch, Wedge

OWN, GREY, LIGHT, RED, AMBER = "#0072b2", "#4a4a4a", "#f1f3f5", "#c0392b", "#e69f00"
SOURCES = (
    ("LiDAR scans", "returns, and beams without"),
    ("Traffic", "ADS-B, tracks, recordings"),
    ("Map", "buildings, zones, terrain"),
)
STEPS = (
    ("Reach set", "what the vehicle can fly,\ncomputed once"),
    ("Verification", "best candidates against\nthe evidence itself"),
    ("Decision", "one trajectory, its reasons,\nand a held escape"),
)


def draw_pipeline(path: Path) -> None:
    """Draw and save it."""
    # Letters as outlines: the same wherever it is looked at. Nothing of the moment goes into it.
    settings: Any = {
        "font.family": "DejaVu Sans",
        "svg.fonttype": "path",
        "svg.hashsalt": "clearway",
    }
    with plt.rc_context(settings):
        figure, axes = plt.subplots(figsize=(10.4, 4.3))
        axes.set_xlim(0.0, 26.0)
        axes.set_ylim(0.0, 10.75)
        axes.set_aspect("equal")
        axes.axis("off")
        for number, (title, about) in enumerate(SOURCES):
            _box(axes, (0.3, 7.75 - 3.0 * number), (5.6, 2.2), title, about)
            _arrow(axes, (6.0, 8.85 - 3.0 * number), (8.1, 6.6 - 1.2 * number))
        _grid(axes, (8.6, 5.4), 7.0)
        axes.text(11.8, 0.75, "Avoidance grid: how likely each cell is\nblocked, seen, and reached",
                  ha="center", va="center", fontsize=9, color=GREY)  # fmt: skip
        axes.text(
            11.8, 10.15, "all sources, fused cell by cell", ha="center", fontsize=9, color=GREY
        )
        for number, (title, about) in enumerate(STEPS):
            _box(axes, (18.4, 7.75 - 3.0 * number), (7.2, 2.2), title, about, number == 2)
        _arrow(axes, (18.3, 8.7), (15.6, 7.4))
        _arrow(axes, (15.9, 5.4), (18.3, 5.8))
        _arrow(axes, (22.0, 4.65), (22.0, 4.05))
        figure.savefig(path, bbox_inches="tight", pad_inches=0.05, metadata={"Date": None})
        plt.close(figure)


def _box(
    axes: Any,
    corner: tuple[float, float],
    size: tuple[float, float],
    title: str,
    about: str,
    own: bool = False,
) -> None:
    axes.add_patch(
        FancyBboxPatch(corner, *size, boxstyle="round,pad=0,rounding_size=0.35", linewidth=1.4,
                       facecolor=LIGHT, edgecolor=OWN if own else GREY)
    )  # fmt: skip
    middle = corner[0] + size[0] / 2.0
    lines = about.count("\n") + 1
    axes.text(middle, corner[1] + size[1] - 0.55, title, ha="center", va="center", fontsize=11,
              fontweight="bold", color=OWN if own else "black")  # fmt: skip
    axes.text(middle, corner[1] + (0.75 if lines > 1 else 0.8), about, ha="center", va="center",
              fontsize=8.5, color=GREY)  # fmt: skip


def _arrow(axes: Any, start: tuple[float, float], end: tuple[float, float]) -> None:
    axes.add_patch(
        FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=14, linewidth=1.4, color=GREY)
    )


def _grid(axes: Any, origin: tuple[float, float], reach: float) -> None:
    """Cells from above, an obstacle in some, what it hides, and trajectories through the rest."""
    edges, rings = np.linspace(-34.0, 34.0, 6), np.linspace(0.0, reach, 6)
    for column in range(5):
        for layer in range(5):
            blocked = (column, layer) in ((2, 2), (3, 2))
            hidden = (column, layer) in ((2, 3), (3, 3), (2, 4), (3, 4))
            colour = RED if blocked else "#d9dde1" if hidden else "#e8f4ea"
            axes.add_patch(
                Wedge(origin, rings[layer + 1], edges[column], edges[column + 1],
                      width=rings[layer + 1] - rings[layer], facecolor=colour, edgecolor="white",
                      linewidth=1.0)
            )  # fmt: skip
    along = np.linspace(0.0, 1.0, 60)
    for bend in (-0.54, -0.37, -0.08, 0.1, 0.26):
        turned = bend * along**1.3 * 1.05
        x = origin[0] + reach * 0.97 * along * np.cos(turned)
        y = origin[1] + reach * 0.97 * along * np.sin(turned)
        chosen = bend == -0.37
        free = bend < -0.2
        axes.plot(x, y, color=OWN if chosen else AMBER if free else GREY,
                  linewidth=2.6 if chosen else 1.1, linestyle="-" if free else (0, (3, 2)),
                  solid_capstyle="round")  # fmt: skip
    axes.plot(*origin, marker=(3, 0, -90), markersize=15, color=OWN)


def main() -> None:
    images = Path(__file__).resolve().parent.parent / "docs" / "images"
    draw_pipeline(images / "pipeline.svg")


if __name__ == "__main__":
    main()
