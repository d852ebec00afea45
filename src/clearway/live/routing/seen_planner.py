"""Ways to a goal through what was seen to be free, and at a cost through unobserved space.

What is seen of a room, a pocket or a maze shows where it cannot be left long before flying on
shows it. A way costs its length, more where little room to turn is left, where it leads through the
unknown and where ways have come to nothing, and less along the way that is being flown; nothing
leads through what stands there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.hazards import PointHazards
from clearway.base.arrays import FloatArray
from clearway.live.routing.distance_field import HALF_DIAGONAL
from clearway.live.routing.field.cell_march import WayRule, cell_beside, march_to, way_speeds
from clearway.live.routing.field.cell_prices import (
    BEGINS,
    PricedCells,
    PriceRule,
    add_balls,
    prices_of,
)
from clearway.live.routing.field.cell_way import cells_down, corners_on, middles_of
from clearway.live.routing.field.clearance_speed import find_barred_clearance
from clearway.live.routing.field.known_space import BaseClearance, RouteCells
from clearway.live.routing.field.seen_marking import mark_seen
from clearway.live.routing.route_planner import LONGER, RoutePlanner, RouteSettings
from clearway.sensors.observed.seen_space import SeenSpace

NO_ROOM_TO_TURN = 3.0
HARDLY_ROOM = 9.0
"""Cost of a metre with no room beside the margin to turn, and with none to turn half as wide."""
NARROW = (1.25, 1.5)
"""The same cost weights where the mission allows narrow places."""
TALL = 100.0
TALL_FINE = 200.0
"""Cost of a metre that nobody has seen above or below what stands, for who turns in much room and
for others: most of it stands on."""
MOST = 1000.0
MOST_FINE = 60.0
"""Cost of a metre at most, when a way is looked for, for who turns in much room and for others: who
can stop may look, but not for longer than it takes to fly back out of a room."""
FAR = 60.0
"""Cost of a metre where cells that are not of the finest are closed, if no way is found else."""
IN_VAIN = 1.0
"""Added to a metre's cost for every time that a way there came no nearer to it."""
IN_VAIN_MARGINS = 5.0
SPENT_MARGINS = 10.0
"""Margins about the end of a way that came to nothing, at least, and about a place that was tried,
in which a metre costs more."""
NEARER = 0.5
"""Share of what was flown that a way must come nearer to the place that it hangs on."""


class SeenRoute(NamedTuple):
    """A way over cells."""

    corners_m: FloatArray
    """[n, 3] world frame, without the place where it begins; the last is the goal, or as near to it
    as the way leads."""
    reaches: bool
    """Whether there is a way at all; without one the corners are none."""
    begins_m: FloatArray
    """[k, 3] cell by cell up to the first that was not seen to have room, on which all hangs; the
    whole of it where there is none."""
    length_m: float
    """From where it begins to the goal."""
    in_vain_m: float
    """Part of its cost for ways that came to nothing."""

    def via_m(self, goal_m: FloatArray) -> tuple[FloatArray, ...]:
        """Its corners [3] before the goal [3]."""
        ends_at_goal = self.reaches and np.array_equal(self.corners_m[-1], goal_m)
        return tuple(self.corners_m[:-1] if ends_at_goal else self.corners_m)


