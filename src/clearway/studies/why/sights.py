"""When each sensor first showed the danger: by a return of it, or by one that hides it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray, wrap_angle
from clearway.sensors import Lidar
from clearway.studies.why.ending import Ending
from clearway.studies.why.vehicle import Judge
from clearway.studies.why.views import PlacedReading

SIGHT_SHARE = 1.0 / 3.0
"""Of the margin, beside the body, within which a return shows the danger."""


@dataclass(frozen=True, slots=True)
class FirstSight:
    """The first reading of a sensor that shows the danger, or something before it."""

    sensor: str
    time_s: float
    away_m: float
    """From the vehicle."""
    hidden: bool = False
    """Whether its sector reported something nearer, or a nearer part of it."""


def find_sights(
    judge: Judge, ending: Ending, readings: Iterable[PlacedReading]
) -> tuple[FirstSight, ...]:
    """Return the first sight of each sensor that has one, the earliest first.

    A sector reports its nearest return only, so that a nearer one hides the danger. It counts as
    seen from when its sector has returns before it, until one shows the danger itself. What appears
    at once, nearer than the vehicle can have flown, was not seen before.
    """
    by_sensor: dict[str, list[PlacedReading]] = {}
    for one in readings:
        by_sensor.setdefault(one.sensor, []).append(one)
    lidars = {one.name: one.pattern for one in judge.lidars if isinstance(one, Lidar)}
    found = []
    for name, own in by_sensor.items():
        pattern = lidars.get(name)
        spacing, farthest = (pattern.spacing_rad, pattern.max_range_m) if pattern else (0.0, np.inf)
        found.append(_first(judge, ending, own, spacing, farthest))
    return tuple(sorted((one for one in found if one), key=lambda sight: sight.time_s))


def _first(
    judge: Judge,
    ending: Ending,
    readings: list[PlacedReading],
    spacing_rad: float,
    farthest_m: float,
) -> FirstSight | None:
    near = judge.body_m + SIGHT_SHARE * judge.margin_m + ending.radius_m
    since: FirstSight | None = None
    before: tuple[PlacedReading, float] | None = None
    for one in readings:
        danger = ending.danger_at(one.reading.time_s)
        away = float(np.linalg.norm(danger - one.state.position_m)) - ending.radius_m
        # Between two beams no return can be nearer; arcs of sectors have no gaps.
        gap = 0.0 if one.reading.half_width_rad else spacing_rad * away
        apart = np.linalg.norm(one.points_m - danger, axis=1).min(initial=np.inf)
        shown = bool(apart <= max(near, gap))
        nearest = _nearest_in_sector(one, danger)
        if before is None or nearest < before[1] - _measure_flown_m(before[0], one) - near:
            since = None  # What is suddenly nearer than it was flown was not shown before.
        if shown:
            return since or FirstSight(one.sensor, one.reading.time_s, away)
        if nearest > away + near or away > farthest_m:
            since, before = None, None
            continue
        since = since or FirstSight(one.sensor, one.reading.time_s, away, hidden=True)
        before = one, nearest
    return None


def _nearest_in_sector(one: PlacedReading, danger_m: FloatArray) -> float:
    """The level range that the sector reported in which a danger was; inf where it reported
    nothing, and of beams."""
    width = one.reading.half_width_rad
    if not width or not len(one.reading.points_m):
        return np.inf
    ahead, left = ((danger_m - one.state.position_m) @ one.state.world_from_body)[:2]
    x, y = one.reading.points_m[:, 0], one.reading.points_m[:, 1]
    turned = np.abs(wrap_angle(np.arctan2(y, x) - np.arctan2(left, ahead)))
    return float(np.hypot(x, y)[turned <= width].min(initial=np.inf))


def _measure_flown_m(before: PlacedReading, after: PlacedReading) -> float:
    return float(np.linalg.norm(after.state.position_m - before.state.position_m))
