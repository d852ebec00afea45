"""Ways that came to nothing: who flies about one place for long has not found the way on, and what
is narrowest ahead on it costs more from then on."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.rate.route_field import RouteField, time_to_go
from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.live.routing.field.route_levels import Levels, middle_of

PATIENCE_S = 4.0
"""Time about one place after which the way on is without success."""
STAYS_WITHIN = 4.0
"""Margins: within so many of a place the vehicle is still there."""
AHEAD = 12.0
"""Margins ahead, in which the narrowest place of the way is looked for."""
ABOUT = 1.5
"""Margins about that place in which the way costs more."""
SLOWER = 0.25
"""Share of the speed that is left there, each time."""
MOST_TIMES = 8
MOST_PLACES = 64
"""That one place counts, lest waiting closes the way on; and places that are kept, the latest."""


class InVain:
    """Places that ways led through without success.

    Parameters
    ----------
    margin_m
        Of the ways.
    """

    def __init__(self, margin_m: float) -> None:
        self._margin_m = margin_m
        self._about: FloatArray | None = None
        self._since_s = -np.inf
        self._places_m: FloatArray = np.zeros((0, 3))

    def slow_down(self, levels: Levels, speed_mps: Floats) -> None:
        """Lower the speed [cells] about the places."""
        if len(self._places_m):
            slow_about(levels, speed_mps, self._places_m, ABOUT * self._margin_m, SLOWER)

    def note(self, vehicle_m: FloatArray, now_s: float, field: RouteField) -> None:
        """Take note of where the vehicle [3] is, and of a place if it has been there for long."""
        within_m = STAYS_WITHIN * self._margin_m
        if self._about is None or np.linalg.norm(vehicle_m - self._about) > within_m:
            self._about, self._since_s = vehicle_m, now_s
        elif now_s - self._since_s > PATIENCE_S:
            self._since_s = now_s
            place = narrowest_ahead(field, vehicle_m, AHEAD * self._margin_m, 0.5 * field.width_m)
            off_m = np.linalg.norm(self._places_m - place, axis=1)
            if np.count_nonzero(off_m <= ABOUT * self._margin_m) < MOST_TIMES:
                self._places_m = np.concatenate([self._places_m[-MOST_PLACES + 1 :], place[None]])


@compiled
def narrowest_ahead(field: RouteField, vehicle: Floats, far_m: float, step_m: float) -> Floats:
    """Return the place [3] on the way from a vehicle [3] where it is slowest, the first of several;
    looked for as far as `far_m`."""
    x, y, z = vehicle[0], vehicle[1], vehicle[2]
    best, slowest, flown = np.array([x, y, z]), np.inf, 0.0
    while flown < far_m:
        seconds, dx, dy, dz, speed = time_to_go(field, x, y, z)
        if seconds == np.inf or (dx == 0.0 and dy == 0.0 and dz == 0.0):
            break
        # The vehicle's own position may be narrow too; it is not the way on.
        if speed < slowest and flown > 0.0:
            best, slowest = np.array([x, y, z]), speed
        x, y, z, flown = x + step_m * dx, y + step_m * dy, z + step_m * dz, flown + step_m
    return best


@compiled
def slow_about(
    levels: Levels, speed: Floats, places: Floats2, radius_m: float, share: float
) -> None:
    """Lower the speed [cells] about places [n, 3] to a share, once for each."""
    n, layers = levels.n, levels.layers
    for at in range(len(places)):
        x, y, z = places[at, 0], places[at, 1], places[at, 2]
        for level in range(levels.depth):
            width = levels.width_m * (1 << level)
            far = int(np.ceil(radius_m / width))
            a = int(np.floor(x / width)) - levels.low[level, 0]
            b = int(np.floor(y / width)) - levels.low[level, 1]
            for i in range(max(a - far, 0), min(a + far + 1, n)):
                for j in range(max(b - far, 0), min(b + far + 1, n)):
                    for k in range(layers):
                        there = middle_of(levels, level, i, j, k)
                        dx, dy, dz = there[0] - x, there[1] - y, there[2] - z
                        near = dx * dx + dy * dy <= radius_m * radius_m
                        if near and (layers == 1 or abs(dz) <= max(radius_m, levels.layer_m)):
                            speed[((level * n + i) * n + j) * layers + k] *= share
