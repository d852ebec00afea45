"""The obstacle map (5.49): what was known before take-off, quick to ask from any place."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2
from clearway.base.brief import one_line
from clearway.base.checks import are_points, check_points, kind_of
from clearway.base.compiled import compiled, make_plain_array
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import IntArray
from clearway.obstacles.obstacle import Obstacle, Shapes, shapes_of
from clearway.obstacles.rays import cast_rays
from clearway.obstacles.tree import (
    BoxTree,
    build_box_tree,
    nearest_obstacles,
    obstacles_within,
)


class ObstacleMap:
    """Any number of obstacles in the world frame; an empty map is legal. Immutable.

    Serves as a world to fly in too: it has signed distances and casts rays.

    >>> import clearway as cw
    >>> trees = cw.ObstacleMap([cw.Obstacle.ball([6.0, 0.0, 0.0], 1.5)])
    >>> trees.distance_m([[0.0, 0.0, 0.0]]).tolist()
    [4.5]
    """

    __slots__ = ("complete_m", "obstacles", "shapes", "tree")

    obstacles: tuple[Obstacle, ...]
    shapes: Shapes
    """World frame."""
    tree: BoxTree
    complete_m: FloatArray | None
    """[2, 3] lowest and highest corner of the box in which it shows all that stands there, world
    frame; None where nothing is declared."""

    def __init__(
        self, obstacles: Sequence[Obstacle] = (), *, complete_m: npt.ArrayLike | None = None
    ) -> None:
        if isinstance(obstacles, Obstacle) or not isinstance(obstacles, Iterable):
            kind = type(obstacles).__name__
            raise ClearwayError(f"obstacle map: takes a sequence of obstacles, got {kind}")
        self.obstacles = tuple(kind_of("obstacle map", each, Obstacle) for each in obstacles)
        self.shapes = shapes_of(self.obstacles)
        self.tree = build_box_tree(self.shapes)
        self.complete_m = None if complete_m is None else _box(complete_m)

    def __repr__(self) -> str:
        named = [obstacle.name for obstacle in self.obstacles if obstacle.name]
        return one_line("ObstacleMap", (f"{len(self)} obstacles", *named))

    def __len__(self) -> int:
        return len(self.obstacles)

    def label(self, index: int) -> str:
        """How messages call an obstacle: its index, shape and name."""
        obstacle = self.obstacles[index]
        name = f" {obstacle.name!r}" if obstacle.name else ""
        return f"obstacle {index}{name} ({obstacle.shape})"

    def near(self, position_m: npt.ArrayLike, radius_m: float) -> IntArray:
        """Ascending indices of obstacles whose surface is within a radius of a world position."""
        x, y, z = np.asarray(position_m, dtype=np.float64)
        return obstacles_within(x, y, z, float(radius_m), self.shapes, self.tree)

    def nearest(self, points_m: npt.ArrayLike) -> tuple[FloatArray, IntArray]:
        """Signed distance [n] in metres of world points [n, 3] and whose it is [n]; -1 for none."""
        return self._nearest(points_m, np.inf)

    def distance_m(self, points_m: npt.ArrayLike, within_m: float = np.inf) -> FloatArray:
        """Signed distance [n] of world points [n, 3] to the nearest surface; inf without any, and
        where it is not below `within_m`, which is found sooner."""
        return self._nearest(points_m, within_m)[0]

    def _nearest(self, points_m: npt.ArrayLike, within_m: float) -> tuple[FloatArray, IntArray]:
        points = check_points("obstacle map: points", points_m)
        return nearest_obstacles(points, float(within_m), self.shapes, self.tree)

    def cast(
        self, origin_m: npt.ArrayLike, directions: npt.ArrayLike, max_range_m: float
    ) -> FloatArray:
        """Range [n] from a world point [3] along unit directions [n, 3]; inf where none is met."""
        return cast_rays(
            make_plain_array(np.asarray(origin_m, dtype=np.float64)),
            make_plain_array(
                directions
                if are_points(directions)
                else check_points("obstacle map: directions", directions)
            ),
            float(max_range_m),
            self.shapes,
            self.tree,
        )

    def in_grid(
        self,
        position_m: npt.ArrayLike,
        world_from_grid: FloatArray,
        grid: AvoidanceGrid,
        margin_m: float = 0.0,
    ) -> Shapes:
        """Obstacles within the grid's range plus a margin, in the grid frame: O_M(A) (5.50).

        position_m: [3] origin of the grid in the world; world_from_grid: [3, 3] its rotation.
        """
        return _in_frame(
            np.ascontiguousarray(position_m, dtype=np.float64),
            np.ascontiguousarray(world_from_grid, dtype=np.float64),
            grid.range_m + float(margin_m),
            self.shapes,
            self.tree,
        )


def _box(corners_m: npt.ArrayLike) -> FloatArray:
    """[2, 3] read-only; ClearwayError for corners that bound no box."""
    box = np.array(corners_m, dtype=np.float64)
    if box.shape != (2, 3) or not np.all(box[0] < box[1]):
        raise ClearwayError(
            f"obstacle map: complete_m must be the lowest and the highest corner of a box, got "
            f"{box.tolist()}"
        )
    box.setflags(write=False)
    return box


@compiled
def _in_frame(
    position: Floats, world_from_grid: Floats2, reach: float, shapes: Shapes, tree: BoxTree
) -> Shapes:
    """The obstacles within `reach` of a position, turned into the frame that sits there."""
    near = obstacles_within(position[0], position[1], position[2], reach, shapes, tree)
    center = np.empty((len(near), 3))
    rotation = np.empty((len(near), 3, 3))
    for s in range(len(near)):
        n = near[s]
        for i in range(3):
            center[s, i] = 0.0
            for j in range(3):
                offset = shapes.center_m[n, j] - position[j]
                center[s, i] += world_from_grid[j, i] * offset
                rotation[s, i, j] = 0.0
                for k in range(3):
                    rotation[s, i, j] += world_from_grid[k, i] * shapes.rotation[n, k, j]
    return Shapes(
        center,
        rotation,
        shapes.half_m[near],
        shapes.radius_m[near],
        shapes.bound_m[near],
        shapes.source[near],
    )
