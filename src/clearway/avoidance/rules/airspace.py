"""Rules about places: heights to keep within, volumes to keep out of, a route to stay near.

Each tells how deep a place lies on the wrong side. Trajectories that go deeper than the vehicle is
already are forbidden; those that stay on the wrong side pay for it, so that the vehicle comes back.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from clearway.avoidance.clear.hazards import Hazards
from clearway.avoidance.clear.verify import clearances, paths_of
from clearway.avoidance.rules.rule import Depth, Rule, RuleView, Verdict
from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap

TOLERANCE = 1e-6
"""Share of the margin by which a limit may be missed."""
PRICE_OF_DEPTH = 4.0
"""Metres of flight that a metre on the wrong side costs where a trajectory ends."""


def altitude_floor(height_m: float) -> Rule:
    """Fly no lower than a height of the world frame."""
    return _judge_while_outside(
        "altitude floor", lambda at, _: height_m - at[:, 2], f"{height_m:g} m"
    )


def altitude_ceiling(height_m: float) -> Rule:
    """Fly no higher than a height of the world frame."""
    return _judge_while_outside(
        "altitude ceiling", lambda at, _: at[:, 2] - height_m, f"{height_m:g} m"
    )


def near_route(half_width_m: float, price: float = 0.5) -> Rule:
    """Stay within a distance of the legs about now; inside it, the offset has a small cost.

    price: metres of flight per metre off the route where a trajectory ends.
    """

    def verdict(view: RuleView) -> Verdict | None:
        here = float(off_route_m(view.state.position_m[None], view.route_m)[0])
        samples = view.samples_m
        off = off_route_m(samples.reshape(-1, 3), view.route_m).reshape(samples.shape[:2])
        pull = price * off[:, -1]
        held = _beyond_limit(view, off - half_width_m, here - half_width_m, f"{half_width_m:g} m")
        if held is None:
            return Verdict(f"{here:.1f} m off the route", None, pull)
        return replace(held, price_m=held.price_m + pull)

    def depth(places_m: FloatArray, route_m: FloatArray) -> FloatArray:
        return off_route_m(places_m, route_m) - half_width_m

    return Rule("near the route", verdict, depth=depth)


@dataclass(frozen=True, eq=False)
class GroundHeights:
    """Heights of the ground on an even raster in the world frame.

    Raises InputError where the raster has fewer than 2 x 2 heights.
    """

    height_m: FloatArray
    """[rows, columns] at `corner_m` + (column, row) x `step_m`; NaN where unknown."""
    corner_m: FloatArray
    """[2] x, y of the first height."""
    step_m: float

    def __post_init__(self) -> None:
        if self.height_m.ndim != 2 or min(self.height_m.shape) < 2 or not self.step_m > 0.0:
            raise InputError(
                "terrain",
                f"a raster of at least 2 x 2 heights and a step above 0 is needed, got "
                f"{self.height_m.shape} and {self.step_m}",
            )

    def under(self, places_m: FloatArray) -> FloatArray:
        """[n] highest of the four heights around places [n, 3]: never below what is between.

        NaN beyond the raster and beside unknown heights.
        """
        rows, columns = self.height_m.shape
        share = (places_m[:, :2] - self.corner_m) / self.step_m
        inside = np.all((share >= 0.0) & (share <= [columns - 1, rows - 1]), axis=1)
        column = np.clip(share[:, 0].astype(np.int64), 0, columns - 2)
        row = np.clip(share[:, 1].astype(np.int64), 0, rows - 2)
        around = [self.height_m[row + i, column + j] for i in (0, 1) for j in (0, 1)]
        return np.where(inside, np.max(around, axis=0), np.nan)


def terrain_clearance(ground: GroundHeights, height_m: float) -> Rule:
    """Fly at least a height above the ground; where its height is unknown, nothing is forbidden."""

    def too_low(places: FloatArray, _: FloatArray) -> FloatArray:
        under = ground.under(places)
        return np.where(np.isnan(under), -np.inf, under + height_m - places[:, 2])

    return _judge_while_outside("terrain clearance", too_low, f"{height_m:g} m above ground")


def keep_out(
    volumes: Sequence[Obstacle], from_s: float = -np.inf, until_s: float = np.inf, name: str = ""
) -> Rule:
    """Keep out of volumes while they are in force, by the mission's clock.

    Unlike a map obstacle a volume may be entered if that is what keeps clear of a collision.
    """
    charted = ObstacleMap(volumes)

    def verdict(view: RuleView) -> Verdict | None:
        if not from_s <= view.state.time_s <= until_s:
            return None
        here = view.state.position_m
        shapes = charted.in_grid(here, view.world_from_grid, view.reach_set.grid)
        if not len(shapes.radius_m):
            return None
        inside = max(0.0, -float(charted.distance_m(here[None])[0]))
        hazards = Hazards(shapes=shapes)
        found = clearances(paths_of(view.reach_set), hazards, TOLERANCE * view.margin_m)
        deepest = -found[:, 0]
        ends = -charted.distance_m(np.ascontiguousarray(view.samples_m[:, -1]))
        return _beyond(view, deepest, ends, inside, f"{len(shapes.radius_m)} in reach")

    def depth(places_m: FloatArray, _: FloatArray) -> FloatArray:
        # How far outside does not matter, and to find it out takes longest.
        return -charted.distance_m(places_m, TOLERANCE)

    always = from_s == -np.inf and until_s == np.inf
    about = f"keep out of {name}" if name else "keep-out volumes"
    return Rule(about, verdict, tuple(volumes), depth if always else None)


def _judge_while_outside(name: str, depth: Depth, limit: str) -> Rule:
    """The rule that judges trajectories by how deep they go; none while all of them are well."""

    def verdict(view: RuleView) -> Verdict | None:
        samples = view.samples_m
        found = depth(samples.reshape(-1, 3), view.route_m).reshape(samples.shape[:2])
        here = float(depth(view.state.position_m[None], view.route_m)[0])
        return _beyond_limit(view, found, here, limit)

    return Rule(name, verdict, depth=depth)


def _beyond_limit(view: RuleView, found: FloatArray, here: float, limit: str) -> Verdict | None:
    """The verdict by how deep the samples of trajectories lie [nodes, samples], and the vehicle."""
    if found.max() <= 0.0:
        return None
    # One column after another: numpy is slow over rows of four.
    deepest = view.worst_on_way(functools.reduce(np.maximum, found.T))
    return _beyond(view, deepest, found[:, -1], max(0.0, here), f"limit {limit}")


def _beyond(
    view: RuleView, deepest: FloatArray, ends: FloatArray, here: float, limit: str
) -> Verdict:
    reason = f"{limit}; the vehicle is {here:.1f} m beyond it" if here > 0.0 else limit
    price = PRICE_OF_DEPTH * np.maximum(ends, 0.0)
    return Verdict(reason, deepest > here + TOLERANCE * view.margin_m, price)


def off_route_m(places_m: FloatArray, route_m: FloatArray) -> FloatArray:
    """[n] level distance of places [n, 3] from the nearest leg of a route [points, 3]."""
    off = np.full(len(places_m), np.inf)
    for start, end in itertools.pairwise(route_m):
        along = (end - start)[:2]
        from_start = places_m[:, :2] - start[:2]
        _lower(off, from_start, from_start @ along, along, float(along @ along))
    return off


@compiled
def _lower(
    off: Floats, from_start: Floats2, along_leg: Floats, along: Floats, length2: float
) -> None:
    """Lower distances [n] to those from a leg [2], by the places from its start [n, 2] and the dot
    products of these with it [n]; length2: its squared length."""
    for n in range(len(off)):
        share = 0.0
        if length2 > 0.0:
            share = min(max(along_leg[n] / length2, 0.0), 1.0)
        x, y = from_start[n, 0] - share * along[0], from_start[n, 1] - share * along[1]
        off[n] = min(off[n], np.hypot(x, y))
