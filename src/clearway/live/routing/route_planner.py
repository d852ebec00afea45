"""The one route planner: what is known is kept up in cells, and time marches over them.

A field is made anew where what is known, the target or the vehicle's place has changed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.avoidance.rate.route_field import Pace, RouteField, time_to_go
from clearway.base.compiled import seal
from clearway.base.frames import FloatArray
from clearway.live.routing.field.clearance_speed import SpeedRule, speeds_of
from clearway.live.routing.field.closer_look import (
    LOOKED_AT,
    NO_CELLS,
    cells_with_room,
    open_cells,
)
from clearway.live.routing.field.in_vain import InVain
from clearway.live.routing.field.known_space import (
    ROLL_WITHIN,
    BaseClearance,
    KnownSpace,
    RouteCells,
    cells_of,
)
from clearway.live.routing.field.marching import march
from clearway.live.routing.field.way_down import way_down

EXACT_LEVELS = 3
"""The finest so many levels tell what is closed; in coarser cells a forest would look like a
wall."""
POROUS = 0.1
"""Share of the greatest speed in coarse cells that something stands in."""
WIDE = 3.0
"""Clearance, in margins, from which on speed is greatest."""
SLOW = 0.15
"""Share of the greatest speed at the margin."""
ARRIVES_MPS = 0.8
"""Speed that is left at the target: braking is not planned to the last centimetre."""
SLACK = 1.25
"""Detour by a place that times are asked for, in ways to the farthest of these: 1 for one that is
as near to the target as the vehicle, 2 for one straight away from it."""
LONGER = 1.2
"""Times the time to go of the last field up to which a way is looked for first."""
ALONG = 96
ALONG_LAYERED = 64
"""Cells along a side of each level, where these have one layer and where they have more."""
MOST_LAYERS = 5
"""Layers at most, which then lie farther apart: time marches through all of them."""
MOST_LEVELS = 8
"""Levels at most: the coarsest cells are 128 times as wide as the finest."""


@dataclass(frozen=True)
class RouteSettings:
    """What a route keeps to."""

    pace: Pace
    margin_m: float
    ends_within_m: float
    """From a target that something stands at, so far off a way to it may end."""
    asked_within_m: float
    """How far from the vehicle times are asked for."""
    slow_mps: float
    """Speed at the margin, which rises to the greatest at `wide_m`."""
    wide_m: float


class RoutePlanner:
    """Keeps up what is known, and makes the fields of time to go over it.

    Parameters
    ----------
    settings
    layout
        Cells; see `route_cells_for`.
    base
        What is known besides points: maps, and places that rules forbid.
    """

    def __init__(
        self, settings: RouteSettings, layout: RouteCells, base: BaseClearance | None = None
    ) -> None:
        self.settings = settings
        self.space = KnownSpace(layout, settings.wide_m, base)
        self._rule = SpeedRule(
            settings.margin_m,
            settings.wide_m,
            settings.slow_mps,
            settings.pace.fastest_mps,
            POROUS * settings.pace.fastest_mps,
            EXACT_LEVELS,
        )
        self.in_vain = InVain(settings.margin_m)
        self._with_room = NO_CELLS
        self._last: RouteField | None = None

    def begin_anew(self, base: BaseClearance | None) -> None:
        """Take something else for what is known besides points; no way was tried without success
        yet."""
        self.space.begin_anew(base)
        self.in_vain, self._last = InVain(self.settings.margin_m), None
        self._with_room = NO_CELLS

    def take(self, vehicle_m: FloatArray, points_m: FloatArray, complete_m: float = 0.0) -> bool:
        """Take in what is known now, as of `KnownSpace.take`."""
        return self.space.take(vehicle_m, points_m, complete_m)

    def field(
        self, vehicle_m: FloatArray, target_m: FloatArray, asked_within_m: float = np.inf
    ) -> tuple[RouteField, bool]:
        """Return the field of time to go to a target [3], and whether a way from the vehicle [3]
        to it is known.

        asked_within_m: how far from the vehicle times are asked for this time, if less than ever.
        """
        settings, space = self.settings, self.space
        levels, pace = space.levels, settings.pace
        slack_s = SLACK * min(settings.asked_within_m, asked_within_m) / pace.fastest_mps
        speed, time, found = np.empty(0), np.empty(0), False
        tries = [(self._guess_s(vehicle_m, target_m), False), (np.inf, False), (np.inf, True)]
        for most_s, closer in dict.fromkeys(tries if len(self._with_room) else tries[:-1]):
            speed, clearance = self._speeds_mps(closer=closer)
            time, found = march(
                levels,
                pace,
                clearance,
                speed,
                target_m,
                vehicle_m,
                settings.ends_within_m,
                slack_s,
                most_s,
                settings.slow_mps,
            )
            if found:
                break
        widths = levels.width_m * 2.0 ** np.arange(levels.depth)
        field = RouteField(
            seal(cells_of(space, time)),
            seal(cells_of(space, speed)),
            seal(levels.low * widths[:, None]),
            levels.width_m,
            levels.lowest_m,
            levels.layer_m,
            target_m,
            pace,
        )
        if not found:
            found = time_to_go(field, *vehicle_m.tolist())[0] < np.inf
        self._last = field if found else None
        return field, found

    def look_closer(self, vehicle_m: FloatArray, target_m: FloatArray) -> bool:
        """Return whether a way is known by places all over the cells, as by their middles none is;
        fields lead along it from then on, where there is no other."""
        self._with_room = cells_with_room(self.space, self.settings.margin_m)
        found = self.field(vehicle_m, target_m)[1]
        if not found:
            self._with_room = NO_CELLS
        return found

    def _speeds_mps(self, *, closer: bool) -> tuple[FloatArray, FloatArray]:
        """Return speed and clearance [cells]; closer: with what the closer look has opened."""
        levels, clearance = self.space.levels, self.space.clearance_m
        rule = self._rule._replace(exact_levels=LOOKED_AT) if closer else self._rule
        speed = speeds_of(levels, clearance, rule)
        if closer:
            clearance = open_cells(self.space, self._with_room, speed, self.settings.slow_mps)
        self.in_vain.slow_down(levels, speed)
        return speed, clearance

    @property
    def searched(self) -> str:
        """Where no way was found, if none is known, in words."""
        cells, margin_m = self.space.layout, self.settings.margin_m
        highest_m = cells.lowest_m + (cells.layers - 1) * cells.layer_m
        return (
            f"none keeps {margin_m:.2g} m between heights of {cells.lowest_m:.3g} and "
            f"{highest_m:.3g} m, by cells of {cells.width_m:.2g} m"
        )

    def way_m(self, vehicle_m: FloatArray, target_m: FloatArray) -> tuple[FloatArray, ...]:
        """Return the corners [3] of a way from the vehicle [3] to a target [3], without its ends;
        none where no way is known, or the straight one is open."""
        field, found = self.field(vehicle_m, target_m)
        corners = way_down(field, vehicle_m) if found else np.zeros((0, 3))
        return tuple(corners[:-1].copy())

    def _guess_s(self, vehicle_m: FloatArray, target_m: FloatArray) -> float:
        """The most seconds that a way from the vehicle may take, by the last field."""
        last = self._last
        if last is None or not np.array_equal(last.target_m, target_m):
            return np.inf
        return LONGER * time_to_go(last, *vehicle_m.tolist())[0]


def route_cells_for(
    width_m: float,
    away_m: float,
    lowest_m: float,
    highest_m: float,
    layer_m: float,
    most_layers: int = MOST_LAYERS,
) -> RouteCells:
    """Return the cells for targets `away_m` from the vehicle at most.

    Layers lie between two heights, about `layer_m` apart, and one where these are no farther apart.
    """
    span = max(highest_m - lowest_m, 0.0)
    layers = min(1 + int(span / layer_m + 0.5), most_layers)
    along = ALONG if layers == 1 else ALONG_LAYERED
    half_m = (0.5 - 1.0 / ROLL_WITHIN) * along * width_m
    levels = 1
    while levels < MOST_LEVELS and half_m * 2.0 ** (levels - 1) < away_m:
        levels += 1
    if layers == 1:
        return RouteCells(along, width_m, levels, lowest_m + 0.5 * span, layer_m, 1)
    return RouteCells(along, width_m, levels, lowest_m, span / (layers - 1), layers)