class SeenPlanner(RoutePlanner):
    """A route planner that knows besides what was seen to be free.

    Parameters
    ----------
    settings, layout, base
        As of a `RoutePlanner`.
    turning_m
        Turning radius; 0 for a vehicle that turns on the spot.
    narrow
        Whether what leaves no room to turn may be flown through.
    """

    def __init__(
        self,
        settings: RouteSettings,
        layout: RouteCells,
        base: BaseClearance | None = None,
        *,
        turning_m: float = 0.0,
        narrow: bool = False,
    ) -> None:
        super().__init__(settings, layout, base)
        self.room_m = settings.margin_m + turning_m
        """Clearance with which there is room to turn."""
        self._turns_wide = turning_m > 0.0
        self._most = MOST if self._turns_wide else MOST_FINE
        self._rule_of_price = PriceRule(
            max(settings.margin_m, HALF_DIAGONAL * layout.width_m),
            settings.margin_m,
            TALL if self._turns_wide else TALL_FINE,
            turning_m,
            *(NARROW if narrow else (NO_ROOM_TO_TURN, HARDLY_ROOM)),
        )
        self._base, self._points_m = base, np.zeros((0, 3))
        self._balls: FloatArray = np.zeros((0, 6))
        self._aim: FloatArray | None = None
        self._priced: PricedCells | None = None
        self._last_s: tuple[FloatArray, float] | None = None

    def begin_anew(self, base: BaseClearance | None) -> None:
        """Take something else for what is known besides points and what was seen."""
        self.space.renew_base(base)
        self._base = base
        self._priced = self._last_s = None

    # --- what was seen --------------------------------------------------------------------

    def look(
        self,
        seen: SeenSpace,
        remembered: PointHazards,
        vehicle_m: FloatArray,
        complete_m: float,
        sees_m: float,
    ) -> None:
        """Take in what is known now.

        complete_m: within that distance of the vehicle [3] nothing is missing among the points
        remembered. sees_m: as far off anything was seen.
        """
        self.space.take(vehicle_m, remembered.position_m, complete_m)
        mark_seen(self.space.levels, self.space.seen, seen, vehicle_m, sees_m)
        self._points_m = remembered.position_m
        self._priced = None

    @property
    def cells(self) -> PricedCells:
        """What a metre costs where; RuntimeError before anything was taken in."""
        if self._priced is None:
            space, levels = self.space, self.space.levels
            in_vain = np.zeros(len(space.clearance_m))
            add_balls(levels, in_vain, self._balls)
            price = prices_of(levels, space.clearance_m, space.seen, in_vain, self._rule_of_price)
            self._priced = PricedCells(levels, price, in_vain, space.clearance_m)
        return self._priced

    # --- ways -----------------------------------------------------------------------------

    def find_seen_route(
        self, vehicle_m: FloatArray, goal_m: FloatArray, flown_m: Sequence[FloatArray] = ()
    ) -> SeenRoute:
        """Return the cheapest way from a vehicle [3] to a goal [3], as far as is known.

        flown_m: corners [3] of the way being flown.
        """
        cells, pace = self.cells, self.settings.pace
        own = cell_beside(cells, vehicle_m, goal_m, self._clear_m(vehicle_m))
        if own < 0:  # Too coarse to tell.
            straight = np.stack([vehicle_m, goal_m])
            length = float(np.linalg.norm(goal_m - vehicle_m))
            return SeenRoute(straight[1:], True, straight, length, 0.0)
        flown = np.stack([vehicle_m, *flown_m]) if len(flown_m) else np.zeros((0, 3))
        speed, time, found = np.empty(0), np.empty(0), False
        tries = ((np.inf, self._guess(goal_m)), (np.inf, np.inf), (FAR, np.inf))
        for far, most_s in dict.fromkeys(tries):
            rule = WayRule(pace.fastest_mps, self._most, far)
            speed = way_speeds(cells, rule, flown, vehicle_m, goal_m)
            time, found = march_to(cells, pace, speed, goal_m, vehicle_m, own, most_s)
            if found:
                break
        if not found:
            return SeenRoute(np.zeros((0, 3)), False, vehicle_m[None], np.inf, 0.0)
        self._last_s = goal_m, float(time[own])
        way = cells_down(cells, pace, time, own, goal_m)
        places = middles_of(cells.levels, way)
        width, slight_s = self.space.layout.width_m, self.space.layout.width_m / pace.fastest_mps
        corners = places[corners_on(cells, speed, places, time[way], slight_s)][1:]
        if np.max(np.abs((places[-1] - goal_m)[:2])) <= (BEGINS + 0.5) * width:
            corners = np.concatenate([corners[:-1], goal_m[None]])
        whole = np.concatenate([vehicle_m[None], corners, goal_m[None]])
        length = float(np.linalg.norm(np.diff(whole, axis=0), axis=1).sum())
        doubtful = cells.price[way] > 1.0
        doubtful[:BEGINS] = False
        hangs_on = int(np.argmax(doubtful)) if doubtful.any() else len(places) - 1
        begins = np.concatenate([vehicle_m[None], places[1 : hangs_on + 1]])
        steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        in_vain = float(steps @ cells.in_vain[way[1:]])
        return SeenRoute(corners, True, begins, length, in_vain)

    def _clear_m(self, place_m: FloatArray) -> float:
        """From a place [3] to what is nearest, as far as is known."""
        away2 = np.sum((self._points_m - place_m) ** 2, axis=1)
        clear_m = float(np.sqrt(away2.min(initial=np.inf)))
        if self._base is not None:
            clear_m = min(clear_m, float(self._base(place_m[None], self.settings.wide_m)[0]))
        return max(clear_m, 0.0)

    def _guess(self, goal_m: FloatArray) -> float:
        """The most seconds that a way may take, by the last one to the same goal."""
        if self._last_s is None or not np.array_equal(self._last_s[0], goal_m):
            return np.inf
        return LONGER * self._last_s[1]

    # --- what came to nothing -------------------------------------------------------------

    def aim(self, way_m: FloatArray) -> None:
        """Note places [n, 3] along the way flown now, up to the one that it hangs on."""
        self._aim = way_m

    def came_nearer(self, vehicle_m: FloatArray, flown_m: float) -> bool:
        """Whether what was flown led along the way aimed at; else the end of that costs more."""
        way = self._aim
        if way is None:
            return True
        steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
        left = np.append(np.cumsum(steps[::-1])[::-1], 0.0)
        off = np.linalg.norm(way - vehicle_m, axis=1)
        at = int(np.argmin(off))
        if left[0] - left[at] - off[at] >= NEARER * flown_m:
            return True
        reach_m = max(self.room_m, IN_VAIN_MARGINS * self.settings.margin_m)
        # Who turns in little room climbs in it too: to such another height is another way.
        heights = self._alike(way[-1], reach_m) if self._turns_wide else (way[-1, 2], way[-1, 2])
        self._add_ball(way[-1], reach_m, heights)
        return False

    def spend(self, place_m: FloatArray) -> None:
        """What begins at a place [3] has been tried: it costs more about there from now on."""
        heights = float(place_m[2]), float(place_m[2])
        self._add_ball(place_m, SPENT_MARGINS * self.settings.margin_m, heights)

    def try_all_again(self) -> None:
        """Forget what came to nothing: who flies otherwise from now on may come through there."""
        self._balls, self._priced = self._balls[:0], None

    def _add_ball(
        self, place_m: FloatArray, radius_m: float, heights_m: tuple[float, float]
    ) -> None:
        ball = np.array([*place_m[:2], *heights_m, radius_m, IN_VAIN])
        self._balls, self._priced = np.concatenate([self._balls, ball[None]]), None

    def _alike(self, place_m: FloatArray, reach_m: float) -> tuple[float, float]:
        """Lowest and highest height that differ in nothing from that of a place, as far as was
        seen: what stands about it goes on above and below until a layer is seen to be free of it.

        Who comes back at another height sees anew what was seen already, of the same gap.
        """
        layout, levels = self.space.layout, self.space.levels
        shape = (layout.levels, layout.along, layout.along, layout.layers)
        far = int(np.ceil(reach_m / layout.width_m))
        at = np.floor(place_m[:2] / layout.width_m).astype(np.int64) - levels.low[0]
        about = tuple(slice(max(0, mid - far), max(0, mid + far + 1)) for mid in at.tolist())
        barred_m = find_barred_clearance(levels, 0, self._rule_of_price.closed_m)
        stands = self.space.clearance_m.reshape(shape)[0][about] < barred_m
        free = self.space.seen.reshape(shape)[0][about].any(axis=(0, 1))
        free &= ~stands.any(axis=(0, 1))
        height = round((float(place_m[2]) - layout.lowest_m) / layout.layer_m)
        low = high = min(max(height, 0), layout.layers - 1)
        if not free[low]:
            while low > 0 and not free[low - 1]:
                low -= 1
            while high < layout.layers - 1 and not free[high + 1]:
                high += 1
        return layout.lowest_m + low * layout.layer_m, layout.lowest_m + high * layout.layer_m
