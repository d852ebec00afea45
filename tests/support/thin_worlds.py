"""Worlds of thin things, each from a seed: wires across the way, poles, nets."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import world_from_body
from clearway.base.state import State
from clearway.live.mission import Mission
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap

LENGTH_M = 56.0
THINNEST_M = {"wires": 0.006, "poles": 0.016, "nets": 0.006}
"""Least thickness of anything in a family."""


def _mission(family: str, seed: int) -> Mission:
    return Mission(
        f"{family}-{seed}",
        State(np.array([-6.0, 0.0, 0.0])),
        waypoints_m=np.array([[LENGTH_M, 0.0, 0.0]]),
    )


def wires(seed: int) -> tuple[ObstacleMap, Mission]:
    """Level wires of 3 to 10 mm radius across the way, 5 to 8 m apart, at most 0.8 m high or low.

    Every other one is not quite square to the way, nor quite level.
    """
    rng = np.random.default_rng([seed, 31])
    things, x = [], 6.0
    while x < LENGTH_M - 4.0:
        tilt = rng.uniform(-0.2, 0.2, 2) * float(rng.integers(0, 2))
        things.append(
            Obstacle.line(
                [x, 0.0, rng.uniform(-0.8, 0.8)],
                50.0,
                radius_m=float(rng.uniform(0.003, 0.010)),
                orientation_rad=[0.0, tilt[0], 0.5 * np.pi + tilt[1]],
            )
        )
        x += rng.uniform(5.0, 8.0)
    return ObstacleMap(things), _mission("wires", seed)


def poles(seed: int) -> tuple[ObstacleMap, Mission]:
    """Upright poles of 8 to 40 mm radius, 2.5 m apart or more."""
    rng = np.random.default_rng([seed, 32])
    places: list[np.ndarray] = []
    for _ in range(300):
        place = rng.uniform([0.0, -9.0], [LENGTH_M - 6.0, 9.0])
        if all(np.linalg.norm(place - other) >= 2.5 for other in places) and len(places) < 60:
            places.append(place)
    things = [
        Obstacle.line(
            [x, y, 0.0],
            60.0,
            radius_m=float(rng.uniform(0.008, 0.040)),
            orientation_rad=[0.0, 0.5 * np.pi, 0.0],
        )
        for x, y in places
    ]
    return ObstacleMap(things), _mission("poles", seed)


def nets(seed: int) -> tuple[ObstacleMap, Mission]:
    """Upright nets of 3 to 4.5 m with meshes of 0.3 to 0.6 m, about on the way, 10 m apart."""
    rng = np.random.default_rng([seed, 33])
    things = []
    for x in np.arange(8.0, LENGTH_M - 4.0, 10.0):
        width, height = rng.uniform(3.0, 4.5, 2)
        y, z = rng.uniform(-1.5, 1.5, 2)
        mesh, radius = rng.uniform(0.3, 0.6), float(rng.uniform(0.003, 0.006))
        for side in np.arange(-0.5 * width, 0.5 * width + 1e-9, mesh):
            things.append(
                Obstacle.line(
                    [x, y + side, z],
                    height,
                    radius_m=radius,
                    orientation_rad=[0.0, 0.5 * np.pi, 0.0],
                )
            )
        for up in np.arange(-0.5 * height, 0.5 * height + 1e-9, mesh):
            things.append(
                Obstacle.line(
                    [x, y, z + up], width, radius_m=radius, orientation_rad=[0.0, 0.0, 0.5 * np.pi]
                )
            )
    return ObstacleMap(things), _mission("nets", seed)


FAMILIES = {"wires": wires, "poles": poles, "nets": nets}


class Capsules:
    """Lines with a radius as a world; who scans it goes through its axes."""

    def __init__(self, world: ObstacleMap) -> None:
        self.world = world
        ends = [_ends(obstacle) for obstacle in world.obstacles]
        self.start = np.array([start for start, _, _ in ends])
        self.end = np.array([end for _, end, _ in ends])
        self.radius = np.array([radius for _, _, radius in ends])

    def distance_m(self, points_m: np.ndarray) -> np.ndarray:
        return self.world.distance_m(points_m)

    def distance_to_axes_m(self, place_m: np.ndarray) -> np.ndarray:
        """[n] from a place [3] to each line."""
        along, to = self.end - self.start, place_m - self.start
        share = np.clip(np.sum(to * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)
        return np.asarray(np.linalg.norm(to - share[:, None] * along, axis=1))


def _ends(line: Obstacle) -> tuple[np.ndarray, np.ndarray, float]:
    along = world_from_body(line.orientation_rad)[:, 0] * 0.5 * line.size_m[0]
    return line.position_m - along, line.position_m + along, line.radius_m
