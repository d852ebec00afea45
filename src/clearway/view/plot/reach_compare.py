"""Nodes against coverage: what each method pays for cells and footprints."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from clearway.reach.compare.comparison import Comparison, MethodRow, SpreadPoint

# Okabe-Ito, distinct to colour-blind eyes.
LINES = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Of methods with a spread, in the order of their registry."""
SINGLE = "#222222"
MARKS = ("^", "s", "D", "*", "v", "P", "X", "o")
"""Of methods without."""
TICKS = (100, 200, 500, 1000, 2000, 5000, 10000)


def draw_spreads(comparison: Comparison, spreads: Mapping[str, tuple[SpreadPoint, ...]]) -> Figure:
    """Share of reachable cells, and distinct footprints, over nodes; lines join the spreads."""
    figure = Figure(figsize=(13.0, 5.8), dpi=130, layout="constrained")
    left, right = figure.subplots(1, 2)
    reachable = comparison.reachable.number
    for (method, points), color in zip(spreads.items(), cycle(LINES), strict=False):
        nodes = [point.coverage.nodes for point in points]
        cells = [point.coverage.cells_covered / reachable for point in points]
        prints = [point.coverage.footprints for point in points]
        for axes, values in ((left, cells), (right, prints)):
            axes.plot(nodes, values, "o-", color=color, ms=4, label=method)
        for at in (0, len(points) - 1):
            _note(left, nodes[at], cells[at], str(points[at].spread), color)
            _note(right, nodes[at], prints[at], str(points[at].spread), color)
    alone = [row for row in comparison.rows if not row.contender.tuning]
    for row, mark in zip(alone, cycle(MARKS), strict=False):
        _single(left, right, row, reachable, mark)
    left.set(ylabel="share of reachable cells covered", ylim=(0.0, 1.08))
    right.set(ylabel="distinct footprints", yscale="log")
    for axes in (left, right):
        axes.set(xlabel="nodes", xscale="log")
        low, high = axes.get_xlim()
        axes.set_xticks([tick for tick in TICKS if low <= tick <= high])
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    figure.legend(
        *left.get_legend_handles_labels(), loc="outside lower center", ncols=7, frameon=False,
        title="numbers beside curves: nodes of a cell that go on",
    )  # fmt: skip
    layers, columns, rows = comparison.grid.shape
    figure.suptitle(
        f"Nodes against coverage, {layers} x {columns} x {rows} cells, "
        f"{len(comparison.automaton.movements)} movements",
    )
    return figure


def _single(left: Axes, right: Axes, row: MethodRow, reachable: int, mark: str) -> None:
    """A method without a spread: one mark of its own."""
    for axes, value in (
        (left, row.coverage.cells_covered / reachable),
        (right, float(row.coverage.footprints)),
    ):
        axes.plot(
            row.coverage.nodes,
            value,
            mark,
            color=SINGLE,
            ms=7,
            mfc="none",
            label=row.contender.method,
        )


def _note(axes: Axes, x: float, y: float, text: str, color: str) -> None:
    axes.annotate(
        text, (x, y), textcoords="offset points", xytext=(5, 5), fontsize=8.5, color=color
    )
