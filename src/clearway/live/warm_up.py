"""Made-up readings on which everything that a decision runs is compiled before take-off."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from clearway.avoidance.from_here import near_from, prepared_from
from clearway.avoidance.in_force import warm_up_rules
from clearway.avoidance.passing import Meetings
from clearway.avoidance.planner import Planner
from clearway.avoidance.situation import Situation, goal_of
from clearway.avoidance.ways_out import WaysOut
from clearway.base.frames import FloatArray, world_from_body
from clearway.base.state import State
from clearway.live.readings import Reading
from clearway.live.wind import WindEstimate
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import Scan
from clearway.traffic import Intruder, combine_intruders

INTRUDERS_AHEAD = (None, 0.5, 0.0)
"""By step, in ranges of the grid: none; one ahead; one so near that only the emergency rule is
left."""
SEEN_AT = (0.4, 0.8, 0.8)
"""By step, in ranges of the grid: what was seen first is looked through afterwards."""
UNSURE_RAD = (None, 0.01, 0.0)
"""By step: as at the start, and either way, since what is not sure is remembered otherwise."""
TILT_RAD = 0.01
"""More by every step: from between start pitches, trajectories are predicted anew."""

_warmed_up: WeakKeyDictionary[Planner, set[Hashable]] = WeakKeyDictionary()
_made: set[Hashable] = set()


def is_new(kind: Hashable) -> bool:
    """Whether no system of a kind was made in this process yet, and notes that one now is."""
    found = kind in _made
    _made.add(kind)
    return not found


def is_first_of(planner: Planner, pilot: object, kind: Hashable) -> bool:
    """Whether no pilot of a kind has flown by a planner in this process yet, and notes that it now
    does: flights of a campaign, which share their planner, need one warm-up between them. Others'
    own pilots are always the first."""
    made_by = type(pilot)
    kinds, found = _warmed_up.setdefault(planner, set()), (made_by, kind)
    if found in kinds and made_by.__module__.startswith("clearway."):
        return False
    kinds.add(found)
    return True


def warm_up_moments(
    planner: Planner, start: State, sensors: Iterable[str]
) -> Iterator[tuple[float, list[Reading]]]:
    """Moments at which to decide, and the readings that come before; sensors: their names."""
    names = tuple(sensors)
    for step, ahead in enumerate(INTRUDERS_AHEAD):
        time_s = start.time_s + step
        tilted = start.attitude_rad + np.array([0.0, step * TILT_RAD, 0.0])
        given = UNSURE_RAD[step]
        unsure = start.attitude_std_rad if given is None else given
        here = replace(start, attitude_rad=tilted, time_s=time_s, attitude_std_rad=unsure)
        readings: list[Reading] = [here]
        readings += [
            Scan(SEEN_AT[step] * planner.grid.range_m * _fan(), time_s, name) for name in names
        ]
        if ahead is not None:
            readings.append(_passing(planner, start, ahead, time_s))
        yield time_s, readings


def _passing(planner: Planner, start: State, ahead: float, time_s: float) -> Intruder:
    return Intruder(
        start.position_m + ahead * planner.grid.range_m,
        np.array([0.0, -planner.speed_mps, 0.0]),
        np.array([0.1, 0.1]),
        planner.settings.safety_margin_m,
        "passing",
        time_s,
    )


def _fan() -> FloatArray:
    """[49, 3] directions ahead."""
    steps = np.linspace(-0.5, 0.5, 7)
    y, z = np.meshgrid(steps, steps, indexing="ij")
    ahead = np.stack([np.ones(49), y.ravel(), z.ravel()], axis=1)
    return np.asarray(ahead / np.linalg.norm(ahead, axis=1)[:, None])


def with_something_near(
    obstacle_map: ObstacleMap | None, planner: Planner, start: State
) -> ObstacleMap | None:
    """The map, if it shows anything, with a ball where the first decision has to look at it."""
    if not obstacle_map:
        return obstacle_map  # An empty one may tell that all is free.
    ahead = np.array([0.5 * planner.grid.range_m, 0.0, 0.0])
    place = start.position_m + world_from_body(start.attitude_rad) @ ahead
    ball = Obstacle.ball(place, planner.settings.safety_margin_m)
    return ObstacleMap([*obstacle_map.obstacles, ball], complete_m=obstacle_map.complete_m)


def warm_up_more(planner: Planner, situation: Situation) -> None:
    """Compile and load what only some decisions ask for: several intruders, rules, sides of
    passing, a wind that grows, ways out."""
    combine_intruders(np.zeros((2, planner.grid.cells)))
    prepared = prepared_from(planner, situation)
    near = near_from(planner, situation, prepared)
    warm_up_rules(planner, situation, prepared, goal_of(situation), near)
    WindEstimate(planner.speed_mps).warm_up()
    Meetings(prepared.reach_set, near.hazards.moving, near.intruders.names).warm_up()
    if planner.escapes is None:
        return
    WaysOut(planner, planner.escapes, situation, near).warm_up()
