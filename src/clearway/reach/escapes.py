"""Ways to stay safe for ever: short beginnings, and what can be flown on and on after them.

A vehicle that can stop holds its place; one that cannot flies loops that close. Loops are found,
not written down: of all turning movements, level circles, ovals, and circles that climb on one half
and sink on the other, which closes as exactly in less room. Whatever closes from an attitude may
follow any beginning that leads to that attitude.

Everything is kept as movements between attitudes, not as places: `legs_at` says where they lead
from the attitude that the vehicle really has.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from clearway.base.brief import brief, one_line
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.paths import MovementPaths, movement_paths

SAMPLES = 8
"""Places along a movement that are looked at."""
SAME_RAD = 1e-6
"""Attitudes no farther apart are one."""
CLOSES = 1e-6
"""Of its length, by which a loop may miss its start."""
MOST_ATTITUDES = 64
MOST_DEPTH = 6
"""Movements of a beginning."""
MOST_ESCAPES = 8000
"""From one attitude."""
MOST_LIBRARIES = 64
"""Kept in a process."""
MOST_TURNS = 400
"""Movements of a loop."""
STRAIGHTS = (1, 2, 3)
"""Movements straight on between the half turns of an oval."""


class Legs(NamedTuple):
    """Where every movement leads from every attitude, as compiled loops take it."""

    path: FloatArray
    """[attitudes, movements, SAMPLES, 4] x, y, z and yaw along it, from the origin at yaw 0."""
    sagitta_m: FloatArray
    """[attitudes, movements] how far the path may lie from chords between its samples."""
    following: IntArray
    """[attitudes, movements] attitude at its end; -1 where it may not be flown."""
    duration_s: FloatArray
    """[movements]"""

    def __repr__(self) -> str:
        return brief(self)


class Ways(NamedTuple):
    """Escapes from one attitude: beginnings as a tree, and a loop after each."""

    parent: IntArray
    """[beginnings] the first is the empty one, -1; parents come first."""
    movement: IntArray
    """[beginnings] that leads there from the parent; -1 for the empty one."""
    attitude: IntArray
    """[beginnings] at the end."""
    begins: IntArray
    """[escapes] the beginning of each, the shorter ones first."""
    loop: IntArray
    """[escapes] its loop."""
    loop_attitude: IntArray
    """[loops] that it begins and ends with."""
    loop_at: IntArray
    """[loops + 1] where the movements of each begin."""
    loop_movement: IntArray
    """[...]"""

    def __repr__(self) -> str:
        return brief(self)


@dataclass(frozen=True, eq=False)
class EscapeLibrary:
    """All ways of an automaton to stay safe for ever, by the attitude that they begin from."""

    automaton: MovementAutomaton
    attitudes: FloatArray
    """[attitudes, 2] roll and pitch."""
    legs: Legs
    ways: tuple[Ways, ...]
    """[attitudes]"""
    reach_m: float
    """How far an escape may lead from where it begins."""

    @classmethod
    def of(cls, automaton: MovementAutomaton) -> EscapeLibrary:
        """Find them; takes a fraction of a second, once for an automaton."""
        paths = movement_paths(automaton, SAMPLES)
        attitudes, following = _attitudes(automaton, paths)
        legs = _legs(paths, attitudes, following, automaton)
        key = _content(automaton, legs)
        if key not in _found:
            while len(_found) >= MOST_LIBRARIES:
                del _found[next(iter(_found))]
            _found[key] = _searched(automaton, legs)
        return cls(automaton, attitudes, legs, *_found[key])

    def __repr__(self) -> str:
        count = [len(ways.begins) for ways in self.ways]
        facts = (f"{len(count)} attitudes", f"{min(count)} to {max(count)} escapes from each")
        return one_line("EscapeLibrary", facts)

    @cached_property
    def key(self) -> bytes:
        """Equal where the same escapes are found."""
        return _content(self.automaton, self.legs)

    @property
    def exists(self) -> bool:
        """Whether there is any way to stay safe for ever, from level flight on."""
        return bool(len(self.ways[0].begins))

    def nearest(self, roll_rad: float, pitch_rad: float) -> int:
        """The attitude that is nearest."""
        away = np.hypot(self.attitudes[:, 0] - roll_rad, self.attitudes[:, 1] - pitch_rad)
        return int(np.argmin(away))

    def legs_at(self, roll_rad: float, pitch_rad: float) -> Legs:
        """Where movements lead if the nearest attitude is really this one, and all others are off
        by as much."""
        off = np.array([roll_rad, pitch_rad]) - self.attitudes[self.nearest(roll_rad, pitch_rad)]
        if np.all(np.abs(off) <= SAME_RAD):
            return self.legs
        paths = movement_paths(self.automaton, SAMPLES)
        attitudes = self.attitudes + off
        return _legs(paths, attitudes, self._within_limit(attitudes), self.automaton)

    def closes_along(self, legs: Legs) -> bool:
        """Whether loops lead back to where they begin where movements lead along these: always from
        the attitudes of the library, and from others where tilt does not matter."""
        if legs is self.legs:
            return True
        off_m = float(np.abs(legs.path - self.legs.path).max())
        return off_m <= CLOSES * max(self.automaton.step_m, 1e-9)

    def _within_limit(self, attitudes: FloatArray) -> IntArray:
        """[attitudes, movements] as of the legs, without what does not lead back from beyond the
        limit; where nothing leads back, without what leads farther beyond it."""
        following, limit = self.legs.following, self.automaton.pitch_limit_rad
        if limit is None:
            return following
        ends = np.abs(attitudes[following, 1])
        starts = np.abs(attitudes[:, 1])[:, None]
        beyond = ends > limit + SAME_RAD
        back = np.where(beyond & (ends >= starts - SAME_RAD), -1, following)
        stays = np.where(beyond & (ends > starts + SAME_RAD), -1, following)
        return np.where((back >= 0).any(axis=1, keepdims=True), back, stays)


def _attitudes(automaton: MovementAutomaton, paths: MovementPaths) -> tuple[FloatArray, IntArray]:
    """Attitudes that movements lead to from level flight, and from which to which."""
    found = [(0.0, 0.0)]
    following: list[list[int]] = []
    while len(following) < len(found):
        roll, pitch = found[len(following)]
        ends = paths(roll, pitch)[:, -1, 3:5]
        row = []
        for movement, (next_roll, next_pitch) in zip(automaton.movements, ends, strict=True):
            state = np.array([0.0, 0.0, 0.0, roll, pitch, 0.0])
            row.append(-1)
            if not automaton.allowed(state, movement):
                continue
            same = [
                n
                for n, (r, p) in enumerate(found)
                if abs(r - next_roll) <= SAME_RAD and abs(p - next_pitch) <= SAME_RAD
            ]
            if not same and len(found) < MOST_ATTITUDES:
                same = [len(found)]
                found.append((float(next_roll), float(next_pitch)))
            row[-1] = same[0] if same else -1
        following.append(row)
    return np.array(found), np.array(following, dtype=np.int64)


def _legs(
    paths: MovementPaths,
    attitudes: FloatArray,
    following: IntArray,
    automaton: MovementAutomaton,
) -> Legs:
    along = np.array([paths(roll, pitch) for roll, pitch in attitudes.tolist()])
    chords = np.diff(along[..., :3], axis=2, prepend=0.0)
    length = np.sqrt(np.einsum("amsi,amsi->ams", chords, chords)).sum(axis=2)
    bend = np.hypot(along[:, :, -1, 5], along[:, :, -1, 4] - attitudes[:, 1, None])
    return Legs(
        np.ascontiguousarray(along[..., [0, 1, 2, 5]]),
        length * bend / (8.0 * SAMPLES**2),
        following,
        np.array([movement.duration_s for movement in automaton.movements]),
    )


_found: dict[bytes, tuple[tuple[Ways, ...], float]] = {}
"""What was searched in this process: planners of one vehicle differ mostly by their settings."""


def _content(automaton: MovementAutomaton, legs: Legs) -> bytes:
    """Equal where the same escapes are found."""
    flown = [(each.name, each.inputs.tolist()) for each in automaton.movements]
    told = repr((flown, sorted(automaton.forbidden), automaton.pitch_limit_rad))
    digest = hashlib.sha256(told.encode())
    for array in legs:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.digest()


def _searched(automaton: MovementAutomaton, legs: Legs) -> tuple[tuple[Ways, ...], float]:
    """Escapes by attitude, and how far one may lead."""
    attitudes = range(len(legs.following))
    loops = [tuple(_loops(automaton, legs, at)) for at in attitudes]
    ways = tuple(_ways(automaton, legs, loops, at) for at in attitudes)
    widest_m = max(
        (_extent_m(legs, at, loop) for at, each in enumerate(loops) for loop in each), default=0.0
    )
    return ways, MOST_DEPTH * automaton.step_m + widest_m


# --- loops --------------------------------------------------------------------------------


def _loops(automaton: MovementAutomaton, legs: Legs, start: int) -> Iterator[tuple[int, ...]]:
    """Movements that can be flown for ever from an attitude, the least room first."""
    seen = set()
    for loop in (*_standing(legs, start), *_circles(legs, start), *_climbing(legs, start)):
        if loop not in seen and _goes_round(automaton, legs, start, loop):
            seen.add(loop)
            yield loop


def _standing(legs: Legs, start: int) -> Iterator[tuple[int, ...]]:
    """Movements that lead nowhere: holding, and turning on the spot."""
    step = np.abs(legs.path[..., :3]).max()
    order = np.argsort(np.abs(legs.path[start, :, -1, 3]), kind="stable")
    for movement in order.tolist():
        stays = np.abs(legs.path[start, movement, :, :3]).max() <= 1e-9 * step
        if stays and legs.following[start, movement] == start:
            yield (movement,)


def _circles(legs: Legs, start: int) -> Iterator[tuple[int, ...]]:
    """One turning movement over and over, and ovals of it and one that leads straight on."""
    turns = legs.path[start, :, -1, 3]
    straight = [
        m
        for m in range(len(turns))
        if abs(turns[m]) < 1e-9 and legs.following[start, m] == start and legs.path[start, m, -1, 0]
    ]
    turning = [m for m in range(len(turns)) if abs(turns[m]) > 1e-6]
    level = [m for m in turning if legs.following[start, m] == start]
    for movement in sorted(level, key=lambda m: -abs(turns[m])):
        count = int(np.ceil(2.0 * np.pi / abs(turns[movement]) - 1e-6))
        if count > MOST_TURNS:
            continue
        yield (movement,) * count
        if count % 2 == 0:
            for ahead in straight[:1]:
                for number in STRAIGHTS:
                    half = (ahead,) * number + (movement,) * (count // 2)
                    yield half + half


def _climbing(legs: Legs, start: int) -> Iterator[tuple[int, ...]]:
    """Circles that climb on one half and sink on the other, begun anywhere on them.

    With turning movements that keep the attitude, raise it and lower it by one step each.
    """
    for keep, up, down in _steps(legs):
        turn = abs(legs.path[0, keep, -1, 3])
        count = round(2.0 * np.pi / turn)
        if count % 2 or count > MOST_TURNS or abs(count * turn - 2.0 * np.pi) > CLOSES:
            continue
        half = count // 2
        for steps in range(1, half // 2 + 1):
            one = (up,) * steps + (keep,) * (half - 2 * steps) + (down,) * steps
            other = (down,) * steps + (keep,) * (half - 2 * steps) + (up,) * steps
            turns = one + other
            reached = _attitudes_along(legs, 0, turns)
            if reached is None:
                break
            begins = [at for at in range(count) if reached[at] == start]
            for at in _spread(begins):
                yield turns[at:] + turns[:at]


def _spread(begins: list[int]) -> list[int]:
    """Of places on a loop that lie next to each other, the first, the middle and the last."""
    runs: list[list[int]] = []
    for at in begins:
        if runs and at == runs[-1][-1] + 1:
            runs[-1].append(at)
        else:
            runs.append([at])
    return [at for run in runs for at in sorted({run[0], run[len(run) // 2], run[-1]})]


def _steps(legs: Legs) -> Iterator[tuple[int, int, int]]:
    """Turning movements that belong together: one keeps level flight, two change it."""
    turns, following = legs.path[0, :, -1, 3], legs.following
    for keep in range(len(turns)):
        if abs(turns[keep]) < 1e-6 or following[0, keep] != 0:
            continue
        alike = np.flatnonzero(np.abs(turns - turns[keep]) < 1e-9)
        for up in alike.tolist():
            for down in alike.tolist():
                raised = following[0, up]
                if raised > 0 and following[0, down] > 0 and following[raised, down] == 0:
                    yield keep, up, down


def _attitudes_along(legs: Legs, start: int, loop: tuple[int, ...]) -> list[int] | None:
    """Attitude before each movement of a loop; None where one may not be flown, or it ends
    in another than it began with."""
    at, reached = start, []
    for movement in loop:
        reached.append(at)
        at = int(legs.following[at, movement])
        if at < 0:
            return None
    return reached if at == start else None


def _goes_round(
    automaton: MovementAutomaton, legs: Legs, start: int, loop: tuple[int, ...]
) -> bool:
    """Whether a loop may be flown for ever, and does not lead away.

    It ends where it began; or it is one level turn over and over, whose arcs lie on one circle
    wherever they begin on it.
    """
    reached = _attitudes_along(legs, start, loop)
    if reached is None:
        return False
    names = [automaton.names[movement] for movement in loop]
    if any(pair in automaton.forbidden for pair in zip(names, names[1:] + names[:1], strict=True)):
        return False
    place, yaw, length = np.zeros(3), 0.0, 0.0
    for attitude, movement in zip(reached, loop, strict=True):
        step = legs.path[attitude, movement, -1]
        cosine, sine = np.cos(yaw), np.sin(yaw)
        place += [cosine * step[0] - sine * step[1], sine * step[0] + cosine * step[1], step[2]]
        yaw += step[3]
        length += float(np.linalg.norm(step[:3]))
    turned = abs((yaw + np.pi) % (2.0 * np.pi) - np.pi)
    if np.linalg.norm(place) <= CLOSES * length and turned <= CLOSES:
        return True
    return len(set(loop)) == 1 and _is_arc(legs.path[start, loop[0]])


def _extent_m(legs: Legs, start: int, loop: tuple[int, ...]) -> float:
    """How far a loop leads from where it begins."""
    pose, at, farthest = np.zeros(4), start, 0.0
    for movement in loop:
        pose = _after(pose, legs.path[at, movement, -1])
        at = int(legs.following[at, movement])
        farthest = max(farthest, float(np.linalg.norm(pose[:3])))
    return farthest


def _is_arc(path: FloatArray) -> bool:
    """Whether a movement [SAMPLES, 4] is a level arc of the circle that repeating it goes round."""
    step, turn = path[-1, :3], path[-1, 3]
    size = float(np.abs(path[:, :3]).max())
    if abs(turn) < 1e-6 or np.abs(path[:, 2]).max() > 1e-9 * size:
        return False
    # Turned by its own angle about the centre, the start becomes the end.
    away = 0.5 / np.tan(0.5 * turn)
    center = np.array([0.5 * step[0] - away * step[1], 0.5 * step[1] + away * step[0]])
    radii = np.hypot(path[:, 0] - center[0], path[:, 1] - center[1])
    return bool(np.abs(radii - np.hypot(*center)).max() <= CLOSES * size)


# --- beginnings ---------------------------------------------------------------------------


def _ways(
    automaton: MovementAutomaton,
    legs: Legs,
    loops: list[tuple[tuple[int, ...], ...]],
    start: int,
) -> Ways:
    """Beginnings breadth first, each place and attitude once, with every loop after each."""
    parent, movement, attitude = [-1], [-1], [start]
    pose, runs, generation = [np.zeros(4)], [0], [0]
    known = {_key(np.zeros(4), start, 1.0)}
    step_m = automaton.step_m or 1.0
    chosen: list[tuple[int, int]] = []
    numbers: dict[tuple[int, tuple[int, ...]], int] = {}
    at = 0
    while at < len(parent) and len(chosen) < MOST_ESCAPES:
        for loop in loops[attitude[at]]:
            before = "" if movement[at] < 0 else automaton.names[movement[at]]
            if (before, automaton.names[loop[0]]) not in automaton.forbidden:
                which = numbers.setdefault((attitude[at], loop), len(numbers))
                chosen.append((at, which))
        if generation[at] < MOST_DEPTH:
            for m, end in enumerate(legs.following[attitude[at]].tolist()):
                changes = runs[at] + (m != movement[at])
                if end < 0 or changes > 2:
                    continue
                if movement[at] >= 0 and (
                    (automaton.names[movement[at]], automaton.names[m]) in automaton.forbidden
                ):
                    continue
                after = _after(pose[at], legs.path[attitude[at], m, -1])
                key = _key(after, end, step_m)
                if key in known:
                    continue
                known.add(key)
                parent.append(at)
                movement.append(m)
                attitude.append(end)
                pose.append(after)
                runs.append(changes)
                generation.append(generation[at] + 1)
        at += 1
    chosen = chosen[:MOST_ESCAPES]
    lengths = [len(loop) for _, loop in numbers]
    return Ways(
        np.array(parent, dtype=np.int64),
        np.array(movement, dtype=np.int64),
        np.array(attitude, dtype=np.int64),
        np.array([begins for begins, _ in chosen], dtype=np.int64),
        np.array([loop for _, loop in chosen], dtype=np.int64),
        np.array([begins for begins, _ in numbers], dtype=np.int64),
        np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        np.array([m for _, loop in numbers for m in loop], dtype=np.int64),
    )


def _after(pose: FloatArray, step: FloatArray) -> FloatArray:
    """Place and yaw [4] after a step [4] from a pose [4]."""
    cosine, sine = np.cos(pose[3]), np.sin(pose[3])
    after = pose.copy()
    after[0] += cosine * step[0] - sine * step[1]
    after[1] += sine * step[0] + cosine * step[1]
    after[2:] += step[2:]
    return after


def _key(pose: FloatArray, attitude: int, step_m: float) -> tuple[int, ...]:
    """Equal for beginnings that lead to about the same."""
    where = np.round(pose[:3] / (0.1 * step_m)).astype(int).tolist()
    return (*where, round(pose[3] / 0.05), attitude)


def names_of(
    library: EscapeLibrary, ways: Ways, escape: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Movements of an escape, of the library's or others: its beginning, and its loop."""
    names = library.automaton.names
    if not 0 <= escape < len(ways.begins):
        raise ClearwayError(f"escape {escape}: there are {len(ways.begins)}")
    begins: list[str] = []
    at = int(ways.begins[escape])
    while ways.parent[at] >= 0:
        begins.insert(0, names[ways.movement[at]])
        at = int(ways.parent[at])
    loop = int(ways.loop[escape])
    first, last = ways.loop_at[loop], ways.loop_at[loop + 1]
    return tuple(begins), tuple(names[m] for m in ways.loop_movement[first:last])
