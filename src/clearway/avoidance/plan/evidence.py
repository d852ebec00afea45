"""From what is known to evidence per cell, and to what trajectories must keep clear of.

All that looks at a moment gathers here: a decision, a scene, news of a plan, a rival.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from clearway.avoidance.clear.hazards import (
    Hazards,
    MovingHazards,
    PointHazards,
    grow_into_grid,
    no_shapes,
    nothing_moving,
)
from clearway.avoidance.plan.settings import EvidenceSettings
from clearway.avoidance.plan.situation import Situation, margin_m, margin_slope
from clearway.avoidance.rate.fusion import Evidence, Rating
from clearway.base.brief import brief
from clearway.base.compiled import make_plain_array, read_only
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.grid_frame import GridFrame
from clearway.obstacles.cells import base_probability
from clearway.obstacles.cells import inflate_shapes as coated_by_map
from clearway.obstacles.obstacle import Shapes
from clearway.sensors import combine_detections, thin_points
from clearway.sensors import inflate_points as coated_by_points
from clearway.traffic import IntruderCells, VehicleTimes, assess_intruders, combine_intruders
from clearway.traffic.models.many import MANOEUVRE, Intruders

NO_SHAPES = no_shapes()
NOTHING_MOVING = nothing_moving()
NOBODY_NEAR = Intruders.of(())
THINNING = 0.1
"""Voxels in which points are merged before verification, as a share of the margin."""
MOST_MEASURED = 20_000
"""Shapes of a map of which each is asked for its distance at every decision."""


class Terms(Protocol):
    """On what terms a moment is assessed: a `Planner` has them, and so has a `Scene`."""

    @property
    def grid(self) -> AvoidanceGrid: ...

    @property
    def settings(self) -> EvidenceSettings: ...

    @property
    def cell_rating(self) -> Rating:
        """How evidence becomes a rating."""
        ...

    @property
    def speed_mps(self) -> float:
        """Of the own vehicle, the fastest."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class CountedAs:
    """How one intruder is counted, where it is not as the settings say."""

    models: tuple[str, ...]
    timed: bool | str = False
    """False, True for the paper's (5.5), or the name of a timed rule."""
    times: VehicleTimes | None = None
    """When the vehicle is in which cell."""
    up: FloatArray | None = None
    """[3] world up in the grid's frame; None as the state says."""


class InReach(NamedTuple):
    """What is around, in the grid's frame."""

    frame: GridFrame
    margin_m: float
    """To be kept from all of it."""
    hazards: Hazards
    intruders: Intruders
    """At the time of the state."""

    def __repr__(self) -> str:
        return brief(self)


def gather_in_reach(
    terms: Terms, situation: Situation, reach_m: float = 0.0, horizon_s: float = 0.0
) -> InReach:
    """Bring map, returns and intruders into the grid's frame.

    reach_m, horizon_s: how far trajectories lead in space and time; at least through the grid.
    """
    settings, frame, range_m = terms.settings, situation.frame, terms.grid.range_m
    margin = margin_m(settings, situation)
    sloped_m = margin_slope(settings, situation) * range_m
    within_m = max(range_m + sloped_m, reach_m) + margin
    points, points_left_out_m = _points(situation, settings, within_m)
    shapes = _shapes_near(situation, terms.grid, within_m)
    intruders, moving = NOBODY_NEAR, NOTHING_MOVING
    if situation.intruders:
        reports = Intruders.of(situation.intruders)
        intruders = reports.see_at(situation.state, frame.world_from_grid)
        within_s = max(range_m / terms.speed_mps, horizon_s)
        moving = _moving(reports, intruders, situation.state.time_s, settings.sigmas, within_s)
    left_out_m = min(points_left_out_m, _find_nearest_left_out_m(situation, shapes, within_m))
    hazards = Hazards(points, shapes, moving, left_out_m)
    return InReach(frame, margin, hazards, intruders)


