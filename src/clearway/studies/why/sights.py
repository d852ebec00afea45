"""When each sensor first showed the danger: by a return of it, or by one that hides it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from clearway.base.frames import wrap_angle
from clearway.sensors import Lidar
from clearway.studies.why.ending import Ending
from clearway.studies.why.vehicle import Judge
from clearway.studies.why.views import PlacedReading

SIGHT_SHARE = 1.0 / 3.0
"""Of the margin, beside the body, within which a return shows the danger."""


@dataclass(frozen=True, slots=True)
class FirstSight:
    """The first reading of a sensor that shows the danger, or the sector that it hides in."""

    sensor: str
    time_s: float
    away_m: float
    """From the vehicle."""
    hidden: bool = False
    """Whether it showed something nearer in the danger's sector, behind which the danger was."""


def find_sights(
    judge: Judge, ending: Ending, readings: Iterable[PlacedReading]
) -> tuple[FirstSight, ...]:
    """Return the first sight of each sensor that has one, the earliest first.

    A sector reports its nearest return only. So the danger counts as seen from when a nearer return
    hides it, where its sector stays occupied until the danger itself is shown.
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
    for one in readings:
        danger = ending.danger_at(one.reading.time_s)
        away = float(np.linalg.norm(danger - one.state.position_m)) - ending.radius_m
        # Between two beams no return can be nearer; arcs of sectors have no gaps.
        gap = 0.0 if one.reading.half_width_rad else spacing_rad * away
        apart = np.linalg.norm(one.points_m - danger, axis=1).min(initial=np.inf)
        shown = bool(apart <= max(near, gap))
        if shown and since is None:
            return FirstSight(one.sensor, one.reading.time_s, away)
        if shown:
            return since
        if away > farthest_m or not _hides(one, ending, near):
            since = None
        elif since is None:
            since = FirstSight(one.sensor, one.reading.time_s, away, hidden=True)
    return None


def _hides(one: PlacedReading, ending: Ending, near_m: float) -> bool:
    """Whether the sector that the danger was in had a return before it."""
    if not one.reading.half_width_rad or not len(one.reading.points_m):
        return False
    off = ending.danger_at(one.reading.time_s) - one.state.position_m
    ahead, left = (off @ one.state.world_from_body)[:2]
    x, y = one.reading.points_m[:, 0], one.reading.points_m[:, 1]
    turned = np.abs(wrap_angle(np.arctan2(y, x) - np.arctan2(left, ahead)))
    before = np.hypot(x, y) <= np.hypot(ahead, left) + near_m
    return bool(((turned <= one.reading.half_width_rad) & before).any())
