"""What a picture cuts off or leaves unnamed: data beyond limits, letters beyond the rim."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection
from matplotlib.colors import to_hex, to_rgba_array
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Annotation, Text
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d.art3d import Text3D

LETTERS = 1.0
"""Pixels by which letters may stand over the rim: they are measured in whole ones."""


def flaws_of(figure: Figure, may_be_cut: frozenset[str] = frozenset()) -> list[str]:
    """What is wrong with a figure as it is drawn; may_be_cut: names of what goes on beyond a view
    of one moment."""
    FigureCanvasAgg(figure).draw()
    flaws = (
        list(_cut_letters(figure))
        + list(_unnamed(figure))
        + list(_empty(figure))
        + list(_uncalled(figure))
    )
    for axes in figure.axes:
        if axes.name != "3d":
            flaws += _cut_data(axes, may_be_cut)
    return flaws


def _cut_data(axes: Axes, may_be_cut: frozenset[str]) -> Iterator[str]:
    """Lines, areas and dots that reach beyond the limits of their axes."""
    low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
    low, high = np.minimum(low, high), np.maximum(low, high)
    spare = 1e-6 * (high - low)
    for artist in (*axes.lines, *axes.collections, *axes.patches):
        if not artist.get_visible() or artist.get_label() in may_be_cut:
            continue
        if isinstance(artist, ContourSet):  # The world goes on.
            continue
        places = _places(artist, axes)
        places = places[np.isfinite(places).all(axis=1)]
        by_axis = artist.get_transform().contains_branch_seperately(axes.transData)
        if isinstance(artist, Collection):
            by_axis = (True, True)
        for axis, in_data in enumerate(by_axis):
            values = places[:, axis]
            if not (in_data and len(values)):
                continue
            if values.min() < low[axis] - spare[axis] or values.max() > high[axis] + spare[axis]:
                yield (
                    f"{axes.get_title() or axes.get_ylabel()!r}: {'xy'[axis]} from "
                    f"{values.min():g} to {values.max():g} of {artist!r} is cut off at "
                    f"{low[axis]:g} and {high[axis]:g}"
                )


def _places(artist: object, axes: Axes) -> np.ndarray:
    """[n, 2] corners of what is drawn, in data or as its transform says."""
    if isinstance(artist, Line2D):
        return np.asarray(artist.get_xydata(), dtype=float)
    if isinstance(artist, Patch):
        path = artist.get_patch_transform().transform_path(artist.get_path())
        return path.vertices if len(path.vertices) else np.empty((0, 2))
    assert isinstance(artist, Collection)
    around: Bbox = artist.get_datalim(axes.transData)
    return np.asarray(around.get_points(), dtype=float)


def _cut_letters(figure: Figure) -> Iterator[str]:
    """Titles, names, numbers and legends that stand over the rim of the picture."""
    rim, beyond = figure.bbox, _beyond(figure)
    for text in figure.findobj(Text):
        if not text.get_visible() or not text.get_text().strip() or not _is_drawn(text, beyond):
            continue
        box = text.get_window_extent()
        if (
            box.x0 < rim.x0 - LETTERS
            or box.y0 < rim.y0 - LETTERS
            or box.x1 > rim.x1 + LETTERS
            or box.y1 > rim.y1 + LETTERS
        ):
            yield f"{text.get_text()!r} is cut off at the rim"


def _is_drawn(text: Text, beyond: set[Text]) -> bool:
    """Whether letters are drawn at all: not numbers and notes of places beyond the limits."""
    if isinstance(text, Text3D):  # Where they stand is known while they are drawn alone.
        return False
    if isinstance(text, Annotation):
        return bool(text._check_xy(None))
    return text not in beyond


def _beyond(figure: Figure) -> set[Text]:
    """Numbers of axes that lie beyond their limits; in space those turn with the view."""
    found: set[Text] = set()
    for axes in figure.axes:
        for axis in axes._axis_map.values():
            low, high = sorted(axis.get_view_interval())
            spare = 1e-9 * (high - low)
            for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
                if axes.name == "3d" or not low - spare <= tick.get_loc() <= high + spare:
                    found |= {tick.label1, tick.label2}
    return found


def _legends(figure: Figure) -> list[Legend]:
    return list(figure.findobj(Legend))


def _unnamed(figure: Figure) -> Iterator[str]:
    """What is drawn under a name that no legend has."""
    named = {text.get_text() for legend in _legends(figure) for text in legend.get_texts()}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            if label not in named:
                yield f"{label!r} ({type(handle).__name__}) stands in no legend"


def _uncalled(figure: Figure) -> Iterator[str]:
    """Colours of lines and areas that no named thing, colour bar or letter has."""
    named = {to_hex(text.get_color()) for text in figure.findobj(Text) if text.get_text()}
    parts = [
        (axes, artist)
        for axes in figure.axes
        for artist in (*axes.lines, *axes.collections, *axes.patches)
        if artist.get_visible()
        and getattr(artist, "get_array", lambda: None)() is None
        and _holds_something(artist)
    ]
    for legend in _legends(figure):
        for handle in legend.legend_handles:
            named |= _colours(handle)
    for axes, artist in parts:
        for colour in _colours(artist) - named - {"#000000", "#ffffff"}:
            yield f"{axes.get_title() or axes.get_ylabel()!r}: nothing names {colour} of {artist!r}"


def _holds_something(artist: object) -> bool:
    if isinstance(artist, Line2D):
        return len(artist.get_xdata(orig=False)) > 0
    return not isinstance(artist, Collection) or len(artist.get_paths()) > 0


def _colours(artist: object) -> set[str]:
    if isinstance(artist, Line2D):
        return {to_hex(artist.get_color())}
    assert isinstance(artist, Patch | Collection)
    faces = np.atleast_2d(to_rgba_array(artist.get_facecolor()))
    return {to_hex(face) for face in faces if face[3] > 0.0}


def _empty(figure: Figure) -> Iterator[str]:
    """Axes with their frame drawn and nothing in them."""
    for axes in figure.axes:
        if axes.axison and axes.get_visible() and not axes.has_data():
            yield f"{axes.get_title() or axes.get_ylabel()!r} is empty"
