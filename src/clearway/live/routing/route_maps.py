"""Which cells ways are looked for in: coarse ones, or finer ones that show narrow gaps as well.

In coarse cells ways keep off what leaves no room to turn, and come out of rooms sooner. They have
no gap of less than three cells: who flies through such needs finer ones, told of the same all
along, since what was passed is not seen again.
"""

from __future__ import annotations

from clearway.avoidance.clear.hazards import PointHazards
from clearway.avoidance.plan.held_escape import Escape, Narrow
from clearway.avoidance.plan.planner import Planner
from clearway.base.frames import FloatArray
from clearway.live.inputs.range_sensing import RangeSensing
from clearway.live.routing.route_map import RouteMap, turning_room_m
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors.observed.seen_space import SeenSpace


class RouteMaps:
    """The cells in use, and others that are kept up beside them until they are asked for."""

    def __init__(self, coarse: RouteMap, finer: RouteMap | None = None) -> None:
        self.used = coarse
        self._coarse, self._finer = coarse, finer

    @classmethod
    def of(
        cls, planner: Planner, sensing: RangeSensing, obstacle_map: ObstacleMap | None
    ) -> RouteMaps | None:
        """For a planner; None where no seen space is kept, which ways lead through."""
        free = sensing.free_space
        if free is None:
            return None
        known = planner.settings.escape == Escape.KNOWN
        coarse, *finer = (
            RouteMap(
                free.seen.voxel_m,
                planner.settings.safety_margin_m,
                turning_room_m(planner.automaton),
                obstacle_map,
                narrow=planner.settings.narrow == Narrow.ALLOW or known,
                sees_m=sensing.sees_m,
                finer=finer,
                heights_m=(planner.settings.lowest_m, planner.settings.highest_m),
            )
            for finer in ((False, True) if known else (False,))
        )
        return cls(coarse, *(each for each in finer if each.width_m < coarse.width_m))

    def take(
        self, seen: SeenSpace, remembered: PointHazards, position_m: FloatArray, reach_m: float
    ) -> None:
        """Take in what is known now, as of `RouteMap.take`."""
        for routes in (self._coarse, self._finer):
            if routes is not None:
                routes.take(seen, remembered, position_m, reach_m)

    def use(self, *, finer: bool) -> RouteMap:
        """Look for ways in finer cells, where there are any, or in coarse ones."""
        self.used = self._finer if finer and self._finer is not None else self._coarse
        return self.used
