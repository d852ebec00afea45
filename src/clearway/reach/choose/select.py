"""How a method selects trajectories, and what all methods share."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from clearway.base.grid import AvoidanceGrid
from clearway.reach.expand.buffers import ByteArray, nodes_of, parents_of
from clearway.reach.expand.lattice import Lattice
from clearway.reach.expand.trace import trace_reach_set
from clearway.reach.expand.wavefront import KeepRule, trajectories
from clearway.reach.tree import ReachSet

Select = Callable[[Lattice, AvoidanceGrid, float, int], ByteArray]
"""Lattice, grid, start pitch, movements deep -> buffers of the trajectories of a reach set."""


def select_by_keeping(rule: KeepRule, side_exits: float) -> Select:
    """What a keep rule leaves."""
    return partial(trajectories, keep=rule, side_exits=bool(side_exits))


def merge_sets(*sets: ByteArray) -> ByteArray:
    """Trajectories of several sets in one, each once and sorted (4.5.4)."""
    return np.unique(np.concatenate(sets), axis=0)


def tree_of(
    buffers: ByteArray, lattice: Lattice, grid: AvoidanceGrid, start_pitch_rad: float
) -> ReachSet:
    """The reach set of complete trajectories."""
    parent, movement = parents_of(nodes_of(buffers))
    return trace_reach_set(parent, movement, grid, lattice, start_pitch_rad)
