"""The house style of pictures, and how they are kept: as PNG, SVG or PDF."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.base.errors import InputError
from clearway.base.suggest import did_you_mean

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.patheffects import AbstractPathEffect

FORMATS = ("png", "svg", "pdf")
FEWEST_DPI = 30
MOST_DPI = 1200
OWN = "#0072b2"
"""Clearway's own colour, which no other planner has."""
OTHERS = ("#d55e00", "#009e73", "#cc79a7", "#e69f00", "#555555")
"""Told apart from it, and from each other, by the colour-blind too."""
SERIES = (OWN, "#d55e00", "#009e73", "#e69f00", "#56b4e9", "#882255", "#cc79a7")
"""Of what is no planner, such as aircraft or kinds of scans; the colour-blind too tell it apart."""
LINES = ("-", "--", "-.", ":")
TITLE_SHARE = 0.96
"""Of the width of a picture that a line of its title takes at most."""


@contextmanager
def house_style() -> Iterator[None]:
    """Figures made in the block have the house style; what was set before holds after it."""
    import matplotlib.style

    with (
        resources.as_file(resources.files("clearway.view.plot") / "clearway.mplstyle") as path,
        matplotlib.style.context(str(path)),
    ):
        yield


def halo() -> list[AbstractPathEffect]:
    """What keeps letters legible over curves and dots."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=2.5, foreground="white")]


def line_of(number: int) -> tuple[str, str]:
    """Colour and line of the planner with a number from 0 that is not clearway."""
    return OTHERS[number % len(OTHERS)], LINES[number // len(OTHERS) % len(LINES)]


def lines_of(planners: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Colour and line of each planner: clearway's own, wherever it stands, and those of others."""
    others = [planner for planner in planners if planner != "clearway"]
    return {
        one: (OWN, "-") if one == "clearway" else line_of(others.index(one)) for one in planners
    }


def _fit_titles(figure: Figure) -> None:
    """Break titles into as many lines as it takes to stand within the picture."""
    from textwrap import fill

    figure.draw_without_rendering()
    widest = TITLE_SHARE * figure.bbox.width
    for title in (*figure.texts, *(axes.title for axes in figure.axes)):
        text = title.get_text()
        taken = title.get_window_extent().width if text else 0.0
        if taken > widest:
            letters = max(map(len, text.splitlines()))
            most = max(1, int(letters * widest / taken))
            title.set_text("\n".join(fill(line, most) for line in text.splitlines()))


@dataclass(frozen=True, slots=True)
class Pictures:
    """How pictures are kept."""

    format: str = "png"
    dpi: int = 110
    """Of what is no vector."""

    @classmethod
    def check(cls, form: str, dpi: int) -> Pictures:
        """Raises InputError naming the option that is out of its bounds."""
        if form not in FORMATS:
            near = did_you_mean(form, FORMATS)
            raise InputError("--format", f"{form!r}{near}: there are {', '.join(FORMATS)}")
        if not FEWEST_DPI <= dpi <= MOST_DPI:
            raise InputError("--dpi", f"{dpi} is not within {FEWEST_DPI} to {MOST_DPI}")
        return cls(form, dpi)

    def save(self, figure: Figure, folder: Path, name: str) -> str:
        """Write a picture into a folder; its name, with suffix. Nothing of the moment is in it."""
        _fit_titles(figure)
        file = f"{name}.{self.format}"
        told = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(self.format)
        figure.savefig(folder / file, dpi=self.dpi, format=self.format, metadata=told)
        return file
