"""Made-up fields of upright columns: forests, pillars and cylinders, each from a seed.

Those on level ground suit a fast copter: about 100 m long, with as many columns per square metre
and of such sizes as the fields that other projects measure their planners in.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType

import numpy as np

from clearway.obstacles.columns import Columns
from clearway.sim.world_parts import (
    ROOM_M,
    TALL_M,
    MadeWorld,
    MakeWorld,
    Span,
    draw_between,
    leg,
    roomy,
)

TRUNKS_APART_M = 2.5
FLOWN_M: Span = (0.7, 4.0)
"""Heights that are flown on level ground."""
DENSITIES: dict[str, float] = {"easy": 0.05, "medium": 0.1, "hard": 0.2}
"""Share of the ground that cylinders cover."""


@dataclass(frozen=True)
class ColumnField:
    """How columns are drawn. Spans are quantiles at equal steps, the least and the greatest too."""

    name: str
    stream: int
    """Of random numbers."""
    start_m: tuple[float, float, float]
    end_m: tuple[float, float, float]
    ahead_m: Span
    """From where to where along x columns stand."""
    half_width_m: float
    radii_m: tuple[float, ...]
    tops_m: tuple[float, ...]
    low_m: float
    apart_m: float = -np.inf
    """Between two columns, at least; they may overlap by default."""
    doubled: float = 0.0
    """Share of columns that overlap the one drawn before them."""
    room_m: float = 2.5
    """About start and goal."""
    ground_m: float = -np.inf
    flown_m: Span | None = None
    corridor_m: float | None = None

    @property
    def area_m2(self) -> float:
        """Area in which columns stand."""
        return (self.ahead_m[1] - self.ahead_m[0]) * 2.0 * self.half_width_m


OPEN_FOREST = ColumnField(
    name="forest",
    stream=21,
    start_m=(-5.0, 0.0, 0.0),
    end_m=(55.0, 0.0, 0.0),
    ahead_m=(0.0, 50.0),
    half_width_m=18.0,
    radii_m=(0.2, 0.7),
    tops_m=(0.5 * TALL_M,),
    low_m=-0.5 * TALL_M,
    room_m=ROOM_M,
)
OPEN_FOREST_TRIES = 400
DENSE_FOREST = ColumnField(
    name="dense-forest",
    stream=61,
    start_m=(0.0, 0.0, 2.0),
    end_m=(105.0, 0.0, 2.0),
    ahead_m=(3.0, 102.0),
    half_width_m=30.0,
    radii_m=(0.1, 0.35),
    tops_m=(15.0, 25.0),
    low_m=0.0,
    ground_m=0.0,
    flown_m=FLOWN_M,
    corridor_m=20.0,
)
PILLARS = ColumnField(
    name="columns",
    stream=62,
    start_m=(0.0, 0.0, 1.5),
    end_m=(100.0, 0.0, 1.5),
    ahead_m=(-4.0, 104.0),
    half_width_m=21.0,
    radii_m=(0.24, 0.55, 0.72, 0.86, 1.0, 1.1, 1.17, 1.28, 1.37, 1.47, 2.2),
    tops_m=(0.7, 2.8, 2.97, 3.05, 3.2, 3.35, 3.5, 3.65, 3.75, 3.83, 3.94),
    low_m=0.0,
    apart_m=1.2,
    doubled=0.18,
    ground_m=0.0,
    flown_m=(FLOWN_M[0], 3.6),
    corridor_m=11.0,
)
PILLARS_PER_M2 = 0.038
DOUBLED_M: Span = (0.9, 2.1)
"""Between the axes of two columns that overlap."""
CYLINDERS = ColumnField(
    name="cylinders",
    stream=63,
    start_m=(0.0, 0.0, 2.0),
    end_m=(105.0, 0.0, 2.0),
    ahead_m=(4.0, 102.0),
    half_width_m=30.0,
    radii_m=(1.0, 1.5),
    tops_m=(6.0,),
    low_m=0.0,
    apart_m=1.5,
    ground_m=0.0,
    flown_m=FLOWN_M,
    corridor_m=20.0,
)
MOST_TRIES = 20_000
"""Columns drawn until there are as many, or they cover as much of the ground, as asked for."""


def forest(
    seed: int, apart_m: float = TRUNKS_APART_M, trees_per_m2: float | None = None
) -> MadeWorld:
    """Trunks that cannot be flown over, a few metres apart, or as many to the square metre.

    apart_m: between trunks at least, of 0.2 to 0.7 m radius, in front of a leg of 60 m.
    trees_per_m2: of a dense forest instead, with trunks of 0.1 to 0.35 m radius that may touch, on
    level ground, in front of a leg of 105 m.
    """
    if trees_per_m2 is None:
        return _draw(replace(OPEN_FOREST, apart_m=apart_m), seed, OPEN_FOREST_TRIES)
    return _draw(DENSE_FOREST, seed, round(trees_per_m2 * DENSE_FOREST.area_m2))


def column_field(seed: int, columns_per_m2: float = PILLARS_PER_M2) -> MadeWorld:
    """Columns of 0.2 to 2.2 m radius, some overlapping, most as high as can be flown.

    Their number, radii, heights and gaps are distributed as on a map that another project flies.
    """
    return _draw(PILLARS, seed, MOST_TRIES, number=round(columns_per_m2 * PILLARS.area_m2))


def cylinder_field(seed: int, covered: float = DENSITIES["medium"]) -> MadeWorld:
    """Cylinders of 1 to 1.5 m radius, 1.5 m apart or more, that cover a share of the ground."""
    return _draw(CYLINDERS, seed, MOST_TRIES, enough_m2=covered * CYLINDERS.area_m2)


COLUMN_WORLDS: Mapping[str, MakeWorld] = MappingProxyType(
    {
        "forest": forest,
        "dense-forest": partial(forest, trees_per_m2=0.1),
        "columns": column_field,
        **{
            f"cylinders-{name}": partial(cylinder_field, covered=covered)
            for name, covered in DENSITIES.items()
        },
    }
)
"""Worlds of columns by family name."""


def _draw(
    field: ColumnField,
    seed: int,
    tries: int,
    *,
    number: int | None = None,
    enough_m2: float = np.inf,
) -> MadeWorld:
    """Columns of a field: those of some tries that no other column and neither end forbids.

    number, enough_m2: of columns, and of the ground that they cover; with either there are enough.
    """
    rng = np.random.default_rng([seed, field.stream])
    mission = leg(f"{field.name}-{seed}", field.start_m, field.end_m)
    (near, far), aside = field.ahead_m, field.half_width_m
    rows = np.empty((tries, 5))
    count, covered_m2 = 0, 0.0
    for _ in range(tries):
        if covered_m2 >= enough_m2 or count == number:
            break
        x, y = rng.uniform([near, -aside], [far, aside])
        radius = _quantile(rng, field.radii_m)
        top = _quantile(rng, field.tops_m)
        apart_m = field.apart_m
        if count and field.doubled and rng.random() < field.doubled:
            angle, away = rng.uniform(-np.pi, np.pi), draw_between(rng, DOUBLED_M)
            x = rows[count - 1, 0] + away * np.cos(angle)
            y = rows[count - 1, 1] + away * np.sin(angle)
            apart_m = -np.inf
        stand = rows[:count]
        gaps = np.hypot(stand[:, 0] - x, stand[:, 1] - y) - stand[:, 2] - radius
        if np.all(gaps >= apart_m) and roomy(mission, np.array([x, y]), radius, field.room_m):
            rows[count] = x, y, radius, field.low_m, top
            count, covered_m2 = count + 1, covered_m2 + np.pi * radius**2
    world = Columns(rows[:count], ground_m=field.ground_m)
    return MadeWorld(world, mission, heights_m=field.flown_m, corridor_m=field.corridor_m)


def _quantile(rng: np.random.Generator, values: tuple[float, ...]) -> float:
    """A value drawn from a distribution by its quantiles; one alone is not drawn."""
    if len(values) == 1:
        return values[0]
    return float(np.interp(rng.random(), np.linspace(0.0, 1.0, len(values)), values))
