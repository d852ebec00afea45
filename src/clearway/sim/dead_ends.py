"""Made-up worlds that end: pockets, wedges, caves, streets, tubes, and rooms to find out of.

Each from a seed and from spans that a width and a depth are drawn from. A turn takes 7.6 m, and 8.8
with its margins: what is narrower cannot be turned round in at one height. The vehicle starts with
room about it, on the way to a goal beyond. Walls are too tall to fly over.
"""

from __future__ import annotations

import numpy as np

from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim.world_parts import (
    ROOM_M,
    TALL_M,
    WALL_M,
    MadeWorld,
    Span,
    draw_between,
    leg,
    place_parts,
    wall,
)

WIDTHS_M: Span = (4.0, 15.0)
DEPTHS_M: Span = (3.0, 25.0)
WEDGE_WIDTHS_M: Span = (8.0, 30.0)
WEDGE_DEPTHS_M: Span = (6.0, 25.0)
STREET_WIDTHS_M: Span = (5.0, 15.0)
STREET_DEPTHS_M: Span = (18.0, 45.0)
U_WIDTHS_M: Span = (9.5, 15.0)
U_DEPTHS_M: Span = (14.0, 25.0)
DOOR_WIDTHS_M: Span = (4.0, 12.0)
ROOM_SIDES_M: Span = (16.0, 26.0)
MOUTHS_M: Span = (11.0, 16.0)
"""From the start to where a dead end begins."""
AHEAD_M = 11.0
"""Free ahead of a start inside, at least."""
BEYOND_M = 18.0
"""From its end to the goal."""
TURNED_RAD = np.radians(15.0)
"""A dead end is turned by as much at most from the way."""
STREET_HEIGHT_M = 8.0
PLANKS = 12
"""That a tube is made of."""


def dead_end(seed: int, width_m: Span = WIDTHS_M, depth_m: Span = DEPTHS_M) -> MadeWorld:
    """A dead end on the way, open towards the vehicle: two sides and a back, all tall."""
    rng = np.random.default_rng([seed, 40])
    width, depth = draw_between(rng, width_m), draw_between(rng, depth_m)
    side = 0.5 * (width + WALL_M)
    parts = [
        wall((0.0, -side), (depth, -side), "side"),
        wall((0.0, side), (depth, side), "side"),
        wall((depth + 0.5 * WALL_M, -side), (depth + 0.5 * WALL_M, side), "back"),
    ]
    return _on_the_way(f"dead-end-{seed}", rng, parts, width, depth)


def wedge(seed: int, width_m: Span = WEDGE_WIDTHS_M, depth_m: Span = WEDGE_DEPTHS_M) -> MadeWorld:
    """Two tall walls that close to a corner ahead; the width is that of its mouth."""
    rng = np.random.default_rng([seed, 41])
    width, depth = draw_between(rng, width_m), draw_between(rng, depth_m)
    parts = [wall((0.0, side * width), (depth, 0.0), "side") for side in (-0.5, 0.5)]
    return _on_the_way(f"wedge-{seed}", rng, parts, width, depth)


def cave(seed: int, width_m: Span = WIDTHS_M, depth_m: Span = DEPTHS_M) -> MadeWorld:
    """A box that is open towards the vehicle alone; width and height are drawn from one span."""
    rng = np.random.default_rng([seed, 42])
    width, height, depth = (
        draw_between(rng, width_m),
        draw_between(rng, width_m),
        draw_between(rng, depth_m),
    )
    y, z = 0.5 * (width + WALL_M), 0.5 * (height + WALL_M)
    middle, outer = 0.5 * depth, width + 2.0 * WALL_M
    parts = [
        *(
            Obstacle.cuboid((middle, side * y, 0.0), (depth, WALL_M, height), name="side")
            for side in (-1.0, 1.0)
        ),
        *(
            Obstacle.cuboid((middle, 0.0, side * z), (depth, outer, WALL_M), name="roof or floor")
            for side in (-1.0, 1.0)
        ),
        Obstacle.cuboid(
            (depth + 0.5 * WALL_M, 0.0, 0.0),
            (WALL_M, outer, height + 2.0 * WALL_M),
            name="back",
        ),
    ]
    return _on_the_way(f"cave-{seed}", rng, parts, width, depth, tilted=True)


def make_closed_street(
    seed: int, width_m: Span = STREET_WIDTHS_M, depth_m: Span = STREET_DEPTHS_M
) -> MadeWorld:
    """A street between two rows of tall houses, with a house across its end."""
    rng = np.random.default_rng([seed, 43])
    width, depth = draw_between(rng, width_m), draw_between(rng, depth_m)
    parts = []
    for side in (-1.0, 1.0):
        at = 0.0
        while at < depth:
            length = min(float(rng.uniform(7.0, 14.0)), depth - at)
            deep, back = float(rng.uniform(5.0, 9.0)), float(rng.uniform(0.0, 0.6))
            center = (at + 0.5 * length, side * (0.5 * width + back + 0.5 * deep), 0.0)
            parts.append(Obstacle.cuboid(center, (length, deep, TALL_M), name="house"))
            at += length + float(rng.uniform(0.0, 0.8))
    across = (6.0, width + 10.0, TALL_M)
    parts.append(Obstacle.cuboid((depth + 3.0, 0.0, 0.0), across, name="end"))
    ground_m = -STREET_HEIGHT_M
    made = _on_the_way(f"closed-street-{seed}", rng, parts, width, depth + 6.0)
    ground = Obstacle.cuboid((40.0, 0.0, ground_m - 1.0), (300.0, 300.0, 2.0), name="ground")
    return made._replace(world=ObstacleMap([*made.world.obstacles, ground]))


