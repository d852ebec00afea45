"""Escapes from one attitude: short beginnings, breadth first, and a loop after each."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Ints
from clearway.base.brief import brief
from clearway.base.frames import FloatArray
from clearway.reach.escapes.legs import Legs, pose_on
from clearway.vehicle.automaton import MovementAutomaton

BEGINNINGS = ((2, 6), (3, 4))
"""How often another movement follows in a beginning at most, and how many movements it has at most:
one more change leads past what is near, and pays in short beginnings alone."""
MOST_DEPTH = max(depth for _, depth in BEGINNINGS)
"""Movements of a beginning."""
MOST_ESCAPES = 24000
"""From one attitude."""


class Ways(NamedTuple):
    """Escapes from one attitude: beginnings as a tree, and a loop after each."""

    parent: Ints
    """[beginnings] the first is the empty one, -1; parents come first."""
    movement: Ints
    """[beginnings] that leads there from the parent; -1 for the empty one."""
    attitude: Ints
    """[beginnings] at the end."""
    begins: Ints
    """[escapes] the beginning of each, the shorter ones first."""
    loop: Ints
    """[escapes] its loop."""
    loop_attitude: Ints
    """[loops] that it begins and ends with."""
    loop_at: Ints
    """[loops + 1] where the movements of each begin."""
    loop_movement: Ints
    """[...]"""

    def __repr__(self) -> str:
        return brief(self)


class _Begun(NamedTuple):
    """A beginning of escapes."""

    parent: int
    movement: int
    """The last one; -1 for the empty beginning."""
    attitude: int
    pose: FloatArray
    """[4] place and yaw at its end."""
    changes: int
    """How often another movement follows."""
    depth: int


def ways_from(
    automaton: MovementAutomaton,
    legs: Legs,
    loops: list[tuple[tuple[int, ...], ...]],
    start: int,
) -> Ways:
    """Beginnings, the shorter ones first, each place and attitude once, with every loop after
    each."""
    tree = _beginnings(automaton, legs, start)
    chosen: list[tuple[int, int]] = []
    numbers: dict[tuple[int, tuple[int, ...]], int] = {}
    for at, begun in enumerate(tree):
        for loop in loops[begun.attitude]:
            if _may_follow(automaton, begun.movement, loop[0]):
                which = numbers.setdefault((begun.attitude, loop), len(numbers))
                chosen.append((at, which))
    chosen = chosen[:MOST_ESCAPES]
    lengths = [len(loop) for _, loop in numbers]
    return Ways(
        np.array([begun.parent for begun in tree], dtype=np.int64),
        np.array([begun.movement for begun in tree], dtype=np.int64),
        np.array([begun.attitude for begun in tree], dtype=np.int64),
        np.array([begins for begins, _ in chosen], dtype=np.int64),
        np.array([loop for _, loop in chosen], dtype=np.int64),
        np.array([begins for begins, _ in numbers], dtype=np.int64),
        np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        np.array([m for _, loop in numbers for m in loop], dtype=np.int64),
    )


def _beginnings(automaton: MovementAutomaton, legs: Legs, start: int) -> list[_Begun]:
    """All beginnings from an attitude by their length, parents first."""
    tree = [_Begun(-1, -1, start, np.zeros(4), 0, 0)]
    known = {_key(np.zeros(4), start, 1.0)}
    for most_changes, most_depth in BEGINNINGS:
        for at, begun in enumerate(tree):  # It grows as it is gone through.
            if begun.depth < most_depth:
                tree += _grow(automaton, legs, begun, at, known, most_changes)
    order = sorted(range(len(tree)), key=lambda at: tree[at].depth)
    number = {at: place for place, at in enumerate(order)}
    return [tree[at]._replace(parent=number.get(tree[at].parent, -1)) for at in order]


def _grow(
    automaton: MovementAutomaton,
    legs: Legs,
    begun: _Begun,
    at: int,
    known: set[tuple[int, ...]],
    most_changes: int,
) -> Iterator[_Begun]:
    """Beginnings that are longer by one movement and lead where none has led; they become known."""
    for m, end in enumerate(legs.following[begun.attitude].tolist()):
        changes = begun.changes + (m != begun.movement)
        if end < 0 or changes > most_changes or not _may_follow(automaton, begun.movement, m):
            continue
        pose = pose_on(begun.pose, legs.path[begun.attitude, m, -1])
        key = _key(pose, end, automaton.step_m or 1.0)
        if key not in known:
            known.add(key)
            yield _Begun(at, m, end, pose, changes, begun.depth + 1)


def _may_follow(automaton: MovementAutomaton, before: int, after: int) -> bool:
    names = automaton.names
    return before < 0 or (names[before], names[after]) not in automaton.forbidden


def _key(pose: FloatArray, attitude: int, step_m: float) -> tuple[int, ...]:
    """Equal for beginnings that lead to about the same."""
    where = np.round(pose[:3] / (0.1 * step_m)).astype(int).tolist()
    return (*where, round(pose[3] / 0.05), attitude)
