"""No goal is called closed to which the test's own search finds a way with the margin."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.ndimage import generate_binary_structure, label
from scipy.spatial import KDTree

from clearway.avoidance.rate.route_field import Pace
from clearway.base.arrays import FloatArray
from clearway.live.routing.route_planner import RoutePlanner, RouteSettings, route_cells_for

MARGIN_M, WIDTH_M = 0.4, 0.2
STEP_M = 0.1
"""Of the test's own search: whose steps from middle to middle keep the margin all along."""
PACE = Pace(10.0, 8.0, 0.8, 4.0, 2.0)


class Made(NamedTuple):
    """A closed hall with something in it, points [n, 3], and two places [3] in it."""

    points_m: FloatArray
    start_m: FloatArray
    goal_m: FloatArray
    layered: bool


def made_hall(seed: int, *, layered: bool) -> Made:
    """Walls with a gap, columns or boxes in a hall; layered: walls with a window, and a roof."""
    rng = np.random.default_rng(seed)
    long, wide = rng.uniform(10.0, 24.0), rng.uniform(5.0, 10.0)
    top = 3.0 if layered else 0.0
    spacing = 0.2 if layered else 0.1
    aside = np.arange(-0.5 * wide, 0.5 * wide + 0.05, spacing)
    along = np.arange(-3.0, long + 3.05, spacing)
    up = np.arange(0.0, top + 0.05, spacing)
    parts = [_sheet(along, [side], up) for side in (-0.5 * wide, 0.5 * wide)]
    parts += [_sheet([x], aside, up) for x in (-3.0, long + 3.0)]
    if layered:
        parts += [_sheet(along, aside, [height]) for height in (0.0, top)]
    kind = "walls" if layered else rng.choice(["walls", "columns", "boxes"])
    if kind == "walls":
        for x in rng.uniform(2.0, long - 2.0, rng.integers(1, 4)):
            gap = rng.uniform(0.5, 1.2) if layered else rng.uniform(0.7, 1.6)
            parts.append(_wall(x, aside, up, gap, rng))
    elif kind == "columns":
        count = int(rng.uniform(0.15, 0.5) * long * wide)
        middle = rng.uniform([1.5, -0.5 * wide], [long - 1.5, 0.5 * wide], (count, 2))
        turn = np.arange(0.0, 2.0 * np.pi, 0.4)
        rim = middle[:, None] + 0.2 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        parts.append(np.append(rim.reshape(-1, 2), np.zeros((rim.size // 2, 1)), axis=1))
    else:
        for _ in range(int(rng.uniform(0.05, 0.16) * long * wide)):
            parts.append(_box(rng, [rng.uniform(3.0, long - 3.0), rng.uniform(-wide, wide) / 2]))
    height = rng.uniform(1.0, 2.0) if layered else 0.0
    ends = [
        [x, rng.uniform(1.0 - 0.5 * wide, 0.5 * wide - 1.0), height] for x in (-1.5, long + 1.5)
    ]
    return Made(np.concatenate(parts), *np.array(ends), layered)


def _sheet(x: ArrayLike, y: ArrayLike, z: ArrayLike) -> FloatArray:
    return np.stack([each.ravel() for each in np.meshgrid(x, y, z)], axis=1)


def _wall(
    x: float, aside: FloatArray, up: FloatArray, gap_m: float, rng: np.random.Generator
) -> FloatArray:
    """Aslant, with a gap, or with a window in it."""
    wall = _sheet([0.0], aside, up)
    middle = rng.uniform(aside[0] + gap_m, aside[-1] - gap_m)
    opened = np.abs(wall[:, 1] - middle) < 0.5 * gap_m
    if len(up) > 1:
        opened &= np.abs(wall[:, 2] - rng.uniform(0.5 * gap_m, up[-1] - 0.5 * gap_m)) < 0.5 * gap_m
    wall = wall[~opened]
    wall[:, 0] = x + rng.uniform(-0.6, 0.6) * wall[:, 1]
    return wall


def _box(rng: np.random.Generator, middle: list[float]) -> FloatArray:
    half, turn = rng.uniform(0.3, 1.2, 2), rng.uniform(0.0, np.pi)
    edge, sides = np.arange(-1.0, 1.01, 0.08), (-1.0, 1.0)
    rim = np.concatenate([_sheet(sides, edge, [0.0]), _sheet(edge, sides, [0.0])])
    rim[:, :2] *= half
    cos, sin = np.cos(turn), np.sin(turn)
    return rim @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]) + [*middle, 0.0]


def has_way(hall: Made) -> bool:
    """The test's own search, over voxels whose middles keep the margin and half a step more."""
    diagonal = np.sqrt(3.0 if hall.layered else 2.0)
    low, high = hall.points_m.min(axis=0), hall.points_m.max(axis=0)
    ticks = [np.arange(a, b + STEP_M, STEP_M) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1)
    needs_m = MARGIN_M + 0.5 * diagonal * STEP_M
    near_m = KDTree(hall.points_m).query(grid, distance_upper_bound=needs_m)[0]
    part, _ = label(near_m >= needs_m, generate_binary_structure(3, 3))
    ends = [part[tuple(np.round((end - low) / STEP_M).astype(int))] for end in hall[1:3]]
    return bool(ends[0] > 0 and ends[0] == ends[1])


def is_called_closed(hall: Made, rng: np.random.Generator) -> bool:
    """Whether the route planner knows no way at its closest look, wherever the hall stands."""
    turn, moved = rng.uniform(0.0, 2.0 * np.pi), [*rng.uniform(-50.0, 50.0, 2), 5.0]
    cos, sin = np.cos(turn), np.sin(turn)
    turned = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    points, start, goal = (places @ turned + moved for places in hall[:3])
    top_m = 8.0 if hall.layered else 5.0
    cells = route_cells_for(WIDTH_M, 60.0, 5.0, top_m, 1.5)
    routes = RoutePlanner(RouteSettings(PACE, MARGIN_M, 1.0, 30.0, 1.5, 1.2), cells)
    routes.take(start, points)
    return not routes.field(start, goal)[1] and not routes.look_closer(start, goal)


def halls_called_closed_wrongly(seeds: range, *, layered: bool) -> tuple[list[int], int]:
    """Seeds of halls that are called closed and are not; and how many are called closed at all."""
    wrong, called = [], 0
    for seed in seeds:
        hall = made_hall(seed, layered=layered)
        if is_called_closed(hall, np.random.default_rng(seed + 1)):
            called += 1
            if has_way(hall):
                wrong.append(seed)
    return wrong, called


@pytest.mark.parametrize(
    ("layered", "count"),
    [
        (False, 60),
        (True, 30),
        pytest.param(False, 1500, marks=pytest.mark.nightly),
        pytest.param(True, 500, marks=pytest.mark.nightly),
    ],
)
def test_no_hall_is_called_closed_that_has_a_way(layered: bool, count: int) -> None:
    wrong, called = halls_called_closed_wrongly(range(count), layered=layered)
    assert wrong == []
    assert called > 0.05 * count
