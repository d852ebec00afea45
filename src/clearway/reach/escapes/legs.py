"""Where movements lead from the attitudes that a vehicle comes to from level flight."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2, Floats4, Ints2
from clearway.base.brief import brief
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.paths import MovementPaths, movement_paths

LEG_SAMPLES = 8
"""Places along a movement that are looked at."""
SAME_RAD = 1e-6
"""Attitudes no farther apart are one."""
MOST_ATTITUDES = 64


class Legs(NamedTuple):
    """Where every movement leads from every attitude, as compiled loops take it."""

    path: Floats4
    """[attitudes, movements, SAMPLES, 4] x, y, z and yaw along it, from the origin at yaw 0."""
    sagitta_m: Floats2
    """[attitudes, movements] how far the path may lie from chords between its samples."""
    following: Ints2
    """[attitudes, movements] attitude at its end; -1 where it may not be flown."""
    duration_s: Floats
    """[movements]"""

    def __repr__(self) -> str:
        return brief(self)


def legs_from_level(automaton: MovementAutomaton) -> tuple[FloatArray, Legs]:
    """[attitudes, 2] roll and pitch of all that movements lead to from level flight, and where they
    lead from each."""
    paths = movement_paths(automaton, LEG_SAMPLES)
    attitudes, following = attitudes_of(automaton, paths)
    return attitudes, legs_of(paths, attitudes, following, automaton)


def attitudes_of(automaton: MovementAutomaton, paths: MovementPaths) -> tuple[FloatArray, IntArray]:
    """Attitudes that movements lead to from level flight, and from which to which."""
    classes = automaton.classes
    if automaton.has_inertia and classes is not None:
        labels = [(classes.label_of(at), 0.0) for at in range(len(classes.classes))]
        return np.array(labels), classes.following
    found = [(0.0, 0.0)]
    following: list[list[int]] = []
    while len(following) < len(found):
        roll, pitch = found[len(following)]
        ends = paths(roll, pitch)[:, -1, 3:5]
        row = []
        for movement, (next_roll, next_pitch) in zip(automaton.movements, ends, strict=True):
            state = np.array([0.0, 0.0, 0.0, roll, pitch, 0.0])
            row.append(-1)
            if not automaton.is_allowed(state, movement):
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


def legs_of(
    paths: MovementPaths,
    attitudes: FloatArray,
    following: IntArray,
    automaton: MovementAutomaton,
) -> Legs:
    """Where movements lead from some attitudes, and to which of them."""
    along = np.array([paths(roll, pitch) for roll, pitch in attitudes.tolist()])
    chords = np.diff(along[..., :3], axis=2, prepend=0.0)
    length = np.sqrt(np.einsum("amsi,amsi->ams", chords, chords)).sum(axis=2)
    bend = np.hypot(along[:, :, -1, 5], along[:, :, -1, 4] - attitudes[:, 1, None])
    sagitta_m = length * bend / (8.0 * LEG_SAMPLES**2)
    classes = automaton.classes
    if automaton.has_inertia and classes is not None:
        sagitta_m += classes.tube_of_movements_m
    return Legs(
        np.ascontiguousarray(along[..., [0, 1, 2, 5]]),
        sagitta_m,
        following,
        np.array([movement.duration_s for movement in automaton.movements]),
    )


def pose_on(pose: FloatArray, step: FloatArray) -> FloatArray:
    """Place and yaw [4] after a step [4] from a pose [4]."""
    cosine, sine = np.cos(pose[3]), np.sin(pose[3])
    after = pose.copy()
    after[0] += cosine * step[0] - sine * step[1]
    after[1] += sine * step[0] + cosine * step[1]
    after[2:] += step[2:]
    return after
