"""What stands at the heights that were flown, seen from above."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from clearway.base.frames import FloatArray
from clearway.obstacles.world import World

PIXELS = 240
"""Along the longer side of the map of obstacles."""
SLICES = 9
"""Heights at which obstacles are looked for."""
SOLID = "#9a9a9a"
MARGIN = "#e6e2da"
KEPT_OUT = "#f3c96b"


def draw_ground_plan(
    axes: Axes, tracks_m: FloatArray, world: World, margin_m: float, pixels: int = PIXELS
) -> None:
    """Obstacles grey, with the margin around them light. tracks_m: [n, 3] places flown."""
    x, y, nearest = _nearest(tracks_m, world, pixels)
    if nearest.min() < margin_m:
        axes.contourf(x, y, nearest, levels=[-1e6, 0.0, margin_m], colors=[SOLID, MARGIN])
        if nearest.min() < 0.0:
            axes.fill([], [], color=SOLID, label="obstacles")
        axes.fill([], [], color=MARGIN, label="margin about obstacles")


def draw_kept_out(axes: Axes, tracks_m: FloatArray, volumes: World) -> None:
    """Volumes that rules keep out of, hatched."""
    x, y, nearest = _nearest(tracks_m, volumes)
    if nearest.min() < 0.0:
        axes.contourf(
            x, y, nearest, levels=[-1e6, 0.0], colors=[KEPT_OUT], hatches=["///"], alpha=0.5
        )
        axes.fill([], [], color=KEPT_OUT, alpha=0.5, label="keep-out volumes")


def _nearest(
    tracks_m: FloatArray, world: World, pixels: int = PIXELS
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Axes x, y and the smallest distance [y, x] over the heights flown."""
    low, high = tracks_m.min(axis=0), tracks_m.max(axis=0)
    spare = 0.08 * float((high - low)[:2].max()) + 1.0
    pixel = float((high - low)[:2].max() + 2.0 * spare) / pixels
    x = np.arange(low[0] - spare, high[0] + spare + pixel, pixel)
    y = np.arange(low[1] - spare, high[1] + spare + pixel, pixel)
    nearest = np.full((len(y), len(x)), np.inf)
    for height in np.linspace(low[2], high[2], SLICES if high[2] > low[2] else 1):
        mesh_x, mesh_y = np.meshgrid(x, y)
        places = np.stack([mesh_x, mesh_y, np.full_like(mesh_x, height)], axis=-1).reshape(-1, 3)
        nearest = np.minimum(nearest, world.distance_m(places).reshape(nearest.shape))
    return x, y, nearest
