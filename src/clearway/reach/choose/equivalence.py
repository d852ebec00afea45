"""Trajectory equivalence (def. 9): the same way through state space, however it is cut or timed.

Two buffers may fly one way: two short movements straight on are one long one, and a slower turn of
the same radius is the same turn. Reach sets hold each way once.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clearway.base.frames import FloatArray
from clearway.reach.expand.buffers import ByteArray
from clearway.reach.expand.curves import BINOMIALS, value
from clearway.reach.expand.lattice import Lattice, LatticePieces
from clearway.reach.expand.replay import level_states
from clearway.vehicle.automaton import Movement, MovementAutomaton

SAME_SHARE = 1e-6
"""Ways that differ by less than that share of their length, and of a radian, are one."""
CHECKED = 32
"""Points at equal lengths at which ways are compared."""


def equivalent(
    automaton: MovementAutomaton,
    state: npt.ArrayLike,
    first: tuple[Movement, ...],
    second: tuple[Movement, ...],
    tolerance: float = SAME_SHARE,
) -> bool:
    """Whether two chains of movements from one state [6] are the same trajectory (3.13), def. 9.

    They are where states at equal lengths flown agree, up to `tolerance` times the length for
    positions and `tolerance` in radians for pitch and yaw; times and the number of movements
    (3.12) do not matter. Lengths are those of the movements' speeds, or of what is predicted where
    a table knows better.
    """
    one, two = _Way(automaton, state, first), _Way(automaton, state, second)
    longest = max(one.length_m, two.length_m)
    if abs(one.length_m - two.length_m) > tolerance * longest:
        return False
    if longest == 0.0:
        return bool(np.all(np.abs(one.end - two.end) <= tolerance))
    bound = np.array([tolerance * longest] * 3 + [tolerance] * 3)
    marks = np.unique(np.concatenate([one.marks_m, two.marks_m, _evenly(longest)]))
    return all(bool(np.all(np.abs(one.at(m) - two.at(m)) <= bound)) for m in marks)


def _evenly(length_m: float) -> FloatArray:
    return length_m * np.arange(1, CHECKED + 1) / CHECKED


class _Way:
    """A chain of movements, by the length flown."""

    def __init__(
        self, automaton: MovementAutomaton, state: npt.ArrayLike, chain: tuple[Movement, ...]
    ) -> None:
        self._automaton, self._chain = automaton, chain
        self._starts = [np.array(state, dtype=np.float64)]
        lengths = []
        for movement in chain:
            start = self._starts[-1]
            self._starts.append(automaton.predict(start, movement))
            lengths.append(_length_m(automaton, movement, start))
        self.marks_m = np.cumsum(lengths)
        """Lengths at which movements end."""

    @property
    def end(self) -> FloatArray:
        return self._starts[-1]

    @property
    def length_m(self) -> float:
        return float(self.marks_m[-1]) if len(self.marks_m) else 0.0

    def at(self, mark_m: float) -> FloatArray:
        """State [6] after a length."""
        number = int(np.searchsorted(self.marks_m, mark_m))
        if number >= len(self._chain):
            return self.end
        movement = self._chain[number]
        before = float(self.marks_m[number - 1]) if number else 0.0
        whole = float(self.marks_m[number]) - before
        share = (mark_m - before) / whole if whole > 0.0 else 1.0
        return self._automaton.predict(self._starts[number], movement, share * movement.duration_s)


def _length_m(automaton: MovementAutomaton, movement: Movement, start: FloatArray) -> float:
    if automaton.table is None:
        return movement.pace_mps * movement.duration_s
    times = movement.duration_s * np.arange(CHECKED + 1) / CHECKED
    points = np.array([automaton.predict(start, movement, float(time))[:3] for time in times])
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def each_way_once(
    buffers: ByteArray, lattice: Lattice, start_pitch_rad: float, tolerance: float = SAME_SHARE
) -> ByteArray:
    """The trajectories [n, deep] without those that are equivalent (def. 9) to another one.

    Of equivalent ones that with the fewest movements stays, then the first in their order. They
    pass the same cells, so coverage stays as it is. Those flown at another pace stay too, since
    they meet intruders at other times. Where no movement is the beginning of another there is
    nothing to look for, and nothing is done.
    """
    if not len(buffers) or not _some_begin_alike(lattice.pieces, tolerance):
        return buffers
    ends, attitudes = level_states(buffers, lattice.start[start_pitch_rad], lattice.pieces)
    ways = _points_of_ways(buffers, lattice, start_pitch_rad)
    movements = np.count_nonzero(buffers, axis=1)
    scale = max(float(np.max(np.abs(ends[:, :3]))), np.finfo(np.float64).tiny)
    ways[..., :3] /= scale
    features = np.concatenate([ways.reshape(len(ways), -1), ends[:, 3:]], axis=1)
    order = np.lexsort((np.arange(len(buffers)), movements))
    kept = np.ones(len(buffers), dtype=np.bool_)
    # Candidates share attitude and, up to rounding either way, the place of their end.
    nearest: dict[tuple[int, ...], list[int]] = {}
    for n in order.tolist():
        place = ends[n] / np.array([scale, scale, scale, 1.0]) / (4.0 * tolerance)
        low = np.floor(place - 0.5).astype(np.int64)
        keys = {(int(attitudes[n]), *(low + shift).tolist()) for shift in np.ndindex(2, 2, 2, 2)}
        rivals = {other for key in keys for other in nearest.get(key, ())}
        if any(np.max(np.abs(features[n] - features[other])) <= tolerance for other in rivals):
            kept[n] = False
            continue
        for key in keys:
            nearest.setdefault(key, []).append(n)
    return buffers[kept]


def _some_begin_alike(pieces: LatticePieces, tolerance: float) -> bool:
    """Whether any movement flies as another one begins, from any attitude.

    Two different ways part where their movements first differ, unless one of these is the
    beginning of the other.
    """
    allowed = pieces.following >= 0
    for at in range(len(pieces.following)):
        length = pieces.length_m[at]
        for short in np.flatnonzero(allowed[at]):
            for long in np.flatnonzero(allowed[at]):
                if short == long or length[short] > length[long] * (1.0 + tolerance):
                    continue
                if _begins_alike(pieces, at, int(short), int(long), tolerance):
                    return True
    return False


def _begins_alike(pieces: LatticePieces, at: int, short: int, long: int, tolerance: float) -> bool:
    whole = float(pieces.length_m[at, long])
    ratio = float(pieces.length_m[at, short]) / whole if whole > 0.0 else 1.0
    turn = np.array([pieces.turn_rad[at, short], pieces.turn_rad[at, long] * ratio])
    times = pieces.duration_s[short], pieces.duration_s[long] * ratio
    if abs(turn[0] - turn[1]) > tolerance or abs(times[0] - times[1]) > tolerance * times[1]:
        return False
    for share in (0.5, 1.0):
        one = _point(pieces, at, short, share)
        two = _point(pieces, at, long, share * min(1.0, ratio))
        if np.max(np.abs(one - two)) > tolerance * max(whole, np.finfo(np.float64).tiny):
            return False
    return True


def _point(pieces: LatticePieces, at: int, movement: int, share: float) -> FloatArray:
    """[3] displacement of a movement after a share of its time."""
    parts = pieces.curve[at, movement]
    place = share * len(parts)
    part = min(int(place), len(parts) - 1)
    scaled = parts[part] * BINOMIALS[:, None]
    point = [value(np.ascontiguousarray(scaled[:, axis]), place - part) for axis in range(3)]
    return np.array(point)


def _points_of_ways(buffers: ByteArray, lattice: Lattice, start_pitch_rad: float) -> FloatArray:
    """[n, CHECKED, 4] places of each trajectory at equal lengths, and when it is there.

    Level frame; times count in the longest movement's duration.
    """
    pieces = lattice.pieces
    points = np.empty((len(buffers), CHECKED, 4))
    for n, row in enumerate(buffers):
        chain: list[tuple[int, int]] = []
        starts = [np.zeros(4)]
        at = lattice.start[start_pitch_rad]
        for movement in row[row > 0].astype(np.int64) - 1:
            chain.append((at, int(movement)))
            x, y, z, yaw = starts[-1]
            turned = _turn(pieces.path[at, movement, -1], yaw) + np.array([x, y, z])
            starts.append(np.array([*turned, yaw + pieces.turn_rad[at, movement]]))
            at = int(pieces.following[at, movement])
        marks = np.cumsum([pieces.length_m[piece] for piece in chain])
        durations = pieces.duration_s[[movement for _, movement in chain]]
        for k, mark in enumerate(_evenly(float(marks[-1]))):
            number = min(int(np.searchsorted(marks, mark)), len(chain) - 1)
            before = float(marks[number - 1]) if number else 0.0
            whole = float(marks[number]) - before
            share = (mark - before) / whole if whole > 0.0 else 1.0
            local = _point(pieces, *chain[number], min(1.0, share))
            points[n, k, :3] = starts[number][:3] + _turn(local, float(starts[number][3]))
            flown = durations[:number].sum() + min(1.0, share) * durations[number]
            points[n, k, 3] = flown / np.max(pieces.duration_s)
    return points


def _turn(vector: FloatArray, yaw: float) -> FloatArray:
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return np.array(
        [cosine * vector[0] - sine * vector[1], sine * vector[0] + cosine * vector[1], vector[2]]
    )
