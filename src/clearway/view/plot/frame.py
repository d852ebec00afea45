"""Modules on their levels, and what flows between them (fig. 7.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

Module = tuple[str, str, tuple[str, ...]]
"""Level, name, and what holds it."""
Flow = tuple[str, str, str]
"""From, to, and what flows."""

PLACES = ((0.0, 2.0), (3.2, 3.3), (6.4, 2.0), (3.2, 2.0), (3.2, 0.7), (3.2, -0.6))
"""Centres of the boxes, in the order of the modules."""
WIDTH = 1.9
HEIGHT = 0.62
LEVELS = ("#e4eef8", "#f7ecd4", "#e9f3e4")
INK = "#222222"
ARROW = "#5c6370"


def draw_frame(modules: Sequence[Module], flows: Sequence[Flow], title: str) -> Figure:
    """One box per module, coloured by level, with an arrow per flow."""
    figure = Figure(figsize=(11.0, 6.6), layout="constrained")
    figure.suptitle(title)
    axes = figure.add_subplot()
    levels = list(dict.fromkeys(level for level, _, _ in modules))
    places = {name: np.array(at) for (_, name, _), at in zip(modules, PLACES, strict=True)}
    for level, name, rooms in modules:
        _box(axes, places[name], LEVELS[levels.index(level)], name, rooms)
    for number, level in enumerate(levels):
        axes.plot([], [], "s", color=LEVELS[number], mec=ARROW, ms=12, label=level)
    for start, end, what in flows:
        _arrow(axes, places[start], places[end], what)
    axes.set(xlim=(-1.2, 7.6), ylim=(-1.2, 3.9))
    axes.set_axis_off()
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return figure


def _box(
    axes: Axes,
    center: np.ndarray[tuple[int], np.dtype[np.float64]],
    color: str,
    name: str,
    rooms: tuple[str, ...],
) -> None:
    corner = (float(center[0]) - 0.5 * WIDTH, float(center[1]) - 0.5 * HEIGHT)
    axes.add_patch(
        FancyBboxPatch(
            corner, WIDTH, HEIGHT, boxstyle="round,pad=0.04", facecolor=color, edgecolor=ARROW
        )
    )
    axes.text(center[0], center[1] + 0.17, name, ha="center", va="center", weight="bold", color=INK)
    axes.text(
        center[0],
        center[1] - 0.12,
        "\n".join(rooms),
        ha="center",
        va="center",
        fontsize=8,
        color=INK,
    )


def _arrow(
    axes: Axes,
    start: np.ndarray[tuple[int], np.dtype[np.float64]],
    end: np.ndarray[tuple[int], np.dtype[np.float64]],
    what: str,
) -> None:
    across = end - start
    level = abs(float(across[1])) < 0.1
    reach = np.array([0.5 * WIDTH + 0.08, 0.0]) if level else np.array([0.0, 0.5 * HEIGHT + 0.08])
    tail, head = start + np.sign(across) * reach, end - np.sign(across) * reach
    bend = 0.0
    if not level and abs(float(across[0])) > 0.1:  # Back to the side: from box side to box foot.
        tail = start + np.array([np.sign(across[0]) * (0.5 * WIDTH + 0.08), 0.0])
        bend = -0.3
    axes.add_patch(
        FancyArrowPatch(
            (float(tail[0]), float(tail[1])),
            (float(head[0]), float(head[1])),
            connectionstyle=f"arc3,rad={bend}",
            arrowstyle="-|>",
            mutation_scale=14,
            color=ARROW,
        )
    )
    middle = 0.5 * (tail + head) + (np.array([0.0, 0.1]) if level else np.array([0.1, 0.0]))
    middle = middle + (np.array([-1.5, -0.45]) if bend else 0.0)
    axes.text(
        float(middle[0]),
        float(middle[1]),
        what,
        fontsize=9,
        color=INK,
        ha="center" if level else "left",
        va="bottom" if level else "center",
    )
