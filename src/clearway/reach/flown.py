"""A reach set as it is flown from the attitude that the vehicle really has.

Sets are built for few start pitches. From between them the same movements lead elsewhere, and what
is verified must be what is flown: every place is predicted anew, from the true attitude. The cells
that paths pass, and with them their ratings, stay those of the set.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import (
    Bools,
    Bools2,
    Floats,
    Floats2,
    Floats3,
    Floats4,
    Int16s,
    Int32s,
    Ints2,
)
from clearway.base.brief import brief
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.reach.expand.lattice import MOVEMENT_SAMPLES, grid_from_level
from clearway.reach.tree import ReachSet
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.paths import motion_depends_on_roll, movement_paths
from clearway.vehicle.predicted import PITCH_TOLERANCE_RAD

SAME_RAD = 1e-9
"""Attitudes no farther apart are one: over 10 m they lead 1e-8 m apart."""


class AttitudeTurns(NamedTuple):
    """How the movements of a reach set lead from attitude to attitude."""

    following: IntArray
    """[attitudes, movements] attitude at the movement's end; -1 where the set has none such."""
    depth: int
    """Most movements of a trajectory."""

    def __repr__(self) -> str:
        return brief(self)


def turns_of(reach_set: ReachSet) -> AttitudeTurns:
    """Attitudes of a reach set, the start as the first, and the movements between them."""
    parent, movement = reach_set.parent, reach_set.movement
    ends = np.round(reach_set.states[:, 3:5] / SAME_RAD).astype(np.int64)
    start = np.round([[0.0, reach_set.start_pitch_rad / SAME_RAD]]).astype(np.int64)
    found, which = np.unique(np.concatenate([start, ends]), axis=0, return_inverse=True)
    number = np.full(len(found), -1, dtype=np.int64)
    order = np.unique(which.ravel(), return_index=True)[1]
    number[which.ravel()[np.sort(order)]] = np.arange(len(found))
    attitude = number[which.ravel()]
    before = np.where(parent >= 0, attitude[1:][parent], attitude[0])
    following = np.full((len(found), len(reach_set.movement_names)), -1, dtype=np.int64)
    following[before, movement] = attitude[1:]
    return AttitudeTurns(following, int(reach_set.depth.max(initial=0)))


class FlownReachSet(NamedTuple):
    """A reach set predicted from a true attitude."""

    reach_set: ReachSet
    """Its grid frame is the body frame at the true pitch, without roll."""
    flyable: BoolArray
    """[nodes] whether the path to the node's end keeps the pitch limit, or comes back towards it;
    where no trajectory does, whether it goes no farther beyond it; where none does, all."""


def is_flown(
    reach_set: ReachSet, automaton: MovementAutomaton, roll_rad: float, pitch_rad: float
) -> bool:
    """Whether a reach set is what is flown from an attitude, to the last millimetre."""
    if abs(pitch_rad - reach_set.start_pitch_rad) > SAME_RAD:
        return False
    return abs(roll_rad) <= SAME_RAD or not motion_depends_on_roll(automaton)


def fly_reach_set(
    reach_set: ReachSet,
    turns: AttitudeTurns,
    automaton: MovementAutomaton,
    roll_rad: float,
    pitch_rad: float,
) -> FlownReachSet:
    """The trajectories of a reach set from a true attitude, as the automaton predicts them."""
    legs = _legs(turns, automaton, roll_rad, pitch_rad)
    samples, states, sagitta, keeps, stays = _fly(
        reach_set.parent,
        reach_set.movement,
        reach_set.sagitta_m,
        legs,
        grid_from_level(pitch_rad),
    )
    flown = replace(
        reach_set, start_pitch_rad=pitch_rad, samples_m=samples, states=states, sagitta_m=sagitta
    )
    complete = reach_set.complete
    for flyable in (keeps, stays):
        if np.any(flyable & complete):
            return FlownReachSet(flown, flyable)
    return FlownReachSet(flown, np.ones(reach_set.nodes, dtype=np.bool_))


class TurnedLegs(NamedTuple):
    """Movements from every true attitude that the trajectories lead to."""

    following: Ints2
    """[attitudes, movements] attitude at the end; -1 where no trajectory goes on so."""
    states: Floats4
    """[attitudes, movements, samples, 6] along the movement, from the origin at yaw 0, level."""
    sagitta_m: Floats2
    """[attitudes, movements] how far the path may lie from chords between its samples."""
    keeps: Bools2
    """[attitudes, movements] within the pitch limit, or back towards it."""
    stays: Bools2
    """[attitudes, movements] no farther beyond the pitch limit than the start."""


