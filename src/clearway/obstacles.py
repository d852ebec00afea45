"""Map obstacles (5.49): ball, line, plane and cuboid, all of them rounded boxes.

A box with half lengths along its local axes (0 where the shape has none), rotated by (3.37) and
inflated by a radius: a ball is an inflated point, a line a capsule, a plane a rounded plate.
Each is convex, so a distance along a ray is a convex function and Newton's method finds a hit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from clearway.compiled import compiled
from clearway.errors import InputError
from clearway.frames import FloatArray, world_from_body
from clearway.state import IntArray, frozen_array

ObstacleShape = Literal["ball", "line", "plane", "cuboid"]
SHAPE_SIZES: dict[str, int] = {"ball": 0, "line": 1, "plane": 2, "cuboid": 3}
"""How many lengths each shape has; they lie along its local x, then y, then z."""

RAY_TOLERANCE_M = 1e-10
MAX_RAY_STEPS = 100
"""Rays that graze a surface converge by halves only; this many bring them within the tolerance."""


class Shapes(NamedTuple):
    """Obstacles of one frame, world or grid, as compiled loops take them."""

    center_m: FloatArray
    """[n, 3] frame of the collection."""
    rotation: FloatArray
    """[n, 3, 3] frame_from_local."""
    half_m: FloatArray
    """[n, 3] half lengths along the local axes."""
    radius_m: FloatArray
    """[n] inflation."""
    bound_m: FloatArray
    """[n] radius of the sphere around the centre that holds the obstacle."""
    source: IntArray
    """[n] index in the obstacle map that they come from."""


@dataclass(frozen=True, eq=False)
class Obstacle:
    """One obstacle of the map (5.49), in the frame of its collection.

    Raises InputError that names every field which cannot be used.
    """

    shape: ObstacleShape
    position_m: FloatArray
    """[3] centre."""
    orientation_rad: FloatArray = field(default_factory=lambda: np.zeros(3))
    """[3] roll, pitch (nose down positive), yaw (left positive), as in (3.37)."""
    size_m: tuple[float, ...] = ()
    """Full lengths along local x, y, z without the radius: none, 1, 2 or 3, by the shape."""
    radius_m: float = 0.0
    """Offset radius: how far the surface lies from the point, line, plate or box."""
    name: str = ""

    def __post_init__(self) -> None:
        problems = _problems(self)
        if problems:
            raise InputError(f"obstacle {self.name!r}" if self.name else "obstacle", problems)
        object.__setattr__(self, "position_m", frozen_array(self.position_m, (3,)))
        object.__setattr__(self, "orientation_rad", frozen_array(self.orientation_rad, (3,)))
        object.__setattr__(self, "size_m", tuple(float(size) for size in self.size_m))
        object.__setattr__(self, "radius_m", float(self.radius_m))

    @classmethod
    def ball(cls, position_m: npt.ArrayLike, radius_m: float, name: str = "") -> Obstacle:
        """A ball around its centre."""
        return cls("ball", _numbers(position_m), radius_m=radius_m, name=name)

    @classmethod
    def line(
        cls,
        position_m: npt.ArrayLike,
        length_m: float,
        radius_m: float,
        orientation_rad: npt.ArrayLike = (0.0, 0.0, 0.0),
        name: str = "",
    ) -> Obstacle:
        """A capsule whose axis lies along local x."""
        orientation = _numbers(orientation_rad)
        return cls("line", _numbers(position_m), orientation, (length_m,), radius_m, name)

    @classmethod
    def line_between(
        cls, start_m: npt.ArrayLike, end_m: npt.ArrayLike, radius_m: float, name: str = ""
    ) -> Obstacle:
        """A capsule whose axis runs from one point [3] to another, such as a wire."""
        start, end = _numbers(start_m), _numbers(end_m)
        along = end - start
        pitch_down = np.arctan2(-along[2], np.hypot(along[0], along[1]))
        orientation = np.array([0.0, pitch_down, np.arctan2(along[1], along[0])])
        length = float(np.linalg.norm(along))
        return cls("line", 0.5 * (start + end), orientation, (length,), radius_m, name)

    @classmethod
    def plane(
        cls,
        position_m: npt.ArrayLike,
        size_m: tuple[float, float],
        radius_m: float,
        orientation_rad: npt.ArrayLike = (0.0, 0.0, 0.0),
        name: str = "",
    ) -> Obstacle:
        """A rounded plate in the local x-y plane, `2 radius_m` thick."""
        orientation = _numbers(orientation_rad)
        return cls("plane", _numbers(position_m), orientation, size_m, radius_m, name)

    @classmethod
    def cuboid(
        cls,
        position_m: npt.ArrayLike,
        size_m: tuple[float, float, float],
        radius_m: float = 0.0,
        orientation_rad: npt.ArrayLike = (0.0, 0.0, 0.0),
        name: str = "",
    ) -> Obstacle:
        """A box, sharp-edged if the radius is 0."""
        orientation = _numbers(orientation_rad)
        return cls("cuboid", _numbers(position_m), orientation, size_m, radius_m, name)

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


def _numbers(values: npt.ArrayLike) -> FloatArray:
    return np.asarray(values, dtype=np.float64)


def _problems(obstacle: Obstacle) -> list[str]:
    """What is wrong with the fields, one line each."""
    problems = []
    if obstacle.shape not in get_args(ObstacleShape):
        choices = ", ".join(get_args(ObstacleShape))
        return [f"shape: {obstacle.shape!r} is none of {choices}"]
    for name in ("position_m", "orientation_rad"):
        values = np.asarray(getattr(obstacle, name), dtype=np.float64)
        if values.shape != (3,) or not np.all(np.isfinite(values)):
            problems.append(f"{name}: three finite numbers are needed, got {values.tolist()}")
    needed, given = SHAPE_SIZES[obstacle.shape], tuple(obstacle.size_m)
    if len(given) != needed:
        problems.append(f"size_m: a {obstacle.shape} needs {needed} lengths, got {len(given)}")
    if not all(np.isfinite(size) and size > 0.0 for size in given):
        problems.append(f"size_m: lengths must be positive and finite, got {list(given)}")
    radius = obstacle.radius_m
    if not (np.isfinite(radius) and radius >= 0.0):
        problems.append(f"radius_m: must be a finite number >= 0, got {radius}")
    elif radius == 0.0 and obstacle.shape != "cuboid":
        problems.append(f"radius_m: a {obstacle.shape} needs a radius > 0, else it has no body")
    return problems


@compiled
def offset_volume(hx: float, hy: float, hz: float, radius: float) -> float:
    """Volume of a box of half lengths hx, hy, hz inflated by a radius (Steiner's formula)."""
    faces = 8.0 * (hx * hy + hy * hz + hz * hx)
    edges = 2.0 * np.pi * (hx + hy + hz)
    ball = 4.0 / 3.0 * np.pi
    return 8.0 * hx * hy * hz + radius * (faces + radius * (edges + radius * ball))


@compiled
def local_vector(
    dx: float, dy: float, dz: float, rotation: FloatArray
) -> tuple[float, float, float]:
    """A direction in the local axes of an obstacle: the transpose of frame_from_local."""
    return (
        rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz,
        rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz,
        rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz,
    )


@compiled
def local_point(
    x: float, y: float, z: float, center: FloatArray, rotation: FloatArray
) -> tuple[float, float, float]:
    """A point in the local axes of an obstacle."""
    return local_vector(x - center[0], y - center[1], z - center[2], rotation)


@compiled
def box_distance(x: float, y: float, z: float, hx: float, hy: float, hz: float) -> float:
    """Signed distance of a local point to the box before inflation; negative inside."""
    return distance_beyond(abs(x) - hx, abs(y) - hy, abs(z) - hz)


@compiled
def distance_beyond(qx: float, qy: float, qz: float) -> float:
    """Signed distance to a box of a point that lies so far beyond its faces along each axis."""
    nearest_face: float = max(qx, max(qy, qz))
    if nearest_face <= 0.0:
        return nearest_face
    ox, oy, oz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
    return math.sqrt(ox * ox + oy * oy + oz * oz)


@compiled
def rounded_box_distance(
    x: float,
    y: float,
    z: float,
    center: FloatArray,
    rotation: FloatArray,
    half: FloatArray,
    radius: float,
) -> float:
    """Signed distance in metres of a point to an obstacle's surface; negative inside, exact.

    center [3], rotation [3, 3] (frame_from_local), half [3], radius: one entry of `Shapes`.
    """
    lx, ly, lz = local_point(x, y, z, center, rotation)
    return box_distance(lx, ly, lz, half[0], half[1], half[2]) - radius


@compiled
def shape_distance(x: float, y: float, z: float, shapes: Shapes, n: int) -> float:
    """Signed distance in metres of a point to the surface of the n-th shape."""
    return rounded_box_distance(
        x, y, z, shapes.center_m[n], shapes.rotation[n], shapes.half_m[n], shapes.radius_m[n]
    )


@compiled
def outward_normal(
    lx: float, ly: float, lz: float, half: FloatArray, rotation: FloatArray
) -> tuple[float, float, float]:
    """Direction, in the obstacle's frame, in which its distance grows at a local point."""
    qx, qy, qz = abs(lx) - half[0], abs(ly) - half[1], abs(lz) - half[2]
    nearest_face = max(qx, max(qy, qz))
    ox, oy, oz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
    if nearest_face <= 0.0:
        ox = 1.0 if qx == nearest_face else 0.0
        oy = 1.0 if qy == nearest_face and ox == 0.0 else 0.0
        oz = 1.0 - ox - oy
    length = math.sqrt(ox * ox + oy * oy + oz * oz)
    ox = math.copysign(ox / length, lx)
    oy = math.copysign(oy / length, ly)
    oz = math.copysign(oz / length, lz)
    return (
        rotation[0, 0] * ox + rotation[0, 1] * oy + rotation[0, 2] * oz,
        rotation[1, 0] * ox + rotation[1, 1] * oy + rotation[1, 2] * oz,
        rotation[2, 0] * ox + rotation[2, 1] * oy + rotation[2, 2] * oz,
    )


@compiled
def local_distance(x: float, y: float, z: float, shapes: Shapes) -> float:
    """Signed distance of a point to the nearest of all shapes; infinite without any."""
    nearest = np.inf
    for n in range(len(shapes.radius_m)):
        nearest = min(nearest, shape_distance(x, y, z, shapes, n))
    return nearest


@compiled
def ray_rounded_box(
    x: float,
    y: float,
    z: float,
    ux: float,
    uy: float,
    uz: float,
    center: FloatArray,
    rotation: FloatArray,
    half: FloatArray,
    radius: float,
) -> float:
    """Distance along a ray of unit direction u to its entry into an obstacle.

    0 if the ray starts inside, infinite if it misses. Distance to a convex body is convex along
    the ray, so Newton's steps never pass the entry; where it no longer falls the ray has missed.
    """
    px, py, pz = local_point(x, y, z, center, rotation)
    ex, ey, ez = local_vector(ux, uy, uz, rotation)
    t = _bounding_sphere_entry(px, py, pz, ex, ey, ez, half, radius)
    for _ in range(MAX_RAY_STEPS):
        if t == np.inf:
            break
        x, y, z = px + t * ex, py + t * ey, pz + t * ez
        distance = box_distance(x, y, z, half[0], half[1], half[2])
        if distance - radius <= 0.0:
            break
        # The distance grows along the offset from the box, so this is its rate along the ray.
        ox = math.copysign(max(abs(x) - half[0], 0.0), x)
        oy = math.copysign(max(abs(y) - half[1], 0.0), y)
        oz = math.copysign(max(abs(z) - half[2], 0.0), z)
        rate = (ox * ex + oy * ey + oz * ez) / distance
        if rate >= 0.0:
            return math.inf
        step = (radius - distance) / rate
        t += step
        if step <= RAY_TOLERANCE_M:
            break
    return t


@compiled
def _bounding_sphere_entry(
    px: float,
    py: float,
    pz: float,
    ex: float,
    ey: float,
    ez: float,
    half: FloatArray,
    radius: float,
) -> float:
    """Where a local ray enters the sphere around the obstacle; 0 inside, infinite if it misses."""
    bound = radius + math.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2])
    outside = px * px + py * py + pz * pz - bound * bound
    if outside <= 0.0:
        return 0.0
    ahead = -(px * ex + py * ey + pz * ez)
    chord = ahead * ahead - outside
    if chord < 0.0 or ahead < 0.0:
        return math.inf
    return ahead - math.sqrt(chord)
