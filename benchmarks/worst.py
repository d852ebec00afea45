"""Decisions where it takes longest: walled in, in a tube, and with everything at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.decisions import seen_from, standing, static_mission
from benchmarks.scenes import SHAPES, mixed_shapes, street
from benchmarks.table import Benchmark, Row
from benchmarks.timing import timed
from clearway.base.state import State
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.traffic import Intruder

TUBE_M, PLANKS = 2.5, 24
"""Radius of the tube, and flat walls that it is made of."""
NEAR_SHAPES, INTRUDERS = 20, 10
FAR_M = 100.0
"""Range of the scanner."""


def tube() -> ObstacleMap:
    """Round and straight, closed at its far end."""
    planks = []
    for angle in 2.0 * np.pi * np.arange(PLANKS) / PLANKS:
        middle = np.array([25.0, TUBE_M * np.cos(angle), TUBE_M * np.sin(angle)])
        width_m = 2.1 * TUBE_M * np.tan(np.pi / PLANKS)
        turned = np.array([angle, 0.0, 0.0])
        planks.append(Obstacle.cuboid(middle, (70.0, 0.1, width_m), orientation_rad=turned))
    return ObstacleMap([*planks, Obstacle.cuboid([60.0, 0.0, 0.0], (0.2, 6.0, 6.0))])


def walls() -> ObstacleMap:
    """On all sides and nearer than the margin: nothing keeps it."""
    near_m, thick_m, size_m = 0.5, 0.1, 3.0
    sides = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            middle, size = np.zeros(3), np.full(3, size_m)
            middle[axis], size[axis] = sign * near_m, thick_m
            sides.append(Obstacle.cuboid(middle, (size[0], size[1], size[2])))
    return ObstacleMap(sides)


def passing_by() -> list[Intruder]:
    """Ten on paths through the grid, told before the decision."""
    rng = np.random.default_rng(1)
    found = []
    for number in range(INTRUDERS):
        through, velocity = rng.uniform([1, -3, -2], [9, 3, 2]), rng.normal(size=3)
        spread, name = rng.uniform(0.05, 0.4, 2), f"i{number}"
        found.append(
            Intruder(through - 6.0 * velocity, velocity, spread_rad=spread, radius_m=1.0, name=name)
        )
    return found


def mapped() -> ObstacleMap:
    """A thousand shapes told before take-off, twenty of them in view."""
    rng = np.random.default_rng(2)
    away = rng.uniform([30.0, -400.0, -20.0], [400.0, 400.0, 20.0], (SHAPES - NEAR_SHAPES, 3))
    far = [Obstacle.ball(place, 0.5) for place in away]
    return ObstacleMap([*mixed_shapes(NEAR_SHAPES), *far])


def crowded(smallest_m: float, largest_m: float, thick_m: float | None) -> ObstacleMap:
    """As many boxes as there are shapes, through and over one another, all of them in view; or all
    so thin along one axis."""
    rng = np.random.default_rng(3)
    told = []
    for middle in rng.uniform([1.5, -8.0, -5.0], [11.0, 8.0, 5.0], (SHAPES, 3)):
        size = rng.uniform(smallest_m, largest_m, 3)
        if thick_m is not None:
            size[rng.integers(3)] = thick_m
        turned = rng.uniform(-np.pi, np.pi, 3)
        told.append(Obstacle.cuboid(middle, tuple(size), orientation_rad=turned))
    return ObstacleMap(told)


def decided(
    make: Callable[[], ObstacleMap],
    what: str,
    escape: str,
    *,
    beams_per_cell: tuple[int, int] | None = None,
    obstacle_map: Callable[[], ObstacleMap] | None = None,
    intruders: Callable[[], Sequence[Intruder]] = tuple,
    target_s: float | None = None,
) -> Callable[[bool], Row]:
    """Decisions of who stands in a world, by what its scanner sees, map and traffic tell."""

    def measure(quick: bool) -> Row:
        setup = static_mission(beams_per_cell=beams_per_cell, escape=escape)
        (lidar,) = setup.lidars
        far = replace(lidar, dropout=0.0, pattern=replace(lidar.pattern, max_range_m=FAR_M))
        here = State(np.zeros(3))
        run = standing(
            setup,
            far,
            seen_from(far, make(), here),
            here,
            obstacle_map() if obstacle_map else None,
            intruders(),
        )
        return timed(run, quick).row(f"{what}, escape {escape}", target_s=target_s)

    return measure


BOTH = ("strict", "off")
BENCHMARKS = tuple(
    Benchmark(
        f"worst, {name}{'' if escape == 'strict' else ', escape off'}", measure, headline=True
    )
    for escape in BOTH
    for name, measure in (
        (
            "walled in",
            decided(walls, "a decision between walls that leave no margin anywhere", escape),
        ),
        (
            "tube",
            decided(
                tube,
                "a decision in a tube of 5 m, 50,400 returns, remembered as they are merged",
                escape,
                beams_per_cell=(40, 36),
                target_s=4e-3 if escape == "off" else None,
            ),
        ),
        *(
            (
                name,
                decided(
                    lambda: ObstacleMap([]),
                    f"a decision among {SHAPES:,} {what}, over one another and all in view",
                    escape,
                    obstacle_map=partial(crowded, *size_m),
                    target_s=10e-3 if escape == "off" else None,
                ),
            )
            for name, what, size_m in (
                ("boxes", "mapped boxes of 1 to 6 m", (1.0, 6.0, None)),
                ("plates", "mapped plates of 2 to 8 m, 10 cm thick", (2.0, 8.0, 0.1)),
                ("endless walls", "mapped walls of 20 to 40 m, 1 cm thick", (20.0, 40.0, 0.01)),
            )
        ),
        (
            "everything at once",
            decided(
                street,
                f"a decision with 100,800 returns of a street, {INTRUDERS} intruders and {SHAPES:,}"
                f" map shapes, {NEAR_SHAPES} of them near",
                escape,
                beams_per_cell=(80, 36),
                obstacle_map=mapped,
                intruders=passing_by,
                target_s=5e-3 if escape == "off" else None,
            ),
        ),
    )
)
