"""When and where ways come closest to what flies straight on, each flown on from its end.

What lies between is worked out for many nodes at once, by loops that ask no questions on the way,
so that the machine takes several at a time.
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import (
    Bools2,
    Floats,
    Floats2,
    Floats3,
    Int32s,
    Ints,
    StridedFloats,
    StridedFloats2,
)
from clearway.base.compiled import compiled

MANY = 64
"""So many nodes at once fit the fastest memory."""

# Rows of the chords of movements: where one begins, how fast it is flown, from when and how long;
# of the nearest on them: distance squared, time and what lies between; how far along a side that
# is, and how far in all.
CHORD_X = 0
CHORD_Y = 1
CHORD_Z = 2
SPEED_X = 3
SPEED_Y = 4
SPEED_Z = 5
BEGUN = 6
LASTS = 7
GAP2 = 0
WHEN = 1
ASIDE_X = 2
ASIDE_Y = 3
ASIDE_Z = 4
ALONG = 5
APART = 6


@compiled
def find_closest_ways(
    parent: Int32s,
    samples: Floats3,
    end_time_s: Floats,
    place: Floats2,
    velocity: Floats2,
) -> tuple[Floats3, Floats2]:
    """[nodes, k, 3] from the vehicle to each of k (places and velocities [k, 3]) when they are
    closest on the way to a node and straight on from there, and [nodes, k] when that is.

    parent [nodes], samples [nodes, s, 3] and end times [nodes] as a reach set has them.
    """
    nodes, many = len(parent), len(place)
    aside_m, time_s = np.empty((nodes, many, 3)), np.empty((nodes, many))
    # What is nearest on each way itself, which its sequels begin with; the last is the start's.
    on_way = np.empty((many, nodes + 1, 5))
    for k in range(many):
        on_way[k, nodes, GAP2], on_way[k, nodes, WHEN] = np.sum(place[k] ** 2), 0.0
        on_way[k, nodes, ASIDE_X:] = place[k]
    chords = np.empty((samples.shape[1] + 1, 8, MANY))
    within, beyond = np.empty((7, MANY)), np.empty((7, MANY))
    for first in range(0, nodes, MANY):
        last = min(first + MANY, nodes)
        _note_chords(parent, samples, end_time_s, first, last, chords)
        for k in range(many):
            _note_nearest(chords, last - first, place[k], velocity[k], within, beyond)
            _note_closest(
                parent, first, last, within, beyond, on_way[k], aside_m[:, k], time_s[:, k]
            )
    return aside_m, time_s


@compiled
def off_sides(
    parent: Int32s,
    samples: Floats3,
    end_time_s: Floats,
    place: Floats2,
    velocity: Floats2,
    sides: Floats2,
    least_cos: Floats,
) -> Bools2:
    """[c, nodes] whether the way to a node is closest to any of k too far from its side [k, 3]: by
    each of c cosines of the angle between."""
    nodes, many = len(parent), len(place)
    off = np.zeros(nodes, dtype=np.int64)
    # Of each way itself, which its sequels begin with; the last is the start's.
    gap2, off_way = np.empty((many, nodes + 1)), np.empty((many, nodes + 1), dtype=np.int64)
    chords = np.empty((samples.shape[1] + 1, 8, MANY))
    within, beyond = np.empty((7, MANY)), np.empty((7, MANY))
    off_within, off_beyond = np.empty(MANY, dtype=np.int64), np.empty(MANY, dtype=np.int64)
    for k in range(many):
        within[ASIDE_X : ASIDE_Z + 1, 0] = place[k]
        _note_off(within, 1, sides[k], least_cos, off_within)
        gap2[k, nodes], off_way[k, nodes] = np.sum(place[k] ** 2), off_within[0]
    for first in range(0, nodes, MANY):
        last = min(first + MANY, nodes)
        _note_chords(parent, samples, end_time_s, first, last, chords)
        for k in range(many):
            _note_nearest(chords, last - first, place[k], velocity[k], within, beyond)
            _note_off(within, last - first, sides[k], least_cos, off_within)
            _note_off(beyond, last - first, sides[k], least_cos, off_beyond)
            for n in range(first, last):
                m, p = n - first, parent[n]
                before2, before = gap2[k, p], off_way[k, p]
                within2, beyond2 = within[GAP2, m], beyond[GAP2, m]
                on, further = off_within[m], off_beyond[m]
                # Which is nearest cannot be foretold, so no branch asks.
                nearer = within2 < before2
                here2 = within2 if nearer else before2
                here = on if nearer else before
                gap2[k, n], off_way[k, n] = here2, here
                off[n] |= further if beyond2 < here2 else here
    return _each_bit(off, len(least_cos))


@compiled
def closest_s(
    dx: float, dy: float, dz: float, cx: float, cy: float, cz: float, longest_s: float
) -> float:
    """When two that move straight on are closest: what lies between them, and how that changes."""
    speed2 = cx * cx + cy * cy + cz * cz
    if speed2 <= 0.0:
        return 0.0
    return min(longest_s, max(0.0, -(dx * cx + dy * cy + dz * cz) / speed2))


@compiled
def _note_chords(
    parent: Int32s,
    samples: Floats3,
    end_time_s: Floats,
    first: int,
    last: int,
    chords: Floats3,
) -> None:
    """Fill in the chords [s + 1, 8, MANY] of movements that lead to nodes; their last goes on."""
    count = samples.shape[1]
    for n in range(first, last):
        m, p, begun_s = n - first, parent[n], 0.0
        x, y, z = 0.0, 0.0, 0.0
        if p >= 0:
            begun_s = end_time_s[p]
            x, y, z = samples[p, count - 1, 0], samples[p, count - 1, 1], samples[p, count - 1, 2]
        step_s = (end_time_s[n] - begun_s) / count
        ux, uy, uz = 0.0, 0.0, 0.0
        for q in range(count + 1):
            on = q == count
            chords[q, CHORD_X, m], chords[q, CHORD_Y, m], chords[q, CHORD_Z, m] = x, y, z
            if not on:
                ux = (samples[n, q, 0] - x) / step_s
                uy = (samples[n, q, 1] - y) / step_s
                uz = (samples[n, q, 2] - z) / step_s
                x, y, z = samples[n, q, 0], samples[n, q, 1], samples[n, q, 2]
            chords[q, SPEED_X, m], chords[q, SPEED_Y, m], chords[q, SPEED_Z, m] = ux, uy, uz
            chords[q, BEGUN, m], chords[q, LASTS, m] = begun_s, np.inf if on else step_s
            begun_s = begun_s + step_s


@compiled
def _note_nearest(
    chords: Floats3,
    many: int,
    place: Floats,
    velocity: Floats,
    within: Floats2,
    beyond: Floats2,
) -> None:
    """Fill in what is nearest [7, MANY] to one on so many movements, and on where they go on."""
    within[GAP2, :many] = beyond[GAP2, :many] = np.inf
    last = len(chords) - 1
    for q in range(last):
        _look_along(chords[q], many, place, velocity, within)
    _look_along(chords[last], many, place, velocity, beyond)


@compiled
def _look_along(
    chord: Floats2, many: int, place: Floats, velocity: Floats, nearest: Floats2
) -> None:
    """Take what is nearer on one chord [8, MANY] of each."""
    px, py, pz = place[0], place[1], place[2]
    vx, vy, vz = velocity[0], velocity[1], velocity[2]
    for m in range(many):
        begun_s = chord[BEGUN, m]
        cx, cy, cz = vx - chord[SPEED_X, m], vy - chord[SPEED_Y, m], vz - chord[SPEED_Z, m]
        dx = px + begun_s * vx - chord[CHORD_X, m]
        dy = py + begun_s * vy - chord[CHORD_Y, m]
        dz = pz + begun_s * vz - chord[CHORD_Z, m]
        after_s = closest_s(dx, dy, dz, cx, cy, cz, chord[LASTS, m])
        dx, dy, dz = dx + after_s * cx, dy + after_s * cy, dz + after_s * cz
        gap2 = dx * dx + dy * dy + dz * dz
        known2, known_s = nearest[GAP2, m], nearest[WHEN, m]
        ax, ay, az = nearest[ASIDE_X, m], nearest[ASIDE_Y, m], nearest[ASIDE_Z, m]
        nearer = gap2 < known2
        nearest[GAP2, m] = gap2 if nearer else known2
        nearest[WHEN, m] = begun_s + after_s if nearer else known_s
        nearest[ASIDE_X, m] = dx if nearer else ax
        nearest[ASIDE_Y, m] = dy if nearer else ay
        nearest[ASIDE_Z, m] = dz if nearer else az


@compiled
def _note_closest(
    parent: Int32s,
    first: int,
    last: int,
    within: Floats2,
    beyond: Floats2,
    on_way: Floats2,
    aside_m: StridedFloats2,
    time_s: StridedFloats,
) -> None:
    """Fill in what is nearest on the ways themselves [nodes + 1, 5], and where [nodes, 3] and when
    [nodes] it is closest on them and straight on."""
    for n in range(first, last):
        p, m = parent[n], n - first
        nearer = within[GAP2, m] < on_way[p, GAP2]
        for row in range(5):
            on_way[n, row] = within[row, m] if nearer else on_way[p, row]
        nearer = beyond[GAP2, m] < on_way[n, GAP2]
        time_s[n] = beyond[WHEN, m] if nearer else on_way[n, WHEN]
        for axis in range(3):
            row = ASIDE_X + axis
            aside_m[n, axis] = beyond[row, m] if nearer else on_way[n, row]


@compiled
def _note_off(nearest: Floats2, many: int, side: Floats, least_cos: Floats, off: Ints) -> None:
    """Fill in [MANY] which of the cosines each of so many is too far by, in bits."""
    x, y, z = side[0], side[1], side[2]
    for m in range(many):
        ax, ay, az = nearest[ASIDE_X, m], nearest[ASIDE_Y, m], nearest[ASIDE_Z, m]
        nearest[ALONG, m] = ax * x + ay * y + az * z
        nearest[APART, m] = np.sqrt(ax * ax + ay * ay + az * az)
        off[m] = 0
    for c in range(len(least_cos)):
        cosine, bit = least_cos[c], 1 << c
        for m in range(many):
            off[m] |= bit if nearest[ALONG, m] < cosine * nearest[APART, m] else 0


@compiled
def _each_bit(bits: Ints, many: int) -> Bools2:
    """[many, n] whether each of the lowest bits of [n] is set."""
    found = np.empty((many, len(bits)), dtype=np.bool_)
    for c in range(many):
        found[c] = bits & (1 << c) != 0
    return found
