"""Nodes against coverage: what each method pays for cells and footprints."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from clearway.reach.comparison import Comparison, MethodRow, SpreadPoint

# Okabe-Ito, distinct to colour-blind eyes.
LINES = {"chaotic": "#D55E00", "harmonic": "#0072B2", "dispersion": "#009E73"}
SINGLE = "#222222"
ALONE = {"primitives": "^", "cover": "s", "late": "D", "flying": "*"}
"""Methods without a spread, and their marks."""
TICKS = (100, 200, 500, 1000, 2000, 5000, 10000)


def draw_spreads(comparison: Comparison, spreads: Mapping[str, tuple[SpreadPoint, ...]]) -> Figure:
    """Share of reachable cells, and distinct footprints, over nodes; lines join the spreads."""
    figure = Figure(figsize=(13.0, 5.4), dpi=130)
    left, right = figure.subplots(1, 2)
    reachable = comparison.reachable.number
    for method, points in spreads.items():
        nodes = [point.coverage.nodes for point in points]
        cells = [point.coverage.cells_covered / reachable for point in points]
        prints = [point.coverage.footprints for point in points]
        for axes, values in ((left, cells), (right, prints)):
            axes.plot(nodes, values, "o-", color=LINES[method], ms=4, label=method)
        for at in (0, len(points) - 1):
            _note(left, nodes[at], cells[at], str(points[at].spread), LINES[method])
            _note(right, nodes[at], prints[at], str(points[at].spread), LINES[method])
    for row in comparison.rows:
        if row.contender.method in ALONE:
            _single(left, right, row, reachable)
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
    left.legend(frameon=False, loc="lower right", title="number: nodes of a cell that go on")
    layers, columns, rows = comparison.grid.shape
    figure.suptitle(
        f"Nodes against coverage, {layers} x {columns} x {rows} cells, "
        f"{len(comparison.automaton.movements)} movements",
        x=0.02,
        ha="left",
        weight="bold",
    )
    figure.tight_layout()
    return figure


def _single(left: Axes, right: Axes, row: MethodRow, reachable: int) -> None:
    """A method without a spread: one mark of its own."""
    for axes, value in (
        (left, row.coverage.cells_covered / reachable),
        (right, float(row.coverage.footprints)),
    ):
        axes.plot(
            row.coverage.nodes,
            value,
            ALONE[row.contender.method],
            color=SINGLE,
            ms=7,
            mfc="none",
            label=row.contender.method,
        )


def _note(axes: Axes, x: float, y: float, text: str, color: str) -> None:
    axes.annotate(
        text, (x, y), textcoords="offset points", xytext=(5, 5), fontsize=8.5, color=color
    )
