"""Fences and rally points of a ground station's plan, as items of MAVLink."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

from clearway.io.foreign import position_of, rings_of
from clearway.io.maps.map_features import Disc, Geodetic, Polygon
from clearway.io.plans.plan_commands import (
    CIRCLE_INSIDE,
    CIRCLE_OUTSIDE,
    FENCE_INSIDE,
    FENCE_OUTSIDE,
    RALLY,
    name_command,
)

LARGEST_FENCE_M = 100_000.0


class Fence(NamedTuple):
    """An area to stay inside of, or outside."""

    name: str
    outline: Disc | Polygon
    inclusion: bool


def polygon_fence(number: int, corners: list[list[float]], *, inclusion: bool) -> Fence:
    """Return a fence of corners (latitude, longitude); ValueError where they make no area."""
    ring = [[longitude, latitude] for latitude, longitude in corners]
    return Fence(f"fence {number}", Polygon(rings_of([ring])), inclusion)


def round_fence(
    number: int, center: tuple[float, float], radius_m: float, *, inclusion: bool
) -> Fence:
    """Return a round fence; ValueError saying what is out of range."""
    latitude, longitude = position_of([center[1], center[0]])
    if not 0.0 < radius_m <= LARGEST_FENCE_M:
        raise ValueError(f"radius {radius_m:g} m is not above 0 and at most {LARGEST_FENCE_M:g} m")
    return Fence(f"round fence {number}", Disc(latitude, longitude, radius_m), inclusion)


class LimitsRead:
    """Fences and rally points while items are read: of a polygon each corner is an item."""

    def __init__(self) -> None:
        self.fences: list[Fence] = []
        self.rally: list[Geodetic] = []
        self.left_out: Counter[str] = Counter()
        self._corners: list[list[float]] = []
        self._open = (0, 0.0)
        """Command and number of corners of the polygon that is being read."""

    def take(
        self,
        command: int,
        size: float | None,
        position: tuple[float | None, float | None, float | None],
    ) -> None:
        """One item; `size` is a number of corners or a radius. ValueError saying what is wrong."""
        latitude, longitude, height = position
        if command == RALLY:
            self.rally.append(Geodetic(*position_of([longitude, latitude]), height or 0.0))
        elif command in (CIRCLE_INSIDE, CIRCLE_OUTSIDE):
            center = position_of([longitude, latitude])
            inside = command == CIRCLE_INSIDE
            self.fences.append(round_fence(len(self.fences), center, size or 0.0, inclusion=inside))
        elif command in (FENCE_INSIDE, FENCE_OUTSIDE):
            self._take_corner(command, size or 0.0, position_of([longitude, latitude]))
        else:
            self.left_out[f"{name_command(command)}, which is not kept to"] += 1

    def _take_corner(self, command: int, corners: float, corner: tuple[float, float]) -> None:
        if self._corners and self._open != (command, corners):
            self.end()
        self._open = (command, corners)
        self._corners.append(list(corner))
        if len(self._corners) >= corners:
            found, self._corners = self._corners, []
            self.fences.append(
                polygon_fence(len(self.fences), found, inclusion=command == FENCE_INSIDE)
            )

    def end(self) -> None:
        """Raise ValueError where the last polygon has fewer corners than it should."""
        if self._corners:
            found, self._corners = len(self._corners), []
            raise ValueError(f"a fence of {self._open[1]:g} corners has {found} of them")
