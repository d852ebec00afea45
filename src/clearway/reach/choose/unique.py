"""Trajectories without duplicate states: where two buffers lead to one state, one way is taken.

Turns in another order often end in the very same state, since a turn to the left and the turn
back cover the same headings. What follows from there is the same too, so a buffer can take the
other's beginning.
"""

from __future__ import annotations

import numpy as np

from clearway.base.state import BoolArray, IntArray
from clearway.reach.expand.buffers import ByteArray, keys_of, mirror_buffers
from clearway.reach.expand.lattice import Lattice
from clearway.reach.expand.replay import level_states

SAME = 1e-6
"""States that differ by less in every part are one, in lengths of a movement and radians."""


def without_duplicate_states(
    preferred: ByteArray, others: ByteArray, lattice: Lattice, start_pitch_rad: float
) -> ByteArray:
    """Trajectories [n, deep] through the same states, each state reached in one way only.

    The way of a preferred trajectory is taken where there is one, else the first in mirrored
    order. A state in the plane of symmetry that only a pair of mirror images reaches is left out,
    since one of them would break the symmetry and both would be duplicates.
    """
    rows = np.concatenate([preferred, others])
    first = np.arange(len(rows)) < len(preferred)
    longest = int(np.count_nonzero(rows, axis=1).max(initial=0))
    for depth in range(1, longest + 1):
        reaching = np.flatnonzero(rows[:, depth - 1] > 0)
        if not len(reaching):
            break
        way, alive = _one_way(
            np.ascontiguousarray(rows[reaching, :depth]), first[reaching], lattice, start_pitch_rad
        )
        rows[reaching, :depth] = way
        keep = np.ones(len(rows), dtype=np.bool_)
        keep[reaching[~alive]] = False
        rows, first = rows[keep], first[keep]
    return np.unique(rows, axis=0)


def _one_way(
    prefixes: ByteArray, preferred: BoolArray, lattice: Lattice, start_pitch_rad: float
) -> tuple[ByteArray, BoolArray]:
    """The prefix [n, depth] to take instead of each, and whether there is one."""
    states, attitudes = level_states(prefixes, lattice.start[start_pitch_rad], lattice.pieces)
    # Adding zero turns -0 into 0, which would else be another key.
    unit = np.array([lattice.automaton.step_m] * 3 + [1.0])
    keys = np.column_stack([np.round(states / unit / SAME) + 0.0, attitudes])
    _, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.reshape(-1)
    own = keys_of(prefixes)
    image = own if lattice.mirror is None else keys_of(mirror_buffers(prefixes, lattice.mirror))
    lesser = np.where(image < own, image, own)
    order = np.lexsort((own, lesser, own != image, ~preferred, group))
    chosen = order[_first_of(group[order])]
    in_plane = (keys[chosen, 1] == 0.0) & (keys[chosen, 3] == 0.0)
    one_sided = in_plane & (own[chosen] != image[chosen]) & ~preferred[chosen]
    return prefixes[chosen][group], ~one_sided[group]


def _first_of(groups: IntArray) -> BoolArray:
    """Mask of the first entry of each run of equal numbers."""
    return np.append(True, groups[1:] != groups[:-1])
