"""Made-up worlds to fly through, each from a seed: families of them by name.

Lengths suit the paper's scale: a turning radius of 3.8 m, a margin of 0.6 m, 10 m of sight.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.live.mission import Mission
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.mazes import maze_walls

MadeWorld = tuple[ObstacleMap, Mission]
MakeWorld = Callable[[int], MadeWorld]
"""From a seed."""

BALL_BOX_M = (50.0, 30.0, 20.0)
"""Extent of the ball worlds: ahead of the start, and centred on the way across and in height."""
BALL_COUNTS = (30, 240)
BALL_RADII_M = (0.8, 2.5)
BALL_LEG_M = 60.0
BALL_DENSITIES = (30, 60, 100, 140, 190, 240)
"""Balls in the box of the six families; radii as everywhere, so 2 to 18 % of its volume."""
TALL_M = 200.0
"""Height of what shall not be flown over or under."""
STREET_HEIGHT_M = 8.0
ROOM_M = 5.0
"""Around start and waypoints, where nothing is put."""


def ball_world(seed: int, balls: int | None = None) -> MadeWorld:
    """Balls at random in a box, and a leg right through it.

    balls: their number; drawn from `BALL_COUNTS` if not given. The leg starts and ends five metres
    outside the box.
    """
    rng = np.random.default_rng([seed, 20])
    count = int(rng.integers(BALL_COUNTS[0], BALL_COUNTS[1] + 1)) if balls is None else balls
    length, width, height = BALL_BOX_M
    centers = rng.uniform(
        [0.0, -0.5 * width, -0.5 * height], [length, 0.5 * width, 0.5 * height], (count, 3)
    )
    radii = rng.uniform(*BALL_RADII_M, count)
    obstacles = [
        Obstacle.ball(center, float(radius), f"ball {number}")
        for number, (center, radius) in enumerate(zip(centers, radii, strict=True))
    ]
    spare = 0.5 * (BALL_LEG_M - length)
    name = f"ball-world-{seed}" if balls is None else f"balls-{balls}-{seed}"
    return ObstacleMap(obstacles), _leg(name, (-spare, 0.0, 0.0), (length + spare, 0.0, 0.0))


def forest(seed: int) -> MadeWorld:
    """Trunks that cannot be flown over, 2.5 m apart or more, in front of a leg of 60 m."""
    rng = np.random.default_rng([seed, 21])
    mission = _leg(f"forest-{seed}", (-5.0, 0.0, 0.0), (55.0, 0.0, 0.0))
    trunks: list[Obstacle] = []
    places = np.zeros((0, 3))
    for number in range(400):
        x, y = rng.uniform([0.0, -18.0], [50.0, 18.0])
        radius = float(rng.uniform(0.2, 0.7))
        place = np.array([x, y, radius])
        gaps = np.linalg.norm(places[:, :2] - place[:2], axis=1) - places[:, 2] - radius
        if np.all(gaps >= 2.5) and _roomy(mission, place[:2], radius):
            places = np.concatenate([places, place[None]])
            trunks.append(_upright(x, y, radius, f"trunk {number}"))
    return ObstacleMap(trunks), mission


def street(seed: int) -> MadeWorld:
    """Houses in blocks with streets of 7 to 10 m between, masts in the streets, two corners."""
    rng = np.random.default_rng([seed, 22])
    houses, streets = _blocks(rng), []
    (x_first, _, x_last), (_, y_middle, _) = (row[1] for row in houses)
    far = float(houses[1][0][-1].sum())
    corners = [
        np.array([x_first, -6.0]),
        np.array([x_first, y_middle]),
        np.array([x_last, y_middle]),
        np.array([x_last, far + 6.0]),
    ]
    for i, (x, length) in enumerate(houses[0][0]):
        for j, (y, width) in enumerate(houses[1][0]):
            size = (float(length), float(width), float(rng.uniform(16.0, 40.0)))
            center = (x + 0.5 * length, y + 0.5 * width, 0.5 * size[2])
            streets.append(Obstacle.cuboid(center, size, name=f"house {i} {j}"))
    for start, end in pairwise(corners):
        streets += _masts(rng, start, end, len(streets))
    streets.append(Obstacle.cuboid((40.0, 40.0, -1.0), (200.0, 200.0, 2.0), name="ground"))
    places = np.column_stack([corners, np.full(4, STREET_HEIGHT_M)])
    start_state = State(places[0], np.array([0.0, 0.0, 0.5 * np.pi]))
    return ObstacleMap(streets), Mission(f"street-{seed}", start_state, places[1:])


def _blocks(rng: np.random.Generator) -> list[tuple[FloatArray, FloatArray]]:
    """Per axis: starts and lengths of four houses [4, 2], and middles of the streets between."""
    axes = []
    for _ in range(2):
        lengths, gaps = rng.uniform(10.0, 14.0, 4), rng.uniform(7.0, 10.0, 3)
        starts = np.concatenate([[0.0], np.cumsum(lengths[:-1] + gaps)])
        middles = starts[1:] - 0.5 * gaps
        axes.append((np.column_stack([starts, lengths]), middles))
    return axes


def _masts(
    rng: np.random.Generator, start: FloatArray, end: FloatArray, number: int
) -> list[Obstacle]:
    """Masts within 2 m of the middle of a street, 8 to 12 m apart and well off its corners."""
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    masts: list[Obstacle] = []
    at = 9.0
    while at < length - 9.0:
        x, y = start + at * along + rng.uniform(-2.0, 2.0) * np.array([-along[1], along[0]])
        radius = float(rng.uniform(0.1, 0.4))
        masts.append(_upright(x, y, radius, f"mast {number + len(masts)}", height_m=30.0))
        at += float(rng.uniform(8.0, 12.0))
    return masts


def wires(seed: int) -> MadeWorld:
    """Lines of 2 to 6 cm between poles across the way, at the heights flown."""
    rng = np.random.default_rng([seed, 23])
    obstacles = []
    for row, x in enumerate(np.arange(10.0, 50.0, 10.0) + rng.uniform(-2.0, 2.0, 4)):
        turn = float(rng.uniform(-0.4, 0.4))
        ends = [np.array([x - 15.0 * turn * s, 15.0 * s]) for s in (-1.0, 1.0)]
        for end in ends:
            obstacles.append(_upright(end[0], end[1], 0.25, f"pole {row}", height_m=24.0))
        for number, z in enumerate(rng.uniform(-3.0, 3.0, 3)):
            a, b = (np.array([*end, z]) for end in ends)
            radius = float(rng.uniform(0.01, 0.03))
            obstacles.append(Obstacle.line_between(a, b, radius, f"wire {row} {number}"))
    return ObstacleMap(obstacles), _leg(f"wires-{seed}", (0.0, 0.0, 0.0), (60.0, 0.0, 0.0))


def walls(seed: int) -> MadeWorld:
    """Three walls across the way, each with one gap of 4 to 6 m somewhere else."""
    rng = np.random.default_rng([seed, 24])
    parts = []
    for number, x in enumerate((15.0, 33.0, 51.0)):
        middle, gap = float(rng.uniform(-10.0, 10.0)), float(rng.uniform(4.0, 6.0))
        for side in (-1.0, 1.0):
            inner, outer = middle + side * 0.5 * gap, side * 30.0
            center = (x, 0.5 * (inner + outer), 0.0)
            size = (0.5, abs(outer - inner), TALL_M)
            parts.append(Obstacle.cuboid(center, size, name=f"wall {number}"))
    return ObstacleMap(parts), _leg(f"walls-{seed}", (0.0, 0.0, 0.0), (65.0, 0.0, 0.0))


def pockets(seed: int) -> MadeWorld:
    """Dead ends open towards the vehicle: a back wall and two sides, twice on the way."""
    rng = np.random.default_rng([seed, 25])
    parts = []
    for number, x in enumerate((18.0, 45.0)):
        depth, width = float(rng.uniform(5.0, 9.0)), float(rng.uniform(9.0, 13.0))
        middle = float(rng.uniform(-3.0, 3.0))
        parts.append(Obstacle.cuboid((x, middle, 0.0), (0.5, width, TALL_M), name=f"back {number}"))
        for side in (-0.5, 0.5):
            center = (x - 0.5 * depth, middle + side * width, 0.0)
            parts.append(Obstacle.cuboid(center, (depth, 0.5, TALL_M), name=f"side {number}"))
    return ObstacleMap(parts), _leg(f"pockets-{seed}", (0.0, 0.0, 0.0), (65.0, 0.0, 0.0))


def maze(seed: int) -> MadeWorld:
    """A maze of four by three rooms of 14 m with one way through, walls too tall to fly over."""
    room, across, along = 14.0, 4, 3
    parts = maze_walls(np.random.default_rng([seed, 26]), across, along)
    obstacles = [
        Obstacle.cuboid(
            (*(room * 0.5 * (a + b)), 0.0),
            (*(room * np.abs(b - a) + 0.5), TALL_M),
            name=f"wall {number}",
        )
        for number, (a, b) in enumerate(parts)
    ]
    start, end = 0.5 * room, room * (across - 0.5)
    far = room * (along - 0.5)
    return ObstacleMap(obstacles), _leg(f"maze-{seed}", (start, start, 0.0), (end, far, 0.0))


FAMILIES: Mapping[str, MakeWorld] = MappingProxyType(
    {
        **{f"balls-{count}": partial(ball_world, balls=count) for count in BALL_DENSITIES},
        "forest": forest,
        "street": street,
        "wires": wires,
        "walls": walls,
        "pockets": pockets,
        "maze": maze,
    }
)
"""Worlds by family name."""


def made_world(family: str, seed: int) -> MadeWorld:
    """A world of a family; raises ClearwayError listing the families there are."""
    try:
        return FAMILIES[family](seed)
    except KeyError:
        raise ClearwayError(f"world {family!r}: families are {', '.join(FAMILIES)}") from None


def _leg(name: str, start: Sequence[float], end: Sequence[float]) -> Mission:
    return Mission(name, State(np.array(start)), np.array([end]))


def _upright(x: float, y: float, radius: float, name: str, height_m: float = TALL_M) -> Obstacle:
    """A pole around height 0."""
    low, high = np.array([x, y, -0.5 * height_m]), np.array([x, y, 0.5 * height_m])
    return Obstacle.line_between(low, high, radius, name)


def _roomy(mission: Mission, place: FloatArray, radius: float) -> bool:
    """Whether something at a place [2] leaves room around start and waypoints."""
    corners = np.concatenate([mission.start.position_m[None], mission.waypoints_m])[:, :2]
    return bool(np.all(np.linalg.norm(corners - place, axis=1) - radius >= ROOM_M))
