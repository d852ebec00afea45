"""Who comes too near where a way goes straight on from its end, or stands there."""

from __future__ import annotations

import numpy as np

from clearway.avoidance.clear.clearance import Span, moving_clearance
from clearway.avoidance.clear.closest import closest_s
from clearway.avoidance.clear.hazards import MovingHazards
from clearway.base.arrays import Bools, Floats, Floats2, Floats3, Int32s
from clearway.base.compiled import compiled
from clearway.base.rounding import SURELY

STANDING_PARTS = 8
"""Parts of the time that one stands: what grows counts as large as at the end of a part."""


@compiled
def nearer_onward(
    parent: Int32s,
    samples: Floats3,
    end_time_s: Floats,
    place: Floats2,
    velocity: Floats2,
    radius: Floats,
    growth: Floats,
    horizon_s: float,
    margin: float,
) -> Bools:
    """[nodes] whether any of k moving balls comes nearer than a margin after the way to a node has
    ended, flown straight on from there until a time.

    parent [nodes], samples [nodes, s, 3] (m) and end times [nodes] (s) as a reach set has them;
    place, velocity [k, 3], radius [k] (m) and its growth [k] (m/s) at the start, in the same frame.
    """
    lack = np.zeros(len(parent), dtype=np.bool_)
    onward = np.empty((len(parent), 7))
    farthest = _note_onward(parent, samples, end_time_s, horizon_s, onward)
    for k in range(len(radius)):
        grown = margin + radius[k] + max(growth[k], 0.0) * horizon_s
        if not _is_far(place[k], velocity[k], SURELY * (farthest + grown), horizon_s):
            _note_lack(onward, place[k], velocity[k], radius[k], growth[k], margin, horizon_s, lack)
    return lack


@compiled
def _note_onward(
    parent: Int32s,
    samples: Floats3,
    end_time_s: Floats,
    horizon_s: float,
    onward: Floats2,
) -> float:
    """Fill in where each way ends and how fast it goes on, along its last chord, and from when;
    how far from the start any of them comes until a time."""
    last = samples.shape[1] - 1
    farthest = 0.0
    for n in range(len(parent)):
        p, ended_s = parent[n], 0.0
        x, y, z = 0.0, 0.0, 0.0
        if p >= 0:
            ended_s = end_time_s[p]
            x, y, z = samples[p, last, 0], samples[p, last, 1], samples[p, last, 2]
        if last > 0:
            x, y, z = samples[n, last - 1, 0], samples[n, last - 1, 1], samples[n, last - 1, 2]
        ex, ey, ez = samples[n, last, 0], samples[n, last, 1], samples[n, last, 2]
        step_s = (end_time_s[n] - ended_s) / (last + 1)
        for _ in range(last + 1):
            ended_s = ended_s + step_s
        ux, uy, uz = (ex - x) / step_s, (ey - y) / step_s, (ez - z) / step_s
        onward[n, 0], onward[n, 1], onward[n, 2] = ex, ey, ez
        onward[n, 3], onward[n, 4], onward[n, 5] = ux, uy, uz
        onward[n, 6] = ended_s
        way = np.sqrt(ex * ex + ey * ey + ez * ez)
        way += np.sqrt(ux * ux + uy * uy + uz * uz) * max(0.0, horizon_s - ended_s)
        farthest = max(farthest, way)
    return farthest


@compiled
def _is_far(place: Floats, velocity: Floats, reach: float, horizon_s: float) -> bool:
    """Whether one stays farther from the start than a reach until a time."""
    px, py, pz = place[0], place[1], place[2]
    vx, vy, vz = velocity[0], velocity[1], velocity[2]
    at_s = closest_s(px, py, pz, vx, vy, vz, horizon_s)
    x, y, z = px + at_s * vx, py + at_s * vy, pz + at_s * vz
    return bool(reach >= 0.0 and x * x + y * y + z * z > reach * reach)


@compiled
def _note_lack(
    onward: Floats2,
    place: Floats,
    velocity: Floats,
    radius: float,
    growth: float,
    margin: float,
    horizon_s: float,
    lack: Bools,
) -> None:
    """Fill in where one comes nearer than a margin."""
    vx, vy, vz = velocity[0], velocity[1], velocity[2]
    px, py, pz = place[0], place[1], place[2]
    for n in range(len(onward)):
        if lack[n]:
            continue
        ended_s = onward[n, 6]
        cx, cy, cz = vx - onward[n, 3], vy - onward[n, 4], vz - onward[n, 5]
        dx, dy = px + ended_s * vx - onward[n, 0], py + ended_s * vy - onward[n, 1]
        dz = pz + ended_s * vz - onward[n, 2]
        left_s = max(0.0, horizon_s - ended_s)
        within_s = min(closest_s(dx, dy, dz, cx, cy, cz, np.inf), left_s)
        dx, dy, dz = dx + within_s * cx, dy + within_s * cy, dz + within_s * cz
        gap = np.sqrt(dx * dx + dy * dy + dz * dz)
        lack[n] = radius + growth * (ended_s + within_s) - gap > -margin


@compiled
def clear_standing(
    places: Floats2,
    since_s: Floats,
    until_s: float,
    lacking: Floats,
    moving: MovingHazards,
    margin: float,
) -> Bools:
    """[n] whether a vehicle at places [n, 3] from a time [n] until another keeps a margin.

    lacking: [n] by how much the vehicle may be nearer than its place.
    """
    corners, middle = np.empty((STANDING_PARTS + 1, 3)), np.empty(3)
    clear = np.ones(len(places), dtype=np.bool_)
    for n in range(len(places)):
        for axis in range(3):
            middle[axis] = places[n, axis]
            corners[:, axis] = places[n, axis]
        needed = margin + lacking[n]
        span = Span(corners, middle, 0.0, since_s[n], max(since_s[n], until_s))
        clear[n] = moving_clearance(span, moving, needed)[0] >= needed
    return clear
