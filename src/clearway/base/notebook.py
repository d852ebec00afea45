"""What notebooks show of a value: a small table, and a sketch from above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray

WIDTH = 460.0
HEIGHT = 220.0
SPARE = 12.0
"""Round the sketch, in its own units."""
MOST_PLACES = 400
"""Of a line or a cloud: a sketch shows no more."""


class Marks(NamedTuple):
    """Places to draw: joined by a line, or each by itself."""

    places_m: FloatArray
    """[n, >= 2] x and y first."""
    color: str
    joined: bool = True
    size: float = 1.6
    """Width of the line, or radius of a place."""
    dashed: bool = False


def html_table(title: str, facts: Mapping[str, object], sketch: str = "") -> str:
    """A heading, facts row by row, and a sketch beside them."""
    rows = "".join(
        f"<tr><td>{escape(str(name))}</td><td>{escape(str(value))}</td></tr>"
        for name, value in facts.items()
    )
    return (
        f"<div><b>{escape(title)}</b>"
        '<div style="display:flex;gap:1em;flex-wrap:wrap">'
        f"<table>{rows}</table>{sketch}</div></div>"
    )


def sketch_from_above(marks: Sequence[Marks]) -> str:
    """SVG of lines and places seen from above, x to the right and y up, on one scale."""
    clouds = [_finite(mark.places_m) for mark in marks]
    every = np.concatenate([np.zeros((0, 2)), *clouds])
    if not len(every):
        return ""
    low, high = every.min(axis=0), every.max(axis=0)
    extent = np.maximum(high - low, 1e-9)
    scale = float(min((WIDTH - 2 * SPARE) / extent[0], (HEIGHT - 2 * SPARE) / extent[1]))
    width, height = extent * scale + 2 * SPARE
    parts = []
    for mark, cloud in zip(marks, clouds, strict=True):
        step = max(1, -(-len(cloud) // MOST_PLACES))
        kept = np.concatenate([cloud[::step], cloud[-1:]]) if len(cloud) else cloud
        x, y = SPARE + (kept[:, 0] - low[0]) * scale, SPARE + (high[1] - kept[:, 1]) * scale
        parts.append(_draw(mark, [f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True)]))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}">{"".join(parts)}</svg>'
    )


def _draw(mark: Marks, places: Sequence[str]) -> str:
    if mark.joined:
        dashes = ' stroke-dasharray="4 3"' if mark.dashed else ""
        return (
            f'<polyline points="{" ".join(places)}" fill="none" stroke="{mark.color}" '
            f'stroke-width="{mark.size}"{dashes}/>'
        )
    circles = (place.split(",") for place in places)
    return "".join(
        f'<circle cx="{x}" cy="{y}" r="{mark.size}" fill="{mark.color}"/>' for x, y in circles
    )


def _finite(places: FloatArray) -> FloatArray:
    level = np.asarray(places, dtype=np.float64)
    if not level.size:
        return np.zeros((0, 2))
    return level[np.isfinite(level[:, :2]).all(axis=1), :2]
