"""Escapes checked against all that is known: single movements, compiled.

Two distances count: the margin from what is known to stand somewhere, and the body's radius from
unobserved space. Places are in the level frame of the decision: the vehicle's place, its yaw.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.clearance import Span, reach_about
from clearway.avoidance.clear.crowds import Crowd, crowd_of, span_clearance
from clearway.avoidance.clear.hazards import MovingHazards, PointBins
from clearway.base.arrays import Floats, Floats2
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.obstacles.obstacle import Shapes
from clearway.sensors.observed.seen_space import SeenSpace, is_free

GROWN_S = 10.0
"""For how long what is unsure of wind and predictions adds up: then own state estimates have told
anew."""
Times = tuple[float, float]
"""When a movement begins and ends, s from the decision on."""


class EscapeTerms(NamedTuple):
    """What an escape is checked against."""

    seen: SeenSpace
    must_see: bool
    """Whether unobserved space counts as occupied."""
    unseen_m: float
    """Distance to be kept from that."""
    unobserved_m: float
    """Metres of an escape that may lead nearer to that, or through it."""
    unseen_places: int
    """Ends of its movements that may, by which most that lead through more are found."""
    margin_m: float
    """Distance to be kept from what is known."""
    slope: float
    """Growth of the margin with the distance from the vehicle."""
    origin_m: Floats
    """[3] world frame."""
    yaw_rad: float
    grid_from_level: Floats2
    """[3, 3]"""
    bins: PointBins
    shapes: Shapes
    moving: MovingHazards
    nothing: MovingHazards
    """No intruder at all."""
    wind_mps: Floats
    """[3] level frame."""
    unsure_mps: float
    """How far off it may be."""
    tube_m: Floats
    """[n] within how far of its prediction the vehicle is after 0, 1, ... movements (def. 13);
    empty for exactly there."""
    tube_s: float
    """Duration of those movements."""
    least_s: float
    """For how long an escape is looked at, in whole rounds of its loop: once where there is no
    wind, since it then comes back to where it began."""

    def __repr__(self) -> str:
        return brief(self)


class LegRoom(NamedTuple):
    """Where a movement at a time is laid out."""

    level_m: Floats2
    """[samples + 1, 3] its corners, level frame."""
    grid_m: Floats2
    """[samples + 1, 3] likewise in the grid's frame."""
    middle_m: Floats
    """[3]"""
    crowd: Crowd


@compiled
def leg_room(samples: int, shapes: Shapes) -> LegRoom:
    """For movements of so many samples among shapes."""
    level, grid = np.empty((samples + 1, 3)), np.empty((samples + 1, 3))
    return LegRoom(level, grid, np.empty(3), crowd_of(shapes, samples + 1))


@compiled
def carry_leg(pose: Floats, path: Floats2, times: Times, terms: EscapeTerms) -> Floats2:
    """[samples + 1, 3] level frame: a movement [samples, 4] flown from a pose [4] and carried by
    the wind; poses are those in still air."""
    corners = np.empty((len(path) + 1, 3))
    lay_out_leg(pose, path, times, terms.wind_mps, corners)
    return corners


@compiled
def lay_out_leg(pose: Floats, path: Floats2, times: Times, wind: Floats, corners: Floats2) -> None:
    """Fill in `carry_leg`."""
    cosine, sine = np.cos(pose[3]), np.sin(pose[3])
    last = len(path)
    for axis in range(3):
        corners[0, axis] = pose[axis]
    for s in range(last):
        corners[s + 1, 0] = pose[0] + cosine * path[s, 0] - sine * path[s, 1]
        corners[s + 1, 1] = pose[1] + sine * path[s, 0] + cosine * path[s, 1]
        corners[s + 1, 2] = pose[2] + path[s, 2]
    if wind[0] != 0.0 or wind[1] != 0.0 or wind[2] != 0.0:
        for s in range(last + 1):
            time = times[0] + (times[1] - times[0]) * s / last
            for axis in range(3):
                corners[s, axis] += wind[axis] * time


@compiled
def turn_to_grid(room: LegRoom, grid_from_level: Floats2) -> None:
    """Fill in corners in the grid's frame."""
    g, level, turned = grid_from_level, room.level_m, room.grid_m
    for s in range(len(level)):
        x, y, z = level[s, 0], level[s, 1], level[s, 2]
        for axis in range(3):
            turned[s, axis] = g[axis, 0] * x + g[axis, 1] * y + g[axis, 2] * z


@compiled
def unsure_after(end_s: float, terms: EscapeTerms) -> float:
    """How far off the vehicle may be by then: carried by the wind, or off its prediction."""
    blown, last = terms.unsure_mps * min(end_s, GROWN_S), len(terms.tube_m) - 1
    if last < 1:
        return blown
    flown = min(min(end_s, GROWN_S) / terms.tube_s, float(last))
    before = min(int(flown), last - 1)
    off, grown = terms.tube_m[before], terms.tube_m[before + 1] - terms.tube_m[before]
    return float(blown + off + (flown - before) * grown)


