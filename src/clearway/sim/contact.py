"""What a flight hit: told by name, in the world and among intruders."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray
from clearway.obstacles.columns import Columns
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.point_world import PointWorld
from clearway.obstacles.world import CombinedWorld, World


def what_stands(world: World | None, place_m: FloatArray) -> str:
    """What of a world stands nearest to a place [3], world frame."""
    if isinstance(world, CombinedWorld):
        away_m = [float(each.distance_m(place_m[None])[0]) for each in world.worlds]
        return what_stands(world.worlds[int(np.argmin(away_m))], place_m)
    if isinstance(world, ObstacleMap):
        return world.label(int(world.nearest(place_m[None])[1][0]))
    if isinstance(world, Columns):
        number = int(world.nearest(place_m[None])[1][0])
        return "the ground" if number < 0 else world.obstacles[number].name
    return "a surveyed point" if isinstance(world, PointWorld) else "an obstacle"
