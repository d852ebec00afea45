"""Map obstacles (5.49): ball, line, plane and cuboid, all of them rounded boxes.

A box with half lengths along its local axes (0 where the shape has none), rotated by (3.37) and
inflated by a radius: a ball is an inflated point, a line a capsule, a plane a rounded plate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import Floats, Floats2, Floats3, Ints
from clearway.base.brief import brief
from clearway.base.checks import (
    above_zero_problem,
    check_floats,
    choice_problem,
    collect_problems,
    number_problem,
    shape_of,
    vector_problem,
)
from clearway.base.compiled import compiled
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray, world_from_body
from clearway.base.state import freeze_array
from clearway.obstacles.rounded_box import measure_rounded_box_distance, offset_volume

ObstacleShape = Literal["ball", "line", "plane", "cuboid"]
SHAPE_SIZES: dict[str, int] = {"ball": 0, "line": 1, "plane": 2, "cuboid": 3}
"""How many lengths each shape has; they lie along its local x, then y, then z."""


class Shapes(NamedTuple):
    """Obstacles of one frame, world or grid, as compiled loops take them."""

    center_m: Floats2
    """[n, 3] frame of the collection."""
    rotation: Floats3
    """[n, 3, 3] frame_from_local."""
    half_m: Floats2
    """[n, 3] half lengths along the local axes."""
    radius_m: Floats
    """[n] inflation."""
    bound_m: Floats
    """[n] radius of the sphere around the centre that holds the obstacle."""
    source: Ints
    """[n] index in the obstacle map that they come from."""

    def __repr__(self) -> str:
        return brief(self)


@dataclass(frozen=True, eq=False)
class Obstacle:
    """One obstacle of the map (5.49), in the frame of its collection.

    Raises
    ------
    InputError
        Naming every field which cannot be used.

    Examples
    --------
    >>> import clearway as cw
    >>> cw.Obstacle.ball([6.0, 0.5, 0.0], 1.5).shape
    'ball'
    """

    shape: ObstacleShape
    position_m: FloatArray
    """[3] centre."""
    _: KW_ONLY
    orientation_rad: FloatArray = field(default_factory=lambda: np.zeros(3))
    """[3] roll, pitch (nose down positive), yaw (left positive), as in (3.37)."""
    size_m: tuple[float, ...] = ()
    """Full lengths along local x, y, z without the radius: none, 1, 2 or 3, by the shape."""
    radius_m: float = 0.0
    """Offset radius: how far the surface lies from the point, line, plate or box."""
    name: str = ""

    __repr__ = brief

    def __post_init__(self) -> None:
        problems = _problems(self)
        if problems:
            raise InputError(f"obstacle {self.name!r}" if self.name else "obstacle", problems)
        object.__setattr__(self, "position_m", freeze_array(self.position_m, (3,)))
        object.__setattr__(self, "orientation_rad", freeze_array(self.orientation_rad, (3,)))
        object.__setattr__(self, "size_m", tuple(float(size) for size in self.size_m))
        object.__setattr__(self, "radius_m", float(self.radius_m))

    @classmethod
    def ball(cls, position_m: npt.ArrayLike, radius_m: float, *, name: str = "") -> Obstacle:
        """Make a ball.

        Parameters
        ----------
        position_m
            [3] centre.
        radius_m
            Of the ball.
        name
            For messages.

        Returns
        -------
        Obstacle
            In the frame of the position.

        Raises
        ------
        InputError
            Naming every value that cannot be used.
        """
        return cls(
            "ball", check_floats("obstacle position_m", position_m), radius_m=radius_m, name=name
        )

    @classmethod
    def line(
        cls,
        position_m: npt.ArrayLike,
        length_m: float,
        *,
        radius_m: float,
        orientation_rad: npt.ArrayLike = (0.0, 0.0, 0.0),
        name: str = "",
    ) -> Obstacle:
        """Make a capsule whose axis lies along local x.

        Parameters
        ----------
        position_m
            [3] centre.
        length_m
            Of the axis.
        radius_m
            How far the surface lies from the axis.
        orientation_rad
            [3] roll, pitch (nose down positive), yaw (left positive).
        name
            For messages.

        Returns
        -------
        Obstacle
            In the frame of the position.

        Raises
        ------
        InputError
            Naming every value that cannot be used.
        """
        orientation = check_floats("obstacle orientation_rad", orientation_rad)
        return cls(
            "line",
            check_floats("obstacle position_m", position_m),
            orientation_rad=orientation,
            size_m=(length_m,),
            radius_m=radius_m,
            name=name,
        )

    @classmethod
    def line_between(
        cls, start_m: npt.ArrayLike, end_m: npt.ArrayLike, *, radius_m: float, name: str = ""
    ) -> Obstacle:
        """Make a capsule whose axis runs from one point to another, such as a wire.

        Parameters
        ----------
        start_m
            [3] one end of the axis.
        end_m
            [3] the other end.
        radius_m
            How far the surface lies from the axis.
        name
            For messages.

        Returns
        -------
        Obstacle
            In the frame of the points.

        Raises
        ------
        InputError
            Naming every value that cannot be used.
        """
        ends = (vector_problem("start_m", start_m, 3), vector_problem("end_m", end_m, 3))
        if problems := collect_problems(ends):
            raise InputError(f"obstacle {name!r}" if name else "obstacle", problems)
        start, end = check_floats("start_m", start_m), check_floats("end_m", end_m)
        along = end - start
        pitch_down = np.arctan2(-along[2], np.hypot(along[0], along[1]))
        orientation = np.array([0.0, pitch_down, np.arctan2(along[1], along[0])])
        length = float(np.linalg.norm(along))
        return cls(
            "line",
            0.5 * (start + end),
            orientation_rad=orientation,
            size_m=(length,),
            radius_m=radius_m,
            name=name,
        )

    @classmethod
    def plane(
        cls,
        position_m: npt.ArrayLike,
        size_m: tuple[float, float],
        *,
        radius_m: float,
        orientation_rad: npt.ArrayLike = (0.0, 0.0, 0.0),
        name: str = "",
    ) -> Obstacle:
        """Make a rounded plate in the local x-y plane.

        Parameters
        ----------
        position_m
            [3] centre.
        size_m
            Lengths along local x and y, without the radius.
        radius_m
            Half the thickness of the plate.
        orientation_rad
            [3] roll, pitch (nose down positive), yaw (left positive).
        name
            For messages.

        Returns
        -------
        Obstacle
            In the frame of the position.

        Raises
        ------
        InputError
            Naming every value that cannot be used.
        """
        orientation = check_floats("obstacle orientation_rad", orientation_rad)
        return cls(
            "plane",
            check_floats("obstacle position_m", position_m),
            orientation_rad=orientation,
            size_m=size_m,
            radius_m=radius_m,
            name=name,
        )

    @classmethod
    def cuboid(
        cls,
        position_m: npt.ArrayLike,
        size_m: tuple[float, float, float],
        *,
        radius_m: float = 0.0,
        orientation_rad: npt.ArrayLike = (0.0, 0.0, 0.0),
        name: str = "",
    ) -> Obstacle:
        """Make a box.

        Parameters
        ----------
        position_m
            [3] centre.
        size_m
            Lengths along local x, y and z, without the radius.
        radius_m
            How far the surface lies outside of these lengths; 0 for sharp edges.
        orientation_rad
            [3] roll, pitch (nose down positive), yaw (left positive).
        name
            For messages.

        Returns
        -------
        Obstacle
            In the frame of the position.

        Raises
        ------
        InputError
            Naming every value that cannot be used.
        """
        orientation = check_floats("obstacle orientation_rad", orientation_rad)
        return cls(
            "cuboid",
            check_floats("obstacle position_m", position_m),
            orientation_rad=orientation,
            size_m=size_m,
            radius_m=radius_m,
            name=name,
        )

    @property
    def half_m(self) -> FloatArray:
        """[3] half lengths along the local axes, 0 where the shape has none."""
        return 0.5 * np.array(self.size_m + (0.0,) * (3 - len(self.size_m)))

    @property
    def volume_m3(self) -> float:
        """Exact volume, by Steiner's formula for the inflated box."""
        hx, hy, hz = self.half_m
        return offset_volume(hx, hy, hz, self.radius_m)


