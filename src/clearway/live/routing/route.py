"""Ways round known obstacles, and the refusal before take-off of what cannot be flown.

A route is found on voxels whose steps surely keep the margin. That none is found proves nothing:
refused is only what `proof` proves to be closed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.live.routing.distance_field import (
    HALF_DIAGONAL,
    Distance,
    VoxelField,
    segment_is_clear,
)
from clearway.live.routing.infeasibility import InfeasibilityProof, prove_infeasible
from clearway.obstacles.obstacle_map import ObstacleMap

SIGHT_STEPS = 8.0
"""How often per margin a straight way is checked."""
PADDING = (0.5, 2.0)
"""How far beyond the leg a way is looked for, in lengths of the leg."""
NAMED_WALLS = 4
"""At most so many obstacles are named in a reason."""


@dataclass(frozen=True, eq=False)
class Route:
    """A way that keeps the margin throughout, wherever its ends allow."""

    points_m: FloatArray
    """[m, 3] corners in the world frame, from the start to the goal."""

    @property
    def length_m(self) -> float:
        return float(np.sum(np.linalg.norm(np.diff(self.points_m, axis=0), axis=1)))


@dataclass(frozen=True)
class NoRoute:
    """No way was found, which does not prove that there is none."""

    reason: str


def find_route(
    distance: Distance,
    start_m: npt.ArrayLike,
    goal_m: npt.ArrayLike,
    margin_m: float,
    *,
    bounds_m: tuple[FloatArray, FloatArray] | None = None,
    voxels: int = 60_000,
) -> Route | NoRoute:
    """A short way from start [3] to goal [3] that keeps a margin to everything in `distance`.

    bounds_m: corners of a box outside which nothing stands; ways round it are tried last.
    voxels: about how many are used at most; more find narrower ways, a few thousand are quick.
    """
    start, goal = np.array(start_m, dtype=np.float64), np.array(goal_m, dtype=np.float64)
    if segment_is_clear(distance, start, goal, margin_m, margin_m / SIGHT_STEPS):
        return Route(np.stack([start, goal]))
    finest = np.inf
    for low, high in _search_boxes(start, goal, margin_m, bounds_m):
        for count in (voxels // 8, voxels):
            width = max(float(np.cbrt(np.prod(high - low) / count)), margin_m / SIGHT_STEPS)
            finest = min(finest, width)
            field = VoxelField.sample(distance, low, high, start, width)
            corners = _shortest_path(field, distance, start, goal, margin_m)
            if corners is not None:
                return Route(_shorten(distance, corners, margin_m))
    return NoRoute(
        f"no way that stays {margin_m:g} m from every obstacle was found from {_at(start)} to "
        f"{_at(goal)} on voxels of {finest:.2g} m or more"
    )


def check_mission(
    points_m: npt.ArrayLike, obstacle_map: ObstacleMap, margin_m: float, reach_radius_m: float
) -> list[str]:
    """Why the map shows a mission to be impossible, a sentence each; empty if it does not.

    points_m: [n, 3] the start and then the waypoints in order, each reached within the radius.
    """
    points = np.array(points_m, dtype=np.float64)
    reasons: list[str] = []
    stops: list[Stop] = []
    for number, point in enumerate(points):
        name = f"waypoint {number}" if number else "the start"
        radius = reach_radius_m if number else 0.0
        visit = _visit(name, point, obstacle_map, margin_m, radius)
        if isinstance(visit, str):
            reasons.append(visit)
        else:
            stops.append(visit)
    last = 0
    for number in range(1, len(stops)):
        reason = _leg(stops[last], stops[number], obstacle_map, margin_m)
        if reason:
            reasons.append(reason)
        else:
            last = number
    return reasons


class Stop(NamedTuple):
    """A point of the mission that can be visited."""

    name: str
    point_m: FloatArray
    place_m: FloatArray
    """[3] a place that keeps the margin, within the reach radius of the point."""
    radius_m: float
    """How near the vehicle comes to the point at least."""


def _visit(
    name: str, point: FloatArray, obstacle_map: ObstacleMap, margin_m: float, radius_m: float
) -> Stop | str:
    """The stop at a point, or why it cannot be one."""
    distances, nearest = obstacle_map.nearest(point)
    if distances[0] >= margin_m:
        return Stop(name, point, point, radius_m)
    label = obstacle_map.label(int(nearest[0]))
    if distances[0] < 0.0:
        return f"{name} at {_at(point)} lies {-distances[0]:.2f} m inside {label}"
    ticks, step = np.linspace(-radius_m, radius_m, 13, retstep=True)
    offsets = np.stack(np.meshgrid(ticks, ticks, ticks), axis=-1).reshape(-1, 3)
    offsets = offsets[np.linalg.norm(offsets, axis=1) <= radius_m]
    around = obstacle_map.distance_m(point + offsets)
    free = offsets[around >= margin_m]
    if len(free):
        return Stop(name, point, point + free[np.argmin(np.linalg.norm(free, axis=1))], radius_m)
    if radius_m and np.max(around) + HALF_DIAGONAL * float(step) >= margin_m:
        return Stop(name, point, point + offsets[np.argmax(around)], radius_m)
    most_m = np.floor(100.0 * np.max(around, initial=0.0) + 1e-9) / 100.0
    near = f"{name} at {_at(point)} is {distances[0]:.2f} m from {label}; {margin_m:g} m is needed"
    if not radius_m:
        return near
    return f"{near}, and no place within {radius_m:g} m of it has that; {most_m:g} m would do"


def _leg(start: Stop, goal: Stop, obstacle_map: ObstacleMap, margin_m: float) -> str:
    """Why the map shows that there is no way from one stop to the next; empty if it does not."""
    distance = obstacle_map.distance_m
    bounds = (obstacle_map.tree.low_m[0], obstacle_map.tree.high_m[0]) if obstacle_map else None
    if isinstance(
        find_route(distance, start.place_m, goal.place_m, margin_m, bounds_m=bounds), Route
    ):
        return ""
    for inside, outside in ((goal, start), (start, goal)):
        proof = prove_infeasible(
            distance, inside.point_m, inside.radius_m, margin_m, outside.place_m
        )
        if proof is not None:
            return (
                f"{goal.name} at {_at(goal.point_m)} cannot be reached from {start.name}: "
                f"{inside.name} is walled in by {_walls(proof, obstacle_map)}; "
                f"no path stays more than {max(proof.clearance_m, 0.0):.2f} m from them, "
                f"{margin_m:g} m is needed"
            )
    return ""


def _walls(proof: InfeasibilityProof, obstacle_map: ObstacleMap) -> str:
    """The obstacles that close a space, those with most of its walls first."""
    _, nearest = obstacle_map.nearest(proof.walls_m)
    indices, counts = np.unique(nearest, return_counts=True)
    labels = [obstacle_map.label(int(n)) for n in indices[np.argsort(-counts, kind="stable")]]
    more = len(labels) - NAMED_WALLS
    return ", ".join(labels[:NAMED_WALLS]) + (f" and {more} more" if more > 0 else "")


def _search_boxes(
    start: FloatArray,
    goal: FloatArray,
    margin_m: float,
    bounds_m: tuple[FloatArray, FloatArray] | None,
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Corners of the boxes in which a way is looked for, smaller ones first."""
    low, high = np.minimum(start, goal), np.maximum(start, goal)
    length = max(float(np.linalg.norm(goal - start)), 8.0 * margin_m)
    for padding in PADDING:
        yield low - padding * length, high + padding * length
    if bounds_m is not None:
        beyond = 4.0 * margin_m + 0.1 * float(np.max(bounds_m[1] - bounds_m[0]))
        yield np.minimum(low, bounds_m[0]) - beyond, np.maximum(high, bounds_m[1]) + beyond