def _legs(
    turns: AttitudeTurns, automaton: MovementAutomaton, roll_rad: float, pitch_rad: float
) -> TurnedLegs:
    paths_from = movement_paths(automaton, MOVEMENT_SAMPLES)
    attitudes = [(0, roll_rad, pitch_rad)]
    known = {(0, round(roll_rad / SAME_RAD), round(pitch_rad / SAME_RAD)): 0}
    following: list[list[int]] = []
    states: list[FloatArray] = []
    generation_end, generation = 1, 0
    while len(states) < len(attitudes) and generation < turns.depth:
        at, roll, pitch = attitudes[len(states)]
        paths = paths_from(roll, pitch)
        row = []
        for goes_on, end in zip(turns.following[at].tolist(), paths[:, -1].tolist(), strict=True):
            if goes_on >= 0:
                key = (goes_on, round(end[3] / SAME_RAD), round(end[4] / SAME_RAD))
                if key not in known:
                    known[key] = len(attitudes)
                    attitudes.append((goes_on, end[3], end[4]))
                row.append(known[key])
            else:
                row.append(-1)
        following.append(row)
        states.append(paths)
        if len(states) == generation_end:
            generation_end, generation = len(attitudes), generation + 1
    along = np.array(states)
    starts = np.array([pitch for _, _, pitch in attitudes[: len(states)]])
    keeps, stays = _within_limit(automaton, starts, along[:, :, -1, 4])
    return TurnedLegs(
        np.array(following, dtype=np.int64), along, _sagitta(along, starts), keeps, stays
    )


def _within_limit(
    automaton: MovementAutomaton, starts: FloatArray, ends: FloatArray
) -> tuple[BoolArray, BoolArray]:
    """Its `keeps` and `stays`, of pitches at the starts [attitudes] and ends of movements."""
    limit = automaton.pitch_limit_rad
    if limit is None:
        every = np.ones(ends.shape, dtype=np.bool_)
        return every, every
    beyond = np.abs(ends)
    keeps = (beyond <= limit + PITCH_TOLERANCE_RAD) | (beyond < np.abs(starts)[:, None])
    return keeps, keeps | (beyond <= abs(starts[0]) + PITCH_TOLERANCE_RAD)


def _sagitta(along: FloatArray, starts: FloatArray) -> FloatArray:
    """A path of length s and curvature k lies within k s^2 / 8 of its chord."""
    chords = np.diff(along[..., :3], axis=2, prepend=0.0)
    length = np.sqrt(np.einsum("amsi,amsi->ams", chords, chords)).sum(axis=2)
    bend = np.hypot(along[:, :, -1, 5], along[:, :, -1, 4] - starts[:, None])
    return np.asarray(length * bend / (8.0 * MOVEMENT_SAMPLES**2), dtype=np.float64)


@compiled
def _fly(
    parent: Int32s,
    movement: Int16s,
    least_sagitta: Floats,
    legs: TurnedLegs,
    rotation: Floats2,
) -> tuple[Floats3, Floats2, Floats, Bools, Bools]:
    nodes = len(parent)
    samples, states = np.empty((nodes, MOVEMENT_SAMPLES, 3)), np.empty((nodes, 6))
    sagitta = np.empty(nodes)
    keeps, stays = np.ones(nodes, dtype=np.bool_), np.ones(nodes, dtype=np.bool_)
    attitude = np.empty(nodes, dtype=np.int64)
    place = np.zeros((nodes, 3))  # Ends in the level frame.
    for n in range(nodes):
        p, m, at = parent[n], movement[n], 0
        x, y, z, yaw = 0.0, 0.0, 0.0, 0.0
        if p >= 0:
            at, yaw = attitude[p], states[p, 5]
            x, y, z = place[p, 0], place[p, 1], place[p, 2]
            keeps[n], stays[n] = keeps[p], stays[p]
        cosine, sine = np.cos(yaw), np.sin(yaw)
        for s in range(MOVEMENT_SAMPLES):
            leg = legs.states[at, m, s]
            px = x + cosine * leg[0] - sine * leg[1]
            py = y + sine * leg[0] + cosine * leg[1]
            pz = z + leg[2]
            for axis in range(3):
                samples[n, s, axis] = (
                    rotation[axis, 0] * px + rotation[axis, 1] * py + rotation[axis, 2] * pz
                )
        place[n, 0], place[n, 1], place[n, 2] = px, py, pz
        states[n, :3] = samples[n, MOVEMENT_SAMPLES - 1]
        states[n, 3], states[n, 4] = leg[3], leg[4]
        states[n, 5] = yaw + leg[5]
        sagitta[n] = max(least_sagitta[n], legs.sagitta_m[at, m])
        keeps[n] = keeps[n] and legs.keeps[at, m]
        stays[n] = stays[n] and legs.stays[at, m]
        attitude[n] = legs.following[at, m]
    return samples, states, sagitta, keeps, stays
