"""Turn for a while, then fly straight: the trajectories that every flying set holds.

Yaw and pitch turns are independent: k movements with one yaw turn, n movements with one pitch
turn, both from the start, and straight from there on. What can stop may also turn on the spot,
wait, fly slower or climb for a while before it flies straight ahead.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.reach.expand.buffers import ByteArray
from clearway.reach.expand.lattice import Lattice, standing_deep
from clearway.reach.expand.replay import complete_buffers
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.inertialess import InertialessModel

TURNS_RAD = 1e-9
"""What turns less does not turn."""
Turn = tuple[int, int]
"""Change of pitch and of yaw by a movement from level flight, in nrad so that they compare."""


def primitives(
    lattice: Lattice, grid: AvoidanceGrid, start_pitch_rad: float, deep: int
) -> ByteArray:
    """Buffers [trajectories, deep] of "turn k, then straight" that lead through the grid."""
    rows = [row for turns in _turns_by_speed(lattice.automaton) for row in _schedules(turns, deep)]
    rows += _list_unhurried(lattice.automaton, deep)
    if not rows:
        return np.zeros((0, deep), dtype=np.uint8)
    return complete_buffers(np.array(rows, dtype=np.uint8), lattice, grid, start_pitch_rad)


def _turns_by_speed(automaton: MovementAutomaton) -> list[dict[Turn, int]]:
    """Per speed, climb and duration: movement index + 1 by what the movement turns."""
    classes: dict[tuple[float, float | None, float], dict[Turn, int]] = {}
    for index, movement in enumerate(automaton.movements):
        end = _find_asked(automaton, movement)
        turn = (round(float(end[4]) * 1e9), round(float(end[5]) * 1e9))
        kind = (movement.speed_mps, movement.climb_mps, movement.duration_s)
        turns = classes.setdefault(kind, {})
        turns.setdefault(turn, index + 1)
    return [turns for turns in classes.values() if (0, 0) in turns]


def _find_asked(automaton: MovementAutomaton, movement: Movement) -> FloatArray:
    """[6] where a movement leads; of a measured one what it is asked for: none is quite straight,
    and from a stop it leads less far than later."""
    if automaton.classes is None:
        return automaton.predict(np.zeros(6), movement)
    return InertialessModel().advance(np.zeros(6), movement.inputs, movement.duration_s)


def _schedules(turns: dict[Turn, int], deep: int) -> Iterator[list[int]]:
    """Every pair of a pitch turn held k times and a yaw turn held n times, then straight."""
    pitches = {pitch for pitch, yaw in turns if pitch and not yaw}
    yaws = {yaw for pitch, yaw in turns if yaw and not pitch}
    held_pitches = [(0, 0), *((pitch, k) for pitch in sorted(pitches) for k in range(1, deep + 1))]
    held_yaws = [(0, 0), *((yaw, k) for yaw in sorted(yaws) for k in range(1, deep + 1))]
    for (pitch, k), (yaw, n) in itertools.product(held_pitches, held_yaws):
        both = min(k, n)
        # Without diagonals the pitch turns come first.
        joint = (pitch, yaw) in turns or not both
        order = (
            [(pitch, yaw)] * both + [(pitch, 0)] * (k - both) + [(0, yaw)] * (n - both)
            if joint
            else [(pitch, 0)] * k + [(0, yaw)] * n
        )
        row = [turns[turn] for turn in order] + [turns[0, 0]] * deep
        yield row[:deep]


def _list_unhurried(automaton: MovementAutomaton, deep: int) -> list[list[int]]:
    """Of what can stop: something else than full speed straight ahead for a while, then that."""
    if not automaton.can_stop:
        return []
    ends = np.array([_find_asked(automaton, movement) for movement in automaton.movements])
    turns = np.any(np.abs(ends[:, 3:]) > TURNS_RAD, axis=1)
    ahead = np.where(turns, -np.inf, ends[:, 0])
    straight = int(np.argmax(ahead))
    rows = []
    for index, stands in enumerate(automaton.stands):
        if index == straight or (turns[index] and not stands):
            continue
        # A climb takes as long as it must; to wait or look round, standing_deep is long enough.
        climbs = ends[index, 2] != 0.0
        longest = deep - 1 if climbs else standing_deep(automaton)
        rows += [
            ([index + 1] * held + [straight + 1] * deep)[:deep] for held in range(1, longest + 1)
        ]
    return rows