def _shortest_path(
    field: VoxelField, distance: Distance, start: FloatArray, goal: FloatArray, margin_m: float
) -> FloatArray | None:
    """Corners [m, 3] of the shortest way over safe steps between voxels; None without any."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import dijkstra

    ones, others, lengths = field.safe_steps(margin_m)
    first, last = field.distance_m.size, field.distance_m.size + 1
    for end, point in ((first, start), (last, goal)):
        reach = _within_reach(field, distance, point, margin_m)
        ones = np.concatenate([ones, np.full(len(reach), end)])
        others = np.concatenate([others, reach])
        gaps = np.linalg.norm(field.centers_m(reach) - point, axis=1)
        # A voxel on the very point still needs a step that is not nothing.
        lengths = np.concatenate([lengths, np.maximum(gaps, 1e-9 * margin_m)])
    graph = csr_matrix((lengths, (ones, others)), shape=(last + 1, last + 1))
    cost, previous = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
    if not np.isfinite(cost[last]):
        return None
    way = []
    node = int(previous[last])
    while node != first:
        way.append(node)
        node = int(previous[node])
    between = field.centers_m(np.array(way[::-1], dtype=np.int64))
    return np.concatenate([start[None], between, goal[None]])


def _within_reach(
    field: VoxelField, distance: Distance, point: FloatArray, margin_m: float
) -> IntArray:
    """Voxels with the margin to which a straight way from a point leads, nearer nothing on it.

    A point nearer to an obstacle than the margin may leave, as long as it gets no nearer.
    """
    step = margin_m / SIGHT_STEPS
    kept = min(margin_m, float(distance(point[None])[0]) - step)
    around = field.within(point, 2.0 * max(field.width_m, margin_m))
    around = around[field.distance_m.ravel()[around] >= margin_m]
    centers = field.centers_m(around)
    clear = [segment_is_clear(distance, point, center, kept, step) for center in centers]
    return around[np.array(clear, dtype=np.bool_)]


def _shorten(distance: Distance, corners: FloatArray, margin_m: float) -> FloatArray:
    """The corners that remain when each is left out that can be seen past."""
    kept = [0]
    while kept[-1] < len(corners) - 1:
        here = kept[-1]
        ahead = len(corners) - 1
        while ahead > here + 1 and not segment_is_clear(
            distance, corners[here], corners[ahead], margin_m, margin_m / SIGHT_STEPS
        ):
            ahead -= 1
        kept.append(ahead)
    return corners[kept]


def _at(point: Sequence[float] | FloatArray) -> str:
    return "(" + ", ".join(f"{value:g}" for value in np.round(point, 2)) + ")"
