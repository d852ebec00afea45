"""Places of escapes: looked up one by one, which quickly tells most of those that lead nowhere."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.clear.hazards import has_point_within
from clearway.avoidance.escape.chains import step_on
from clearway.avoidance.escape.legs import EscapeTerms
from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.reach.escapes.legs import Legs
from clearway.reach.escapes.ways import Ways
from clearway.sensors.observed.seen_space import SeenSpace, is_free

NEARLY = 0.9
"""Of a distance, so that rounding never makes a first look stricter than the last."""


@compiled
def loop_places(ways: Ways, legs: Legs) -> Floats2:
    """[..., 4] where and when each movement of each loop ends, from the loop's start at yaw 0; of
    each loop those half way round first, since most that lead through unobserved space do so
    there."""
    places = np.empty((len(ways.loop_movement), 4))
    poses = np.empty((2, 4))
    for loop in range(len(ways.loop_attitude)):
        at = ways.loop_attitude[loop]
        first, last = ways.loop_at[loop], ways.loop_at[loop + 1]
        count = last - first
        in_order, when_s = np.empty((count, 4)), 0.0
        poses[0] = 0.0
        for n in range(count):
            m = ways.loop_movement[first + n]
            step_on(poses, 0, legs.path[at, m])
            when_s += legs.duration_s[m]
            in_order[n, :3], in_order[n, 3] = poses[1, :3], when_s
            poses[0], at = poses[1], legs.following[at, m]
        stride, filled = max(1, count // 4), first
        for begins in range(stride):
            for lap in range((count - begins + stride - 1) // stride):
                places[filled] = in_order[(count // 2 + begins + lap * stride) % count]
                filled += 1
    return places


@compiled
def places_were_seen(
    places: Floats2,
    first: int,
    last: int,
    placed: Floats,
    wind: Floats,
    radius: float,
    missing: int,
    seen: SeenSpace,
) -> bool:
    """Whether places first to last of a loop were seen but for so many, in one round of it.

    placed: where the loop begins, by `_placed_at`. wind: [3] in the world. The places alone are
    looked up, with a radius: quick to tell that a loop leads through unobserved space, which most
    do.
    """
    x0, y0, z0, cosine, sine = placed[0], placed[1], placed[2], placed[3], placed[4]
    for n in range(first, last):
        ahead, left, when = places[n, 0], places[n, 1], places[n, 3]
        x = x0 + cosine * ahead - sine * left + wind[0] * when
        y = y0 + sine * ahead + cosine * left + wind[1] * when
        if not is_free(seen, x, y, z0 + places[n, 2] + wind[2] * when, radius):
            missing -= 1
            if missing < 0:
                return False
    return True


@compiled
def places_are_clear(
    places: Floats2,
    first: int,
    last: int,
    pose: Floats,
    start_s: float,
    terms: EscapeTerms,
) -> bool:
    """Whether no return lies much nearer than the margin to places first to last of a loop that
    begins at a pose [4] and a time: most loops that lead into a wall are found by one of
    them."""
    bins, wind, g = terms.bins, terms.wind_mps, terms.grid_from_level
    within = NEARLY * terms.margin_m
    cosine, sine = np.cos(pose[3]), np.sin(pose[3])
    for n in range(first, last):
        ahead, left, when = places[n, 0], places[n, 1], start_s + places[n, 3]
        x = pose[0] + cosine * ahead - sine * left + wind[0] * when
        y = pose[1] + sine * ahead + cosine * left + wind[1] * when
        z = pose[2] + places[n, 2] + wind[2] * when
        if has_point_within(
            bins,
            g[0, 0] * x + g[0, 1] * y + g[0, 2] * z,
            g[1, 0] * x + g[1, 1] * y + g[1, 2] * z,
            g[2, 0] * x + g[2, 1] * y + g[2, 2] * z,
            within,
        ):
            return False
    return True
