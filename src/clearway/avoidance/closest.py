"""When and where ways come closest to what flies straight on, each flown on from its end."""

from __future__ import annotations

import numpy as np

from clearway.base.compiled import borrowing, compiled
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IndexArray

# Columns of the chords of a movement: where one begins, how fast it is flown, from when and how
# long; of the nearest on a way: distance squared, time and what lies between.
CHORD_X, CHORD_Y, CHORD_Z, SPEED_X, SPEED_Y, SPEED_Z, BEGUN, LASTS = range(8)
GAP2, WHEN, ASIDE_X, ASIDE_Y, ASIDE_Z = range(5)


@compiled
def closest(
    parent: IndexArray,
    samples: FloatArray,
    end_time_s: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """[nodes, k, 3] from the vehicle to each of k (places and velocities [k, 3]) when they are
    closest on the way to a node and straight on from there, and [nodes, k] when that is.

    parent [nodes], samples [nodes, s, 3] and end times [nodes] as a reach set has them.
    """
    nodes, many = len(parent), len(place)
    aside_m, time_s = np.empty((nodes, many, 3)), np.empty((nodes, many))
    on_way, chords = np.empty((nodes, many, 5)), np.empty((samples.shape[1] + 1, 8))
    for n in range(nodes):
        _note_chords(parent, samples, end_time_s, n, chords)
        _note_closest(parent[n], n, chords, place, velocity, on_way, aside_m[n], time_s[n])
    return aside_m, time_s


@compiled
def off_sides(
    parent: IndexArray,
    samples: FloatArray,
    end_time_s: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
    sides: FloatArray,
    least_cos: FloatArray,
) -> BoolArray:
    """[c, nodes] whether the way to a node is closest to any of k too far from its side [k, 3]: by
    each of c cosines of the angle between."""
    nodes, many = len(parent), len(place)
    off = np.zeros((len(least_cos), nodes), dtype=np.bool_)
    aside_m, time_s = np.empty((many, 3)), np.empty(many)
    on_way, chords = np.empty((nodes, many, 5)), np.empty((samples.shape[1] + 1, 8))
    for n in range(nodes):
        _note_chords(parent, samples, end_time_s, n, chords)
        _note_closest(parent[n], n, chords, place, velocity, on_way, aside_m, time_s)
        _note_off(aside_m, sides, least_cos, off[:, n])
    return off


@borrowing
def closest_s(
    dx: float, dy: float, dz: float, cx: float, cy: float, cz: float, longest_s: float
) -> float:
    """When two that move straight on are closest: what lies between them, and how that changes."""
    speed2 = cx * cx + cy * cy + cz * cz
    if speed2 <= 0.0:
        return 0.0
    return min(longest_s, max(0.0, -(dx * cx + dy * cy + dz * cz) / speed2))


@borrowing
def _note_chords(
    parent: IndexArray, samples: FloatArray, end_time_s: FloatArray, n: int, chords: FloatArray
) -> None:
    """Fill in the chords [s + 1, 8] of the movement that leads to a node; the last goes on."""
    count, p, begun_s = samples.shape[1], parent[n], 0.0
    x, y, z = 0.0, 0.0, 0.0
    if p >= 0:
        begun_s = end_time_s[p]
        x, y, z = samples[p, count - 1, 0], samples[p, count - 1, 1], samples[p, count - 1, 2]
    step_s = (end_time_s[n] - begun_s) / count
    ux, uy, uz = 0.0, 0.0, 0.0
    for q in range(count + 1):
        last = q == count
        chords[q, CHORD_X], chords[q, CHORD_Y], chords[q, CHORD_Z] = x, y, z
        if not last:
            ux = (samples[n, q, 0] - x) / step_s
            uy = (samples[n, q, 1] - y) / step_s
            uz = (samples[n, q, 2] - z) / step_s
            x, y, z = samples[n, q, 0], samples[n, q, 1], samples[n, q, 2]
        chords[q, SPEED_X], chords[q, SPEED_Y], chords[q, SPEED_Z] = ux, uy, uz
        chords[q, BEGUN], chords[q, LASTS] = begun_s, np.inf if last else step_s
        begun_s = begun_s + step_s


@borrowing
def _note_closest(
    p: int,
    n: int,
    chords: FloatArray,
    place: FloatArray,
    velocity: FloatArray,
    on_way: FloatArray,
    aside_m: FloatArray,
    time_s: FloatArray,
) -> None:
    """Fill in where [k, 3] and when [k] each is closest on the way to node n, whose parent is p.

    on_way: [nodes, k, 5] what is so on the way itself, which sequels begin with.
    """
    last = len(chords) - 1
    for k in range(len(place)):
        px, py, pz = place[k, 0], place[k, 1], place[k, 2]
        vx, vy, vz = velocity[k, 0], velocity[k, 1], velocity[k, 2]
        nearest2, nearest_s = px * px + py * py + pz * pz, 0.0
        ax, ay, az = px, py, pz
        if p >= 0:
            nearest2, nearest_s = on_way[p, k, GAP2], on_way[p, k, WHEN]
            ax, ay, az = on_way[p, k, ASIDE_X], on_way[p, k, ASIDE_Y], on_way[p, k, ASIDE_Z]
        for q in range(last + 1):
            if q == last:
                on_way[n, k, GAP2], on_way[n, k, WHEN] = nearest2, nearest_s
                on_way[n, k, ASIDE_X], on_way[n, k, ASIDE_Y], on_way[n, k, ASIDE_Z] = ax, ay, az
            begun_s = chords[q, BEGUN]
            cx, cy, cz = vx - chords[q, SPEED_X], vy - chords[q, SPEED_Y], vz - chords[q, SPEED_Z]
            dx = px + begun_s * vx - chords[q, CHORD_X]
            dy = py + begun_s * vy - chords[q, CHORD_Y]
            dz = pz + begun_s * vz - chords[q, CHORD_Z]
            after_s = closest_s(dx, dy, dz, cx, cy, cz, chords[q, LASTS])
            dx, dy, dz = dx + after_s * cx, dy + after_s * cy, dz + after_s * cz
            gap2 = dx * dx + dy * dy + dz * dz
            # Which is nearest cannot be foretold, so no branch asks.
            nearer = gap2 < nearest2
            nearest2 = gap2 if nearer else nearest2
            nearest_s = begun_s + after_s if nearer else nearest_s
            ax = dx if nearer else ax
            ay = dy if nearer else ay
            az = dz if nearer else az
        aside_m[k, 0], aside_m[k, 1], aside_m[k, 2] = ax, ay, az
        time_s[k] = nearest_s


@borrowing
def _note_off(
    aside_m: FloatArray, sides: FloatArray, least_cos: FloatArray, off: BoolArray
) -> None:
    for k in range(len(aside_m)):
        x, y, z = aside_m[k, 0], aside_m[k, 1], aside_m[k, 2]
        along = x * sides[k, 0] + y * sides[k, 1] + z * sides[k, 2]
        apart = np.sqrt(x * x + y * y + z * z)
        for c in range(len(least_cos)):
            if along < least_cos[c] * apart:
                off[c] = True
