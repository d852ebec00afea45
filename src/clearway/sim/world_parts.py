"""What made-up worlds are put together from: legs, poles, walls, and groups of parts in a pose."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, attitude_from_rotation, world_from_body
from clearway.base.state import State
from clearway.live.mission import Mission
from clearway.obstacles.columns import Columns
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import World

Span = tuple[float, float]
"""Least and greatest, between which a seed draws."""


class MadeWorld(NamedTuple):
    """A made-up world and the flight through it."""

    world: ObstacleMap | Columns
    mission: Mission
    heights_m: Span | None = None
    """Lowest and highest height to fly at; None for any."""
    corridor_m: float | None = None
    """Half the width of what is flown in about the straight way; None for any."""
    smallest_object_m: float | None = None
    """Thickness of the thinnest thing, where that is declared."""


MakeWorld = Callable[[int], MadeWorld]
"""From a seed."""
TALL_M = 200.0
"""Height of what shall not be flown over or under."""
ROOM_M = 5.0
"""Around start and waypoints, where nothing is put: a turning radius and its margin."""
CLEAR_M = 1.2
"""Nothing stands so near a start or goal that is drawn at random."""
MOST_DRAWN = 1000
WALL_M = 0.5
"""Thickness of walls."""
AWAY_M = 100.0
"""Along each axis, how far worlds that may lie anywhere are moved at most."""


def leg(
    name: str, start: Sequence[float], end: Sequence[float], attitude: Sequence[float] = (0, 0, 0)
) -> Mission:
    """A mission from one place straight to another; attitude in radians."""
    return Mission(name, State(np.array(start), np.array(attitude)), waypoints_m=np.array([end]))


def upright(x: float, y: float, radius: float, name: str, height_m: float = TALL_M) -> Obstacle:
    """A pole around height 0."""
    low, high = np.array([x, y, -0.5 * height_m]), np.array([x, y, 0.5 * height_m])
    return Obstacle.line_between(low, high, radius_m=radius, name=name)


def wall(start: Sequence[float], end: Sequence[float], name: str) -> Obstacle:
    """An upright wall, too tall to fly over, from one place [2] to another on its middle line."""
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    along = b - a
    size = (float(np.linalg.norm(along)), WALL_M, TALL_M)
    yaw = float(np.arctan2(along[1], along[0]))
    middle = 0.5 * (a + b)
    return Obstacle.cuboid((*middle, 0.0), size, orientation_rad=(0.0, 0.0, yaw), name=name)


def place_parts(
    parts: Iterable[Obstacle], position_m: npt.ArrayLike, attitude_rad: npt.ArrayLike
) -> list[Obstacle]:
    """Parts that were made in a frame of their own, with that frame at a place and attitude."""
    origin, turn = np.asarray(position_m, dtype=np.float64), world_from_body(attitude_rad)
    return [
        replace(
            part,
            position_m=origin + turn @ part.position_m,
            orientation_rad=attitude_from_rotation(turn @ world_from_body(part.orientation_rad)),
        )
        for part in parts
    ]


def anywhere(made: MadeWorld, seed: int) -> MadeWorld:
    """Return a world and its mission moved and turned at random, by the seed: what stands where,
    seen from the start, stays the same. Nothing begins at whole metres, or along an axis."""
    world, mission = made.world, made.mission
    rng = np.random.default_rng([seed, 60])
    shift_m, yaw_rad = rng.uniform(-AWAY_M, AWAY_M, 3), float(rng.uniform(-np.pi, np.pi))
    turn = world_from_body((0.0, 0.0, yaw_rad))
    start = mission.start
    roll, pitch, yaw = start.attitude_rad.tolist()
    heading = float(np.remainder(yaw + yaw_rad + np.pi, 2.0 * np.pi) - np.pi)
    moved = replace(
        mission,
        start=replace(
            start,
            position_m=shift_m + turn @ start.position_m,
            attitude_rad=np.array([roll, pitch, heading]),
        ),
        waypoints_m=shift_m + mission.waypoints_m @ turn.T,
    )
    if isinstance(world, Columns):
        there: ObstacleMap | Columns = world.move(shift_m, yaw_rad)
    else:
        there = ObstacleMap(place_parts(world.obstacles, shift_m, (0.0, 0.0, yaw_rad)))
    heights = made.heights_m
    if heights is not None:
        heights = heights[0] + float(shift_m[2]), heights[1] + float(shift_m[2])
    return made._replace(world=there, mission=moved, heights_m=heights)


def enlarge(made: MadeWorld, times: float) -> MadeWorld:
    """Return a world and its mission with all lengths so many times as long."""
    world, mission = made.world, made.mission
    if isinstance(world, Columns):
        there: ObstacleMap | Columns = Columns(
            times * world.rows_m, ground_m=times * world.ground_m
        )
    else:
        there = ObstacleMap([_enlarge(part, times) for part in world.obstacles])
    start = mission.start
    longer = replace(
        mission,
        start=replace(start, position_m=times * start.position_m),
        waypoints_m=times * mission.waypoints_m,
        reach_radius_m=times * mission.reach_radius_m,
    )
    low_high = made.heights_m
    heights = None if low_high is None else (times * low_high[0], times * low_high[1])
    corridor, smallest = (
        None if one is None else times * one for one in (made.corridor_m, made.smallest_object_m)
    )
    return MadeWorld(there, longer, heights, corridor, smallest)


def _enlarge(part: Obstacle, times: float) -> Obstacle:
    return replace(
        part,
        position_m=times * part.position_m,
        size_m=tuple(times * one for one in part.size_m),
        radius_m=times * part.radius_m,
    )


class RandomEnds(NamedTuple):
    """How start and goals of a flight are moved at random."""

    aside_m: float
    """How far across the straight way at most, and half as far along it; to any height that is
    flown."""
    any_heading: bool
    """Whether the start is turned at random too."""


def scatter_ends(
    mission: Mission, world: World, heights_m: Span | None, ends: RandomEnds, seed: int
) -> Mission:
    """Move start and goals at random, by the seed: each to a place that nothing stands about.

    Raises ClearwayError where no place is free.
    """
    rng, start = np.random.default_rng([seed, 64]), mission.start
    places = np.concatenate([start.position_m[None], mission.waypoints_m])
    if ends.aside_m > 0.0:
        way = places[-1, :2] - places[0, :2]
        along = way / max(float(np.linalg.norm(way)), 1e-9)
        across = np.array([-along[1], along[0]])
        axes = ends.aside_m * np.stack([0.5 * along, across])
        places = np.array([_free_place(world, place, axes, heights_m, rng) for place in places])
    roll, pitch, yaw = start.attitude_rad.tolist()
    if ends.any_heading:
        yaw = float(rng.uniform(-np.pi, np.pi))
    begin = replace(start, position_m=places[0], attitude_rad=np.array([roll, pitch, yaw]))
    return replace(mission, start=begin, waypoints_m=places[1:])


def _free_place(
    world: World,
    place_m: FloatArray,
    axes_m: FloatArray,
    heights_m: Span | None,
    rng: np.random.Generator,
) -> FloatArray:
    """A place [3] near another, along level axes [2, 2], that nothing stands about."""
    low, high = heights_m or (place_m[2], place_m[2])
    spare = min(CLEAR_M, 0.4 * (high - low))
    for _ in range(MOST_DRAWN):
        x, y = place_m[:2] + rng.uniform(-1.0, 1.0, 2) @ axes_m
        there = np.array([x, y, rng.uniform(low + spare, high - spare)])
        if float(world.distance_m(there[None])[0]) > min(CLEAR_M, spare or CLEAR_M):
            return there
    raise ClearwayError(f"world: no free place near {place_m.tolist()}")


def roomy(mission: Mission, place_m: FloatArray, radius_m: float, room_m: float = ROOM_M) -> bool:
    """Whether a ball, or upright pole, at a place [3] or [2] leaves room at start and waypoints."""
    corners = np.concatenate([mission.start.position_m[None], mission.waypoints_m])
    gaps = np.linalg.norm(corners[:, : len(place_m)] - place_m, axis=1) - radius_m
    return bool(np.all(gaps >= room_m))


def draw_between(rng: np.random.Generator, span: Span) -> float:
    """A value between the ends of a span."""
    return float(rng.uniform(*span))