@compiled
def pose_after(pose: Floats, path: Floats2) -> Floats:
    """[4] place and yaw at the end of a movement."""
    cosine, sine = np.cos(pose[3]), np.sin(pose[3])
    end = path[len(path) - 1]
    after = np.empty(4)
    after[0] = pose[0] + cosine * end[0] - sine * end[1]
    after[1] = pose[1] + sine * end[0] + cosine * end[1]
    after[2] = pose[2] + end[2]
    after[3] = pose[3] + end[3]
    return after


@compiled
def was_seen(corners: Floats2, sagitta: float, terms: EscapeTerms) -> bool:
    """Whether the body stays in seen space on its way through corners, level frame."""
    return _way_unseen_m(corners, sagitta + terms.unseen_m, terms, 0.0) == 0.0


@compiled
def _way_unseen_m(corners: Floats2, radius: float, terms: EscapeTerms, most: float) -> float:
    """Metres of a way about which the tube was not seen; inf where these are more than `most`.

    Balls about the corners are looked up, wide enough to hold all of the way half-way to the next
    ones: of a ball that was not seen all of that counts. Staying at such a place is never few
    enough.
    """
    origin, cosine, sine = terms.origin_m, np.cos(terms.yaw_rad), np.sin(terms.yaw_rad)
    last = len(corners) - 1
    half = 0.0
    for s in range(last):
        dx, dy = corners[s + 1, 0] - corners[s, 0], corners[s + 1, 1] - corners[s, 1]
        dz = corners[s + 1, 2] - corners[s, 2]
        half = max(half, 0.5 * np.sqrt(dx * dx + dy * dy + dz * dz))
    around, spent = np.sqrt(radius * radius + half * half), 0.0
    for at in range(len(corners)):
        s = last - at
        x = origin[0] + cosine * corners[s, 0] - sine * corners[s, 1]
        y = origin[1] + sine * corners[s, 0] + cosine * corners[s, 1]
        z = origin[2] + corners[s, 2]
        if not is_free(terms.seen, x, y, z, around):
            share = _half_way(corners, s, -1) + _half_way(corners, s, 1)
            spent += share
            if share == 0.0 or spent > most:
                return np.inf
    return spent


@compiled
def _half_way(corners: Floats2, s: int, step: int) -> float:
    """Half the way from a corner to the one before (-1) or after (1); 0 where there is none."""
    if not 0 <= s + step < len(corners):
        return 0.0
    dx = corners[s + step, 0] - corners[s, 0]
    dy = corners[s + step, 1] - corners[s, 1]
    dz = corners[s + step, 2] - corners[s, 2]
    return float(0.5 * np.sqrt(dx * dx + dy * dy + dz * dz))


@compiled
def leg_keeps(
    pose: Floats,
    path: Floats2,
    sagitta: float,
    start_s: float,
    end_s: float,
    terms: EscapeTerms,
) -> bool:
    """Whether a movement from a pose [4] is safe: all of it through seen space, with the margin."""
    times, room, unseen = (start_s, end_s), leg_room(len(path), terms.shapes), terms.unseen_m
    about = (pose, path, sagitta, times, unseen, terms, room)
    if terms.must_see and leg_unseen_m(*about, 0.0) > 0.0:
        return False
    return leg_keeps_margin(pose, path, sagitta, times, terms, room)


@compiled
def leg_unseen_m(
    pose: Floats,
    path: Floats2,
    sagitta: float,
    times: Times,
    unseen: float,
    terms: EscapeTerms,
    room: LegRoom,
    most: float,
) -> float:
    """Metres of it that lead through unobserved space, or nearer to that; inf where these are more
    than `most`."""
    lay_out_leg(pose, path, times, terms.wind_mps, room.level_m)
    radius = sagitta + unsure_after(times[1], terms) + unseen
    return _way_unseen_m(room.level_m, radius, terms, most)


@compiled
def leg_keeps_margin(
    pose: Floats,
    path: Floats2,
    sagitta: float,
    times: Times,
    terms: EscapeTerms,
    room: LegRoom,
) -> bool:
    """Whether it keeps the margin from all that stands."""
    lay_out_leg(pose, path, times, terms.wind_mps, room.level_m)
    turn_to_grid(room, terms.grid_from_level)
    farthest2 = 0.0
    for s in range(len(room.level_m)):
        x, y, z = room.level_m[s, 0], room.level_m[s, 1], room.level_m[s, 2]
        farthest2 = max(farthest2, x * x + y * y + z * z)
    around = sagitta + unsure_after(times[1], terms)
    needed = terms.margin_m + around + terms.slope * np.sqrt(farthest2)
    reach = reach_about(room.grid_m, room.middle_m)
    span = Span(room.grid_m, room.middle_m, reach, times[0], times[1])
    least = needed - 1e-9 * terms.margin_m
    found = span_clearance(span, terms.bins, terms.shapes, terms.nothing, room.crowd, needed, least)
    return bool(found[0] >= least)