def evidence_of(
    terms: Terms, situation: Situation, near: InReach, intruders: Sequence[IntruderCells]
) -> Evidence:
    """Return what each source says of every cell: sensors 5.2 and 5.3, map 5.4, intruders 5.1.

    Parameters
    ----------
    terms
        A planner or a scene: the grid, and how evidence is gathered.
    situation
        Its detections are what sensors say.
    near
        Points and shapes around, in the grid frame, and the margin that inflates them.
    intruders
        What intruders mean for the cells, by `intruder_cells`.
    """
    grid, points, shapes = terms.grid, near.hazards.points, near.hazards.shapes
    detected = map_base = met = np.zeros(grid.cells)
    if situation.detections:  # (5.38), (5.41), (5.47)
        sensed = combine_detections(situation.detections, terms.settings.sensor_fusion)
        detected, visibility = (
            make_plain_array(sensed.detected),
            make_plain_array(sensed.visibility),
        )
        seen = make_plain_array(sensed.seen, np.bool_)
    else:  # Nothing known and everything visible, as (4.19) starts.
        visibility, seen = np.ones(grid.cells), np.ones(grid.cells, dtype=np.bool_)
    coated = coated_by_points(grid, points.position_m, points.radius_m + near.margin_m)
    if len(shapes.radius_m):  # (5.53)
        map_base = make_plain_array(base_probability(shapes, grid, terms.settings.accuracy))
        coated = coated | coated_by_map(shapes, grid, near.margin_m)
    if intruders:  # (5.37)
        met = make_plain_array(
            intruders[0].probability
            if len(intruders) == 1
            else combine_intruders(np.concatenate([one.each for one in intruders]))
        )
    return Evidence(grid, detected, visibility, map_base, met, coated, seen)


def intruder_cells(
    terms: Terms, near: InReach, counted: Sequence[CountedAs] | None = None
) -> tuple[IntruderCells, ...]:
    """What intruders mean for each cell (5.36): all as the settings say, or each as told."""
    grid, settings, up = terms.grid, terms.settings, near.frame.up
    accuracy = settings.accuracy
    if counted is None:
        if not near.intruders:
            return ()
        models = settings.intruder_models
        return (assess_intruders(grid, near.intruders, models, up=up, accuracy=accuracy),)
    return tuple(
        assess_intruders(
            grid,
            [intruder],
            how.models,
            how.timed,
            how.times,
            up if how.up is None else how.up,
            accuracy,
        )
        for intruder, how in zip(near.intruders, counted, strict=True)
    )


def _shapes_near(situation: Situation, grid: AvoidanceGrid, within_m: float) -> Shapes:
    if situation.obstacle_map is None or not len(situation.obstacle_map):
        return NO_SHAPES
    frame, beyond_m = situation.frame, within_m - grid.range_m
    return situation.obstacle_map.in_grid(frame.origin_m, frame.world_from_grid, grid, beyond_m)


def _find_nearest_left_out_m(situation: Situation, near: Shapes, within_m: float) -> float:
    """At most the distance of the nearest map shape that is out of reach; inf without any."""
    known = situation.obstacle_map
    if known is None or len(known) == len(near.radius_m):
        return np.inf
    if len(known) > MOST_MEASURED:
        return within_m
    offsets = known.shapes.center_m - situation.frame.origin_m
    away = np.sqrt(np.einsum("ij,ij->i", offsets, offsets)) - known.shapes.bound_m
    away[near.source] = np.inf
    return max(within_m, float(away.min()))


def _points(
    situation: Situation, settings: EvidenceSettings, within_m: float
) -> tuple[PointHazards, float]:
    """What is remembered, or else the returns at hand merged in voxels; grown by range noise.

    Beside it the distance of the nearest return that is out of reach.
    """
    noise_m = settings.point_sigmas * situation.range_sigma_m
    remembered, frame = situation.remembered, situation.frame
    if remembered is not None:
        balls = make_plain_array(remembered.position_m), make_plain_array(remembered.radius_m)
        origin, rotation = read_only(frame.origin_m), read_only(frame.world_from_grid)
        return grow_into_grid(*balls, float(noise_m), origin, rotation), np.inf
    place = np.concatenate([np.zeros((0, 3)), *(d.points_m for d in situation.detections)])
    radius = np.concatenate([np.zeros(0), *(d.radius_m for d in situation.detections)])
    away = np.sqrt(np.einsum("ij,ij->i", place, place)) - radius - noise_m
    near = away <= within_m
    left_out_m = float(away[~near].min(initial=np.inf))
    place, radius = place[near], radius[near]
    if settings.accuracy == "fast":
        place, radius = thin_points(place, radius, THINNING * settings.safety_margin_m)
    return PointHazards(np.ascontiguousarray(place), radius + noise_m), left_out_m


def _moving(
    reports: Intruders, seen: Intruders, time_s: float, sigmas: float, horizon_s: float
) -> MovingHazards:
    """Intruders as balls that grow with time by all that they may deviate.

    reports: as they were reported; seen: at the decision time, in the grid frame. What a report's
    age adds is there from the start.
    """
    radius, growth = reports.balls(seen.velocity_mps, time_s, sigmas, horizon_s)
    return MovingHazards(
        seen.position_m.copy(),
        seen.velocity_mps.copy(),
        radius,
        growth,
        reports.numbers[:, MANOEUVRE].copy(),
        np.ones(len(seen)),
    )
