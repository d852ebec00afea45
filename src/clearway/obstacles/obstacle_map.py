"""The obstacle map (5.49): what was known before take-off, quick to ask from any place."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2
from clearway.base.brief import one_line
from clearway.base.checks import are_points, check_floats, check_points, kind_of
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

    Parameters
    ----------
    obstacles
        World frame.
    complete_m
        [2, 3] lowest and highest corner of the box in which it shows all that stands there, world
        frame; None where nothing is declared.

    Raises
    ------
    ClearwayError
        For what are no obstacles and no box.

    Examples
    --------
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
        if isinstance(obstacles, Obstacle) or not (
            isinstance(obstacles, Iterable) and np.iterable(obstacles)
        ):
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
        """Return how messages call an obstacle: its index, shape and name.

        Parameters
        ----------
        index
            Of the obstacle in `obstacles`.

        Returns
        -------
        str
            Such as "obstacle 0 (ball)".
        """
        obstacle = self.obstacles[index]
        name = f" {obstacle.name!r}" if obstacle.name else ""
        return f"obstacle {index}{name} ({obstacle.shape})"

    def near(self, position_m: npt.ArrayLike, radius_m: float) -> IntArray:
        """Find the obstacles near a position.

        Parameters
        ----------
        position_m
            [3] world frame.
        radius_m
            Within which their surface is.

        Returns
        -------
        IntArray
            Their indices, ascending.
        """
        x, y, z = np.asarray(position_m, dtype=np.float64)
        return obstacles_within(x, y, z, float(radius_m), self.shapes, self.tree)

    def nearest(self, points_m: npt.ArrayLike) -> tuple[FloatArray, IntArray]:
        """Find the nearest obstacle of each point.

        Parameters
        ----------
        points_m
            [n, 3] world frame.

        Returns
        -------
        tuple of FloatArray and IntArray
            [n] signed distance in metres, inf without any, and [n] index of the obstacle, -1 for
            none.

        Raises
        ------
        ClearwayError
            For points of another shape.
        """
        return self._nearest(points_m, np.inf)

    def distance_m(self, points_m: npt.ArrayLike, within_m: float = np.inf) -> FloatArray:
        """Return the distance of points to the nearest surface.

        Parameters
        ----------
        points_m
            [n, 3] world frame.
        within_m
            Beyond which no distance is needed, which is found sooner.

        Returns
        -------
        FloatArray
            [n] signed distance in metres; inf without any obstacle, and where it is not below
            `within_m`.

        Raises
        ------
        ClearwayError
            For points of another shape.
        """
        return self._nearest(points_m, within_m)[0]

    def _nearest(self, points_m: npt.ArrayLike, within_m: float) -> tuple[FloatArray, IntArray]:
        points = check_points("obstacle map: points", points_m)
        return nearest_obstacles(points, float(within_m), self.shapes, self.tree)

    def cast(
        self, origin_m: npt.ArrayLike, directions: npt.ArrayLike, max_range_m: float
    ) -> FloatArray:
        """Cast rays from a point.

        Parameters
        ----------
        origin_m
            [3] where they begin, world frame.
        directions
            [n, 3] unit vectors, world frame.
        max_range_m
            Beyond which nothing is met.

        Returns
        -------
        FloatArray
            [n] range in metres; inf where nothing is met.

        Raises
        ------
        ClearwayError
            For directions of another shape.
        """
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
        """Return the obstacles within the grid's range plus a margin, O_M(A): (5.50).

        Parameters
        ----------
        position_m
            [3] origin of the grid, world frame.
        world_from_grid
            [3, 3] rotation of the grid.
        grid
            Whose range counts.
        margin_m
            By which the range is exceeded.

        Returns
        -------
        Shapes
            Grid frame.
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
    box = np.array(check_floats("obstacle map: complete_m", corners_m))
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
