"""The track of a vehicle that changes its speed, coloured by it, and the columns it flew among."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import Normalize

from clearway.base.frames import FloatArray
from clearway.obstacles.columns import Columns
from clearway.obstacles.world import CombinedWorld, World
from clearway.sim import Run
from clearway.sim.pilot import Steering

STEADY = 0.2
"""Share of its greatest speed by which a vehicle's speed may change for its track to be plain."""
MAP = "viridis"
COLUMN_COLOUR = "#b9b4ab"
SPARED = 0.02
"""Share of the flight at each end that does not tell whether the speed changes."""


def speeds_mps(run: Run[Steering], until: int) -> FloatArray | None:
    """[until - 1] speed between the states of a flight; None where it hardly changes."""
    step_s = np.diff(run.time_s)
    moved_m = np.linalg.norm(np.diff(run.states[:, :3], axis=0), axis=1)
    speeds: FloatArray = moved_m / np.maximum(step_s, 1e-9)
    spared = int(SPARED * len(speeds))
    inner = speeds[spared : len(speeds) - spared]
    if not len(inner) or inner.min() >= (1.0 - STEADY) * inner.max():
        return None
    return speeds[: max(until - 1, 0)]


def draw_speed(
    axes: Axes, places: FloatArray, speed_mps: FloatArray, fastest_mps: float
) -> LineCollection:
    """Draw a track [n, 2] in the colours of its speeds [n - 1]."""
    lines = LineCollection(
        list(np.stack([places[:-1], places[1:]], axis=1)),
        cmap=MAP,
        norm=Normalize(0.0, fastest_mps),
        linewidth=2.2,
    )
    lines.set_array(speed_mps)
    axes.add_collection(lines)
    return lines


def draw_columns(axes: Axes, world: World | None) -> None:
    """Draw the columns of a world as they stand, from above."""
    worlds = world.worlds if isinstance(world, CombinedWorld) else [world]
    for each in worlds:
        if isinstance(each, Columns) and len(each):
            x, y, radius, *_ = each.rows_m.T
            wide = 2.0 * radius
            circles = EllipseCollection(
                wide,
                wide,
                np.zeros(len(wide)),
                units="xy",
                offsets=np.column_stack([x, y]),
                offset_transform=axes.transData,
                facecolor=COLUMN_COLOUR,
                edgecolor="none",
                zorder=0.5,
            )
            axes.add_collection(circles)
