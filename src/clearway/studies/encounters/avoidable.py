"""Which encounters can be avoided at all: an exhaustive search over sequences of movements.

Breadth first over all sequences of an automaton, from level flight along x at the origin. A branch
ends where it comes nearer than allowed; the search ends where straight flight from there on stays
clear for good. Sequences that lead to the same state at the same time are followed once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.avoidance.clear.chord_distance import chord_distance
from clearway.base.arrays import Floats, Floats2, Ints
from clearway.base.compiled import compiled
from clearway.base.errors import ClearwayError
from clearway.base.grid import AvoidanceGrid
from clearway.reach.expand.lattice import LatticePieces, build_lattice
from clearway.vehicle.automaton import MovementAutomaton

MOST_MOVEMENTS = 12
"""Sequences of more movements are not looked at; straight flight follows on each."""
SAME = 1e-6
"""Places closer than this share of a movement are the same."""
PURSUIT_STEP = 0.1
PURSUIT_STEPS = 2000
"""Chords of a straight flight from a pursuer: their length in distances kept, and their number."""


class Opponent(NamedTuple):
    """What must not come near: straight flight, or all that bounded acceleration can do to it."""

    position_m: Floats
    """[3] now."""
    velocity_mps: Floats
    """[3]"""
    acceleration_mps2: float
    """Bound of what it may do across and along its way; 0 flies straight."""


class SearchFront(NamedTuple):
    """States that sequences of equally many movements lead to."""

    position_m: Floats2
    """[n, 3]"""
    yaw_rad: Floats
    """[n]"""
    attitude: Ints
    """[n] index into the lattice."""
    parent: Ints
    """[n] index into the front before."""
    movement: Ints
    """[n] the last movement."""


@dataclass(frozen=True, slots=True)
class SearchVerdict:
    """What the search found."""

    avoidable: bool
    movements: tuple[str, ...]
    """A sequence that stays clear, to be followed by straight flight; empty where none does."""
    for_good: bool
    """Straight flight after it stays clear however long; False where the search went no deeper."""
    looked_at: int
    """States that the search came through."""


def search_avoidance(
    automaton: MovementAutomaton,
    opponent: Opponent,
    keep_m: float,
    most_movements: int = MOST_MOVEMENTS,
    chosen_movements: int = MOST_MOVEMENTS,
) -> SearchVerdict:
    """Whether some sequence of movements keeps `keep_m` from the opponent at all times.

    After the first `chosen_movements` the last one is held, which makes longer sequences few. Where
    sequences of the greatest length still stay clear, one of them is the answer. Raises
    ClearwayError for an automaton without a straight movement.
    """
    pieces, straight = _pieces(automaton, most_movements)
    none = np.zeros(1, dtype=np.int64)
    front = SearchFront(np.zeros((1, 3)), np.zeros(1), none, none, none)
    fronts: list[SearchFront] = []
    elapsed, looked_at, found = 0.0, 0, -1
    while len(fronts) < most_movements:
        held = len(fronts) >= chosen_movements
        front, found = _grow(pieces, straight, held, front, elapsed, opponent, keep_m)
        front = _distinct(front, SAME * automaton.step_m, found)
        fronts.append(front)
        looked_at += len(front.yaw_rad)
        if found >= 0 or not len(front.yaw_rad):
            break
        elapsed += float(pieces.duration_s[0])
    if not len(front.yaw_rad):
        return SearchVerdict(False, (), False, looked_at)
    return SearchVerdict(True, _sequence(automaton, fronts), found >= 0, looked_at)


@lru_cache(maxsize=4)
def _pieces(automaton: MovementAutomaton, deep: int) -> tuple[LatticePieces, int]:
    """Movements from every attitude, and the one that flies straight."""
    straight = [n for n, movement in enumerate(automaton.movements) if not movement.turn_rate_rps]
    durations = {movement.duration_s for movement in automaton.movements}
    if not straight or len(durations) > 1:
        raise ClearwayError("avoidable: movements of one duration are needed, one of them straight")
    # The grid sets how finely movements are sampled: sixteen chords each.
    grid = AvoidanceGrid.uniform(automaton.step_m * deep, deep)
    pieces = build_lattice(automaton, grid, (0.0,), deep + 1).pieces
    return pieces, straight[0]


def _distinct(front: SearchFront, same_m: float, found: int) -> SearchFront:
    """Each state once; that one alone which the search has looked for."""
    if found >= 0:
        chosen = np.array([found])
    else:
        keys = np.column_stack(
            [
                np.rint(front.position_m / same_m),
                np.rint(front.yaw_rad * 1e6),
                front.attitude,
            ]
        ).astype(np.int64)
        chosen = np.sort(np.unique(keys, axis=0, return_index=True)[1])
    return SearchFront(
        front.position_m[chosen],
        front.yaw_rad[chosen],
        front.attitude[chosen],
        front.parent[chosen],
        front.movement[chosen],
    )


def _sequence(automaton: MovementAutomaton, fronts: list[SearchFront]) -> tuple[str, ...]:
    names, at = [], 0
    for front in reversed(fronts):
        names.append(automaton.names[front.movement[at]])
        at = int(front.parent[at])
    return tuple(reversed(names))


@compiled
def _chord_gap(
    start: Floats, end: Floats, start_s: float, end_s: float, opponent: Opponent
) -> float:
    """Least distance from a chord to all that the opponent can be meanwhile, from below.

    With bounded acceleration a and at most its present speed v that is the common part of two
    balls: a t^2 / 2 about its straight way, and v t about its place now.
    """
    p, u = opponent.position_m, opponent.velocity_mps
    ax, ay, az = start[0] - p[0], start[1] - p[1], start[2] - p[2]
    bx, by, bz = end[0] - p[0], end[1] - p[1], end[2] - p[2]
    ahead = chord_distance(
        0.0,
        0.0,
        0.0,
        ax - u[0] * start_s,
        ay - u[1] * start_s,
        az - u[2] * start_s,
        bx - u[0] * end_s,
        by - u[1] * end_s,
        bz - u[2] * end_s,
    )
    if opponent.acceleration_mps2 == 0.0:
        return float(ahead)
    here = chord_distance(0.0, 0.0, 0.0, ax, ay, az, bx, by, bz)
    speed = np.sqrt(u[0] ** 2 + u[1] ** 2 + u[2] ** 2)
    return float(max(ahead - 0.5 * opponent.acceleration_mps2 * end_s**2, here - speed * end_s))


@compiled
def _clear_for_good(
    place: Floats, velocity: Floats, time_s: float, opponent: Opponent, keep: float
) -> bool:
    """Whether straight flight stays clear from here on, however long."""
    p, u = opponent.position_m, opponent.velocity_mps
    # The nearest point of the relative way, or its start where it already leads away.
    off, closing = place - p - u * time_s, velocity - u
    speed2 = np.sum(closing**2)
    ahead_s = max(0.0, -np.sum(off * closing) / max(speed2, 1e-18))
    passes = bool(np.sum((off + ahead_s * closing) ** 2) >= keep * keep)
    if opponent.acceleration_mps2 == 0.0 or not passes:
        return passes
    speed = np.sqrt(np.sum(u**2))
    start, start_s = place.copy(), time_s
    step = PURSUIT_STEP * keep / max(np.sqrt(np.sum(velocity**2)), 1e-9)
    for _ in range(PURSUIT_STEPS):
        away = start - p
        distance = np.sqrt(np.sum(away**2))
        # Outrun: outside all that it can reach, and gaining on it ever after.
        if distance - speed * start_s >= keep and np.sum(away * velocity) >= speed * distance:
            return True
        end, end_s = start + step * velocity, start_s + step
        if _chord_gap(start, end, start_s, end_s, opponent) < keep:
            return False
        start, start_s = end, end_s
    return False


@compiled
def _grow(
    pieces: LatticePieces,
    straight: int,
    held: bool,
    front: SearchFront,
    start_s: float,
    opponent: Opponent,
    keep: float,
) -> tuple[SearchFront, int]:
    """All movements from a front that stay clear, and one of them with a clear way on, or -1."""
    position, yaw, attitude = front.position_m, front.yaw_rad, front.attitude
    movements, steps = pieces.path.shape[1], pieces.path.shape[2]
    most = len(yaw) * movements
    places, yaws = np.empty((most, 3)), np.empty(most)
    attitudes, parents = np.empty(most, np.int64), np.empty(most, np.int64)
    names = np.empty(most, np.int64)
    count, found = 0, -1
    before, after, velocity = np.empty(3), np.empty(3), np.empty(3)
    for n in range(len(yaw)):
        cos, sin = np.cos(yaw[n]), np.sin(yaw[n])
        for m in range(movements):
            reached = pieces.following[attitude[n], m]
            if reached < 0 or (held and m != front.movement[n]):
                continue
            duration = pieces.duration_s[m]
            before[:] = position[n]
            clear = True
            for q in range(steps):
                moved = pieces.path[attitude[n], m, q]
                after[0] = position[n, 0] + cos * moved[0] - sin * moved[1]
                after[1] = position[n, 1] + sin * moved[0] + cos * moved[1]
                after[2] = position[n, 2] + moved[2]
                from_s = start_s + duration * q / steps
                to_s = start_s + duration * (q + 1) / steps
                if _chord_gap(before, after, from_s, to_s, opponent) < keep:
                    clear = False
                    break
                before[:] = after
            if not clear:
                continue
            places[count] = after
            yaws[count] = yaw[n] + pieces.turn_rad[attitude[n], m]
            attitudes[count], parents[count], names[count] = reached, n, m
            on = pieces.path[reached, straight, steps - 1] / pieces.duration_s[straight]
            cos_on, sin_on = np.cos(yaws[count]), np.sin(yaws[count])
            velocity[0] = cos_on * on[0] - sin_on * on[1]
            velocity[1] = sin_on * on[0] + cos_on * on[1]
            velocity[2] = on[2]
            if found < 0 and _clear_for_good(after, velocity, start_s + duration, opponent, keep):
                found = count
            count += 1
    grown = SearchFront(
        places[:count], yaws[:count], attitudes[:count], parents[:count], names[:count]
    )
    return grown, found
