"""How much room there is about the vehicle, as far as is known: levels of cells that move along.

What sensors saw is forgotten behind the vehicle. What it showed of walls must not be, or the way
back leads through them: points stay here, one of each small voxel, until they prove to be gone or
lie beyond the coarsest level.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import BoolArray, FloatArray, IntArray
from clearway.live.routing.field.clearance_marking import (
    MOST_POINTS,
    KnownPoints,
    find_vanished,
    keep_within,
    mark_box,
    mark_points,
    tell_points,
    unmark_points,
)
from clearway.live.routing.field.route_levels import Levels

ROLL_WITHIN = 8
"""A level moves along once the vehicle is off its middle by this part of its cells."""
OF_CELL = 0.6
"""Edge of a voxel that one point is kept of, in finest cells."""
PROVES_GONE = 20.0
PROVES_EVERY = 4
"""Finest cells from the vehicle within which points that are not reported are gone, and how
often that is looked at: farther off other places of the same things are seen every time."""
BaseClearance = Callable[[FloatArray, float], FloatArray]
"""(places [n, 3], how far it matters) -> clearance [n] from what is known without points: maps and
rules; inf where nothing is."""


class RouteCells(NamedTuple):
    """Which cells there are."""

    along: int
    """How many along a side of each level: even, so that levels fit into each other."""
    width_m: float
    """Edge of the finest."""
    levels: int
    lowest_m: float
    """Height of the lowest layer."""
    layer_m: float
    """From one layer to the next."""
    layers: int
    voxel_m: float = np.inf
    """Edge of the voxels that one point is kept of, at most."""


class KnownSpace:
    """Clearance in the cells about the vehicle, kept up as points become known.

    Parameters
    ----------
    layout
    wide_m
        Clearance beyond which more makes no difference.
    base
        What is known besides points; None for nothing.
    """

    def __init__(
        self,
        layout: RouteCells,
        wide_m: float,
        base: BaseClearance | None = None,
    ) -> None:
        self.layout = layout
        self._base = base
        widths = layout.width_m * 2.0 ** np.arange(layout.levels)
        between = layout.layer_m if layout.layers > 1 else 0.0
        self._reach_m: FloatArray = np.maximum(np.maximum(widths, wide_m), between)
        cells = layout.levels * layout.along * layout.along * layout.layers
        self.clearance_m: FloatArray = np.empty(cells)
        """[cells] from the middle of each cell to what is nearest, as far as it matters."""
        self.seen: BoolArray = np.zeros(cells, dtype=np.bool_)
        """[cells] whether most of each was seen to be free, where somebody marks that."""
        self._base_m: FloatArray = np.empty(cells)
        self._low: IntArray | None = None
        self._telling = 0
        self._known = KnownPoints(
            min(OF_CELL * layout.width_m, layout.voxel_m),
            np.full((2 * MOST_POINTS, 2), -1, dtype=np.int64),
            np.empty((MOST_POINTS, 4)),
            np.zeros(2, dtype=np.int64),
        )

    def begin_anew(self, base: BaseClearance | None) -> None:
        """Take something else for what is known besides points, which are kept."""
        self._base, self._low = base, None

    def renew_base(self, base: BaseClearance | None) -> None:
        """Take something else for what is known besides points, in the cells as they lie."""
        self._base = base
        if self._low is not None:
            for level in range(self.layout.levels):
                self._renew_box(level, (0, 0), (self.layout.along, self.layout.along))

    @property
    def voxel_m(self) -> float:
        """Edge of the voxels that one point is kept of."""
        return self._known.voxel_m

    @property
    def known_points_m(self) -> FloatArray:
        """[n, 3] the points that are kept."""
        points: FloatArray = self._known.point[: int(self._known.counts[0])]
        return points[points[:, 3] >= 0.0, :3]

    def base_clearance(self, places_m: FloatArray, within_m: float) -> FloatArray:
        """Return the clearance [n] of places [n, 3] from what is known besides points."""
        if self._base is None:
            return np.full(len(places_m), np.inf)
        return self._base(places_m, within_m)

    @property
    def levels(self) -> Levels:
        """Where the cells are; RuntimeError before the vehicle's place is known."""
        if self._low is None:
            raise RuntimeError("known space: nothing was taken in")
        layout, low = self.layout, self._low
        inner = np.zeros_like(low)
        inner[1:] = low[:-1] // 2 - low[1:]
        return Levels(
            layout.levels,
            layout.along,
            layout.layers,
            low,
            inner,
            layout.width_m,
            layout.lowest_m,
            layout.layer_m,
        )

    def take(self, vehicle_m: FloatArray, points_m: FloatArray, complete_m: float = 0.0) -> bool:
        """Take in points [n, 3]; return whether any clearance has changed.

        complete_m: within that distance of the vehicle [3], what is not among them is gone; that is
        looked at now and then, and near it only.
        """
        moved = self._follow(vehicle_m)
        self._telling += 1
        known = self._known
        fresh = tell_points(known, points_m, self._telling)
        levels, gone = self.levels, 0
        if complete_m > 0.0 and self._telling % PROVES_EVERY == 0:
            near_m = min(complete_m, PROVES_GONE * self.layout.width_m)
            vanished = find_vanished(known, self._telling, vehicle_m, near_m)
            gone = len(vanished)
            if gone:
                unmark_points(
                    levels, self.clearance_m, self._base_m, self._reach_m, known, vanished
                )
        if len(fresh):
            mark_points(levels, self.clearance_m, self._reach_m, known, fresh)
        self._make_room()
        return moved or len(fresh) > 0 or gone > 0

    def _make_room(self) -> None:
        """Forget what lies beyond the cells, before there are too many points."""
        count, gone = self._known.counts.tolist()
        if count < 0.9 * MOST_POINTS and gone < 0.25 * MOST_POINTS:
            return
        # What is near matters more: half as far off, until enough is forgotten.
        for level in range(self.layout.levels - 1, -1, -1):
            width = self.layout.width_m * 2.0**level
            low = self.levels.low[level] * width
            beyond = float(self._reach_m[level])
            keep_within(self._known, low - beyond, low + self.layout.along * width + beyond)
            if self._known.counts[0] < 0.7 * MOST_POINTS:
                return

    # --- moving along ---------------------------------------------------------------------

    def _follow(self, vehicle_m: FloatArray) -> bool:
        """Whether some level has moved along with the vehicle [3]."""
        layout = self.layout
        widths = layout.width_m * 2.0 ** np.arange(layout.levels)
        middle = np.floor(vehicle_m[:2] / widths[:, None]).astype(np.int64)
        wanted = (middle - layout.along // 2) // 2 * 2
        if self._low is None:
            self._low = wanted
            self.clearance_m[:] = self._base_m[:] = np.inf
            for level in range(layout.levels):
                self._renew_box(level, (0, 0), (layout.along, layout.along))
            return True
        rolls = np.any(np.abs(wanted - self._low) > layout.along // ROLL_WITHIN, axis=1)
        for level in np.flatnonzero(rolls).tolist():
            self._roll(level, wanted[level] - self._low[level])
        return bool(rolls.any())

    def _roll(self, level: int, by: IntArray) -> None:
        """Move a level along by cells [2]."""
        assert self._low is not None
        self._low = self._low.copy()
        self._low[level] += by
        layout = self.layout
        shape = (layout.levels, layout.along, layout.along, layout.layers)
        a, b = by.tolist()
        boxes = []
        if max(abs(a), abs(b)) >= layout.along:
            boxes.append(((0, 0), (layout.along, layout.along)))
        else:
            to = tuple(slice(max(-s, 0), layout.along - max(s, 0)) for s in (a, b))
            of = tuple(slice(max(s, 0), layout.along - max(-s, 0)) for s in (a, b))
            for values in (self.clearance_m, self._base_m, self.seen):
                cells = values.reshape(shape)[level]
                cells[to] = cells[of].copy()
            if a:
                first, last = (layout.along - a, layout.along) if a > 0 else (0, -a)
                boxes.append(((first, 0), (last, layout.along)))
            if b:
                first, last = (layout.along - b, layout.along) if b > 0 else (0, -b)
                boxes.append(((0, first), (layout.along, last)))
        for low, high in boxes:
            self._renew_box(level, low, high)
            self.seen.reshape(shape)[level, low[0] : high[0], low[1] : high[1]] = False

    def _renew_box(self, level: int, low: tuple[int, int], high: tuple[int, int]) -> None:
        """Make the clearance of some cells of a level anew."""
        layout, levels = self.layout, self.levels
        shape = (layout.levels, layout.along, layout.along, layout.layers)
        box = (level, slice(low[0], high[0]), slice(low[1], high[1]))
        reach = float(self._reach_m[level])
        width = layout.width_m * 2.0**level
        base: FloatArray = np.full((high[0] - low[0], high[1] - low[1], layout.layers), np.inf)
        if self._base is not None:
            ticks = [
                (levels.low[level, axis] + np.arange(low[axis], high[axis]) + 0.5) * width
                for axis in (0, 1)
            ]
            heights = layout.lowest_m + layout.layer_m * np.arange(layout.layers)
            places = np.stack(np.meshgrid(*ticks, heights, indexing="ij"), axis=-1)
            base = self._base(places.reshape(-1, 3), reach).reshape(base.shape)
        self._base_m.reshape(shape)[box] = base
        self.clearance_m.reshape(shape)[box] = base
        mark_box(levels, self.clearance_m, reach, self._known, level, *low, *high)


def cells_of(space: KnownSpace, values: FloatArray) -> FloatArray:
    """Return values [cells] as [levels, n, n, layers]."""
    layout = space.layout
    return values.reshape(layout.levels, layout.along, layout.along, layout.layers)