def make_closed_tube(seed: int, width_m: Span = WIDTHS_M, depth_m: Span = DEPTHS_M) -> MadeWorld:
    """A tube of planks, open towards the vehicle and closed at its end, level or tilted."""
    rng = np.random.default_rng([seed, 44])
    width, depth = draw_between(rng, width_m), draw_between(rng, depth_m)
    middle = 0.5 * (width + WALL_M)
    plank = 2.0 * (middle + 0.5 * WALL_M) * float(np.tan(np.pi / PLANKS))
    parts = []
    for roll in 2.0 * np.pi * np.arange(PLANKS) / PLANKS:
        center = (0.5 * depth, -middle * np.sin(roll), middle * np.cos(roll))
        size = (depth, plank, WALL_M)
        parts.append(
            Obstacle.cuboid(
                center, size, radius_m=0.0, orientation_rad=(float(roll), 0.0, 0.0), name="plank"
            )
        )
    outer = width + 2.0 * WALL_M
    end = Obstacle.cuboid((depth + 0.5 * WALL_M, 0.0, 0.0), (WALL_M, outer, outer), name="end")
    return _on_the_way(f"closed-tube-{seed}", rng, [*parts, end], width, depth, tilted=True)


def u_shape(seed: int, width_m: Span = U_WIDTHS_M, depth_m: Span = U_DEPTHS_M) -> MadeWorld:
    """A dead end that the flight starts in, with the open side behind it."""
    rng = np.random.default_rng([seed, 45])
    width, depth = draw_between(rng, width_m), draw_between(rng, depth_m)
    side = 0.5 * (width + WALL_M)
    parts = [
        wall((-depth, -side), (0.0, -side), "side"),
        wall((-depth, side), (0.0, side), "side"),
        wall((0.5 * WALL_M, -side), (0.5 * WALL_M, side), "back"),
    ]
    spare = max(0.5 * width - ROOM_M, 0.0)
    ahead = float(rng.uniform(AHEAD_M, max(depth - 2.0, AHEAD_M)))
    back = (ahead, float(rng.uniform(-spare, spare)), 0.0)
    turned = float(rng.uniform(-TURNED_RAD, TURNED_RAD))
    # About the start, which so keeps its room.
    parts = place_parts(place_parts(parts, back, np.zeros(3)), np.zeros(3), (0.0, 0.0, turned))
    far = ahead + 0.5 * width + BEYOND_M
    return MadeWorld(ObstacleMap(parts), leg(f"u-shape-{seed}", (0.0, 0.0, 0.0), (far, 0.0, 0.0)))


def room(seed: int, width_m: Span = DOOR_WIDTHS_M, depth_m: Span = ROOM_SIDES_M) -> MadeWorld:
    """A room with one door, on any side, that the flight starts in; the width is the door's.

    The depth is that of the room, drawn for both of its sides.
    """
    rng = np.random.default_rng([seed, 46])
    door, half = draw_between(rng, width_m), 0.5 * rng.uniform(*depth_m, 2)
    corners = np.array([[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]) * (half + 0.5 * WALL_M)
    with_door = int(rng.integers(4))
    parts = []
    for number in range(4):
        a, b = corners[number], corners[(number + 1) % 4]
        if number != with_door:
            parts.append(wall(a, b, "wall"))
            continue
        length = float(np.linalg.norm(b - a))
        door = min(door, length - 2.0)
        jamb = float(rng.uniform(1.0, length - door - 1.0)) if length > door + 2.0 else 1.0
        along = (b - a) / length
        parts += [wall(a, a + jamb * along, "wall"), wall(a + (jamb + door) * along, b, "wall")]
    # From the start, so far to the wall ahead that the first scan shows a way to turn.
    ahead = float(rng.uniform(AHEAD_M, max(2.0 * half[0] - ROOM_M, AHEAD_M)))
    spare = max(float(half[1]) - 7.0, 0.0)
    center = (ahead - float(half[0]), float(rng.uniform(-spare, spare)), 0.0)
    turned = float(rng.uniform(-TURNED_RAD, TURNED_RAD))
    parts = place_parts(place_parts(parts, center, np.zeros(3)), np.zeros(3), (0.0, 0.0, turned))
    far = 2.0 * float(half.max()) + BEYOND_M
    return MadeWorld(ObstacleMap(parts), leg(f"room-{seed}", (0.0, 0.0, 0.0), (far, 0.0, 0.0)))


def _on_the_way(
    name: str,
    rng: np.random.Generator,
    parts: list[Obstacle],
    width: float,
    depth: float,
    *,
    tilted: bool = False,
) -> MadeWorld:
    """A dead end, its mouth's middle at 0 and its depth along x, in the way of a straight leg."""
    mouth = np.array([draw_between(rng, MOUTHS_M), float(rng.uniform(-0.25, 0.25)) * width, 0.0])
    pitch = float(rng.uniform(-TURNED_RAD, TURNED_RAD)) if tilted else 0.0
    if tilted:
        mouth[2] = float(rng.uniform(-0.25, 0.25)) * width
    # A wide mouth that is turned comes nearer on one side.
    turned = float(rng.uniform(-TURNED_RAD, TURNED_RAD))
    mouth[0] += 0.5 * width * abs(float(np.sin(turned)))
    far = float(mouth[0]) + depth + 0.25 * width + BEYOND_M
    world = ObstacleMap(place_parts(parts, mouth, (0.0, pitch, turned)))
    return MadeWorld(world, leg(name, (0.0, 0.0, 0.0), (far, 0.0, 0.0)))