def shapes_of(obstacles: Sequence[Obstacle]) -> Shapes:
    """The obstacles as arrays, in the frame that they are given in."""
    count = len(obstacles)
    orientation = np.array([o.orientation_rad for o in obstacles]).reshape(count, 3)
    half = np.array([o.half_m for o in obstacles]).reshape(count, 3)
    radius = np.array([o.radius_m for o in obstacles], dtype=np.float64)
    return Shapes(
        center_m=np.array([o.position_m for o in obstacles]).reshape(count, 3),
        rotation=np.ascontiguousarray(world_from_body(orientation)),
        half_m=half,
        radius_m=radius,
        bound_m=np.linalg.norm(half, axis=1) + radius,
        source=np.arange(count, dtype=np.int64),
    )


def _problems(obstacle: Obstacle) -> list[str]:
    """What is wrong with the fields, one line each."""
    problems = []
    if unknown := choice_problem("shape", obstacle.shape, get_args(ObstacleShape)):
        return [unknown]
    for name in ("position_m", "orientation_rad"):
        problems += collect_problems([vector_problem(name, getattr(obstacle, name), 3)])
    needed, sizes = SHAPE_SIZES[obstacle.shape], obstacle.size_m
    given = tuple(sizes) if len(shape_of(sizes)) == 1 else None
    if given is None:
        given = ()
        problems.append(f"size_m: a sequence of {needed} lengths is needed, got {sizes!r}")
    elif len(given) != needed:
        problems.append(f"size_m: a {obstacle.shape} needs {needed} lengths, got {len(given)}")
    if any(above_zero_problem("size_m", size) for size in given):
        problems.append(f"size_m: lengths must be positive and finite, got {list(given)}")
    radius = obstacle.radius_m
    unusable = number_problem("radius_m", radius)
    if unusable:
        problems.append(unusable)
    elif radius == 0.0 and obstacle.shape != "cuboid":
        problems.append(f"radius_m: a {obstacle.shape} needs a radius > 0, else it has no body")
    return problems


@compiled
def shape_distance(x: float, y: float, z: float, shapes: Shapes, n: int) -> float:
    """Signed distance in metres of a point to the surface of the n-th shape."""
    return measure_rounded_box_distance(
        x, y, z, shapes.center_m[n], shapes.rotation[n], shapes.half_m[n], shapes.radius_m[n]
    )


@compiled
def local_distance(x: float, y: float, z: float, shapes: Shapes) -> float:
    """Signed distance of a point to the nearest of all shapes; infinite without any."""
    nearest = np.inf
    for n in range(len(shapes.radius_m)):
        nearest = min(nearest, shape_distance(x, y, z, shapes, n))
    return nearest
