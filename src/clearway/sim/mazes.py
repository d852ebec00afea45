"""Walls of a maze: every room can be reached, by one way only."""

from __future__ import annotations

import numpy as np

from clearway.base.frames import FloatArray

Wall = tuple[FloatArray, FloatArray]
"""Ends [2] each, in rooms."""


def maze_walls(rng: np.random.Generator, across: int, along: int) -> list[Wall]:
    """The outer walls, and those between rooms that a random walk back and forth leaves standing.

    Rooms are unit squares from (0, 0) to (across, along).
    """
    doors = _doors(rng, across, along)
    corners = np.array([[0, 0], [across, 0], [across, along], [0, along]], dtype=np.float64)
    walls = [(corners[n], corners[(n + 1) % 4]) for n in range(4)]
    for x in range(across):
        for y in range(along):
            for dx, dy in ((1, 0), (0, 1)):
                beside = (x + dx, y + dy)
                inside = beside[0] < across and beside[1] < along
                if inside and frozenset(((x, y), beside)) not in doors:
                    start = np.array([x + dx, y + dy], dtype=np.float64)
                    walls.append((start, np.array([x + 1.0, y + 1.0])))
    return walls


def _doors(rng: np.random.Generator, across: int, along: int) -> set[frozenset[tuple[int, int]]]:
    """Pairs of rooms with a door between them: a random spanning tree, depth first."""
    doors: set[frozenset[tuple[int, int]]] = set()
    path, seen = [(0, 0)], {(0, 0)}
    while path:
        x, y = path[-1]
        beside = [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)]
        fresh = [
            room
            for room in beside
            if 0 <= room[0] < across and 0 <= room[1] < along and room not in seen
        ]
        if not fresh:
            path.pop()
            continue
        room = fresh[int(rng.integers(len(fresh)))]
        doors.add(frozenset(((x, y), room)))
        seen.add(room)
        path.append(room)
    return doors
