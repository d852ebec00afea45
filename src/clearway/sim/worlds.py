"""Made-up worlds to fly through, each from a seed: families of them by name.

Lengths suit the paper's scale: a turning radius of 3.8 m, a margin of 0.6 m, 10 m of sight.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.base.suggest import did_you_mean
from clearway.live.mission import Mission
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.clutter import make_mixed, nets
from clearway.sim.column_fields import COLUMN_WORLDS
from clearway.sim.dead_ends import (
    cave,
    dead_end,
    make_closed_street,
    make_closed_tube,
    room,
    u_shape,
    wedge,
)
from clearway.sim.mazes import maze_walls
from clearway.sim.warehouse import warehouse
from clearway.sim.world_parts import (
    TALL_M,
    MadeWorld,
    MakeWorld,
    Span,
    draw_between,
    leg,
    roomy,
    upright,
)

BALL_BOX_M = (50.0, 30.0, 20.0)
"""Extent of the ball worlds: ahead of the start, and centred on the way across and in height."""
BALL_COUNTS = (30, 240)
BALL_RADII_M = (0.8, 2.5)
BALL_LEG_M = 60.0
BALL_DENSITIES = (30, 60, 100, 140, 190, 240)
"""Balls in the box of the six families; radii as everywhere, so 2 to 18 % of its volume."""
STREET_HEIGHT_M = 8.0
WALL_GAPS_M: Span = (4.0, 6.0)
WALLS = 3
GAPS_ASIDE_M = 10.0
POCKET_DEPTHS_M: Span = (5.0, 9.0)
POCKET_WIDTHS_M: Span = (9.0, 13.0)
MAZE_ROOMS_M: Span = (14.0, 14.0)


def ball_world(
    seed: int, balls: int | tuple[int, int] | None = None, room_m: float = 0.0
) -> MadeWorld:
    """Balls at random in a box, and a leg right through it.

    balls: their number, or the least and the greatest; drawn from `BALL_COUNTS` if not given.
    room_m: balls that are nearer to start or waypoint are left out. The leg starts and ends five
    metres outside the box.
    """
    rng = np.random.default_rng([seed, 20])
    count = balls if isinstance(balls, int) else _number(rng, balls or BALL_COUNTS)
    length, width, height = BALL_BOX_M
    centers = rng.uniform(
        [0.0, -0.5 * width, -0.5 * height], [length, 0.5 * width, 0.5 * height], (count, 3)
    )
    radii = rng.uniform(*BALL_RADII_M, count)
    spare = 0.5 * (BALL_LEG_M - length)
    name = f"balls-{balls}-{seed}" if isinstance(balls, int) else f"ball-world-{seed}"
    mission = leg(name, (-spare, 0.0, 0.0), (length + spare, 0.0, 0.0))
    obstacles = [
        Obstacle.ball(center, float(radius), name=f"ball {number}")
        for number, (center, radius) in enumerate(zip(centers, radii, strict=True))
        if roomy(mission, center, float(radius), room_m)
    ]
    return MadeWorld(ObstacleMap(obstacles), mission)


def _number(rng: np.random.Generator, between: tuple[int, int]) -> int:
    return int(rng.integers(between[0], between[1] + 1))


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
    mission = Mission(f"street-{seed}", start_state, waypoints_m=places[1:])
    return MadeWorld(ObstacleMap(streets), mission)


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
        masts.append(upright(x, y, radius, f"mast {number + len(masts)}", height_m=30.0))
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
            obstacles.append(upright(end[0], end[1], 0.25, f"pole {row}", height_m=24.0))
        for number, z in enumerate(rng.uniform(-3.0, 3.0, 3)):
            a, b = (np.array([*end, z]) for end in ends)
            radius = float(rng.uniform(0.01, 0.03))
            obstacles.append(
                Obstacle.line_between(a, b, radius_m=radius, name=f"wire {row} {number}")
            )
    return MadeWorld(
        ObstacleMap(obstacles), leg(f"wires-{seed}", (0.0, 0.0, 0.0), (60.0, 0.0, 0.0))
    )


def walls(
    seed: int, gap_m: Span = WALL_GAPS_M, walls: int = WALLS, aside_m: float = GAPS_ASIDE_M
) -> MadeWorld:
    """Walls across the way, 18 m apart, each with one gap of 4 to 6 m somewhere else.

    aside_m: how far gaps lie from the straight way, at most.
    """
    rng = np.random.default_rng([seed, 24])
    parts = []
    for number in range(walls):
        x = 15.0 + 18.0 * number
        middle, gap = float(rng.uniform(-aside_m, aside_m)), draw_between(rng, gap_m)
        for side in (-1.0, 1.0):
            inner, outer = middle + side * 0.5 * gap, side * 30.0
            center = (x, 0.5 * (inner + outer), 0.0)
            size = (0.5, abs(outer - inner), TALL_M)
            parts.append(Obstacle.cuboid(center, size, name=f"wall {number}"))
    far = 18.0 * walls + 11.0
    return MadeWorld(ObstacleMap(parts), leg(f"walls-{seed}", (0.0, 0.0, 0.0), (far, 0.0, 0.0)))


def pockets(
    seed: int, depth_m: Span = POCKET_DEPTHS_M, width_m: Span = POCKET_WIDTHS_M
) -> MadeWorld:
    """Dead ends open towards the vehicle: a back wall and two sides, twice on the way.

    The farther apart, the deeper they may be.
    """
    rng = np.random.default_rng([seed, 25])
    parts = []
    deepest = depth_m[1]
    for number in range(2):
        x = 9.0 + deepest + (18.0 + deepest) * number
        depth, width = draw_between(rng, depth_m), draw_between(rng, width_m)
        middle = float(rng.uniform(-3.0, 3.0))
        parts.append(Obstacle.cuboid((x, middle, 0.0), (0.5, width, TALL_M), name=f"back {number}"))
        for side in (-0.5, 0.5):
            center = (x - 0.5 * depth, middle + side * width, 0.0)
            parts.append(Obstacle.cuboid(center, (depth, 0.5, TALL_M), name=f"side {number}"))
    far = 2.0 * deepest + 47.0
    return MadeWorld(ObstacleMap(parts), leg(f"pockets-{seed}", (0.0, 0.0, 0.0), (far, 0.0, 0.0)))


def maze(seed: int, room_m: Span = MAZE_ROOMS_M, *, faces_door: bool = False) -> MadeWorld:
    """A maze of four by three rooms of 14 m with one way through, walls too tall to fly over.

    faces_door: whether the vehicle starts with the open side of its room ahead, else along x.
    """
    rng, across, along = np.random.default_rng([seed, 26]), 4, 3
    parts = maze_walls(rng, across, along)
    side = draw_between(rng, room_m)
    obstacles = [
        Obstacle.cuboid(
            (*(side * 0.5 * (a + b)), 0.0),
            (*(side * np.abs(b - a) + 0.5), TALL_M),
            name=f"wall {number}",
        )
        for number, (a, b) in enumerate(parts)
    ]
    start, end = 0.5 * side, side * (across - 0.5)
    far = side * (along - 0.5)
    shut = any(np.array_equal(a, [1.0, 0.0]) and np.array_equal(b, [1.0, 1.0]) for a, b in parts)
    yaw = 0.5 * np.pi if faces_door and shut else 0.0
    mission = leg(f"maze-{seed}", (start, start, 0.0), (end, far, 0.0), (0.0, 0.0, yaw))
    return MadeWorld(ObstacleMap(obstacles), mission)


WORLD_FAMILIES: Mapping[str, MakeWorld] = MappingProxyType(
    {
        **{f"balls-{count}": partial(ball_world, balls=count) for count in BALL_DENSITIES},
        **COLUMN_WORLDS,
        "street": street,
        "warehouse": warehouse,
        "wires": wires,
        "walls": walls,
        "pockets": pockets,
        "maze": maze,
        "dead-end": dead_end,
        "wedge": wedge,
        "cave": cave,
        "closed-street": make_closed_street,
        "closed-tube": make_closed_tube,
        "u-shape": u_shape,
        "room": room,
        "clutter": make_mixed,
        "nets": nets,
    }
)
"""Worlds by family name; `make_mixed` is a mission."""


def make_world(family: str, seed: int) -> MadeWorld:
    """A world of a family; raises ClearwayError listing the families there are."""
    try:
        return WORLD_FAMILIES[family](seed)
    except KeyError:
        near = did_you_mean(family, WORLD_FAMILIES)
        raise ClearwayError(
            f"world {family!r}{near}: families are {', '.join(WORLD_FAMILIES)}"
        ) from None
