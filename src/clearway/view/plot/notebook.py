"""Figures that notebooks show by themselves, whether or not pyplot is set up there."""

from __future__ import annotations

from io import BytesIO

from matplotlib.figure import Figure

DPI = 80


def for_notebooks(figure: Figure) -> Figure:
    """The same figure, with what notebooks ask a value for: its picture as PNG."""

    def png() -> bytes:
        buffer = BytesIO()
        figure.savefig(buffer, format="png", dpi=DPI)
        return buffer.getvalue()

    figure._repr_png_ = png  # type: ignore[attr-defined]
    return figure
