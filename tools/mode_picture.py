"""The picture of modes in docs/safety.md, drawn from the guards themselves:
`python -m tools.mode_picture FILE`."""

from __future__ import annotations

import sys
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from clearway.live.outputs.modes import GUARDS, Guard
from clearway.view.plot.playback import MODES

STEP, TOP = 1.0, 0.5
QUESTION, ANSWER = (0.0, 5.6), (6.9, 2.2)
"""Left end and width of the boxes of guards, and of modes."""
HEIGHT = 0.62


def draw_modes() -> Figure:
    """Guards from first to last, and the mode that each leads to."""
    figure = Figure(figsize=(9.6, 0.72 * len(GUARDS) + 1.2), layout="constrained")
    axes = figure.add_subplot()
    axes.set_axis_off()
    axes.set_xlim(-0.2, 9.9)
    axes.set_ylim(-STEP * len(GUARDS) + 0.35, TOP + 0.75)
    axes.text(0.0, TOP + 0.45, "every decision asks:", fontsize=10, color="#39444f")
    for number, guard in enumerate(GUARDS):
        _draw_guard(axes, guard, -STEP * number, last=number + 1 == len(GUARDS))
    axes.annotate(
        "",
        (-0.0 + 0.6, 0.5 * HEIGHT),
        (0.6, TOP + 0.36),
        arrowprops={"arrowstyle": "-|>", "color": "#39444f"},
    )
    low, high = -STEP * (len(GUARDS) - 1), TOP + 0.5
    for number in range(len(GUARDS)):
        level = [-STEP * number] * 2
        axes.plot([sum(ANSWER) + 0.1, 9.45], level, color="#9aa7b3", linewidth=1.0)
    back = [(sum(ANSWER) + 0.1, low), (9.45, low), (9.45, high), (2.1, high)]
    axes.plot(*zip(*back, strict=True), color="#9aa7b3", linewidth=1.0)
    _arrow(axes, (2.2, high), (1.9, high))
    beside = (9.75, 0.5 * (low + high))
    axes.text(*beside, "the next decision", rotation=-90, va="center", ha="right", fontsize=9)
    return figure


def _draw_guard(axes: Axes, guard: Guard, y: float, *, last: bool) -> None:
    color = MODES[str(guard.mode)]
    _box(axes, *QUESTION, y, "#f4f6f8", "#9aa7b3")
    axes.text(QUESTION[0] + 0.15, y, guard.when, va="center", fontsize=9.5, color="#22303c")
    _box(axes, *ANSWER, y, color, color)
    middle = ANSWER[0] + 0.5 * ANSWER[1]
    axes.text(middle, y, guard.mode, va="center", ha="center", color="white", weight="bold")
    _arrow(axes, (sum(QUESTION), y), (ANSWER[0], y))
    beside = 0.5 * (sum(QUESTION) + ANSWER[0])
    axes.text(beside, y + 0.12, "always" if last else "yes", ha="center", fontsize=8.5)
    if not last:
        _arrow(axes, (0.6, y - 0.5 * HEIGHT), (0.6, y - STEP + 0.5 * HEIGHT))
        axes.text(0.72, y - 0.5 * STEP, "no", va="center", fontsize=8.5)


def _box(axes: Axes, left: float, width: float, y: float, face: str, edge: str) -> None:
    shape = "round,pad=0,rounding_size=0.12"
    corner = (left, y - 0.5 * HEIGHT)
    axes.add_patch(
        FancyBboxPatch(corner, width, HEIGHT, boxstyle=shape, facecolor=face, edgecolor=edge)
    )


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    axes.add_patch(
        FancyArrowPatch(
            start,
            end,
            arrowstyle="-|>",
            mutation_scale=11,
            color="#39444f",
            shrinkA=0.0,
            shrinkB=0.0,
        )
    )


def main() -> None:
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("docs/images/modes.png")
    draw_modes().savefig(target, dpi=90)


if __name__ == "__main__":
    main()
