"""Layers by time: all chains of a few movements, thinned out so that what is left lies far apart.

Of a vehicle with inertia every movement takes equally long, and where it may go next depends on its
speed. A reach set is therefore a tree of a few layers, begun in one class of motion. Every node of
it may be where a plan ends; the last layer is where most do.

Chains grow at their front: a movement, and then a chain that is kept from where it ends. So what is
left of any plan, once its first movement is flown, can be flown on.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.reach.expand.buffers import ByteArray
from clearway.reach.expand.lattice import Lattice

LAYERS = 4
"""Movements of the longest chains."""
KEPT = (600, 900, 1100)
"""Chains kept of two movements, and of those that are longer."""
FINEST_M = 0.15
"""Ends of chains nearer to each other than this are one."""
GROWS = 1.15
"""Growth of that distance until few enough are left."""
COARSER_HEIGHT = 0.5
"""Least distance in height, m."""
HEADINGS_RAD = (0.12, 0.6)
"""Least and greatest difference of headings that tells ends apart."""
EFFORT = 0.3
"""Weight of a chain's effort against chance, where one of several alike is kept. Sets of plain
chains alone put off what has to be done."""


class _Chains(NamedTuple):
    """Chains of equally many movements from one class."""

    pose: FloatArray
    """[n, 4] where they end."""
    at: IntArray
    """[n] class at the end."""
    spent: FloatArray
    """[n] effort."""
    buffers: ByteArray
    """[n, LAYERS]"""


@lru_cache(maxsize=2)
def find_timed_chains(lattice: Lattice) -> tuple[ByteArray, ...]:
    """Return buffers [chains, LAYERS] of the chains kept from each class of motion."""
    pieces, rng = lattice.pieces, np.random.default_rng(0)
    classes = range(len(pieces.following))
    effort, goes_on = _effort_of(lattice), _goes_on(lattice)
    chains = [_single(lattice, at, effort) for at in classes]
    found = [[each.buffers] for each in chains]
    for length in range(2, LAYERS + 1):
        most = KEPT[min(length - 2, len(KEPT) - 1)]
        grown = [_grow(lattice, at, chains, effort, goes_on) for at in classes]
        chains = [_disperse(each, rng, most, length) for each in grown]
        for at, each in enumerate(chains):
            found[at].append(each.buffers)
    return tuple(np.concatenate(each) for each in found)


def _single(lattice: Lattice, at: int, effort: FloatArray) -> _Chains:
    """Chains of one movement."""
    pieces = lattice.pieces
    movement = np.flatnonzero(pieces.following[at] >= 0)
    pose = np.column_stack([pieces.path[at, movement, -1], pieces.turn_rad[at, movement]])
    buffers = np.zeros((len(movement), LAYERS), dtype=np.uint8)
    buffers[:, 0] = movement + 1
    ends = pieces.following[at, movement].astype(np.int64)
    return _Chains(pose, ends, effort[at, movement], buffers)


def _grow(
    lattice: Lattice, at: int, chains: list[_Chains], effort: FloatArray, goes_on: BoolArray
) -> _Chains:
    """Chains that begin with one movement more."""
    pieces, parts = lattice.pieces, []
    for movement in np.flatnonzero(pieces.following[at] >= 0).tolist():
        then = int(pieces.following[at, movement])
        rest = chains[then]
        keep = goes_on[then, rest.buffers[:, 0].astype(np.int64) - 1]
        end, turn_rad = pieces.path[at, movement, -1], float(pieces.turn_rad[at, movement])
        buffers = np.zeros((int(keep.sum()), LAYERS), dtype=np.uint8)
        buffers[:, 0], buffers[:, 1:] = movement + 1, rest.buffers[keep, :-1]
        parts.append(
            _Chains(
                _place(end, turn_rad, rest.pose[keep]),
                rest.at[keep],
                effort[at, movement] + rest.spent[keep],
                buffers,
            )
        )
    return _Chains(
        np.concatenate([part.pose for part in parts]),
        np.concatenate([part.at for part in parts]),
        np.concatenate([part.spent for part in parts]),
        np.concatenate([part.buffers for part in parts]),
    )


def _place(end: FloatArray, turn_rad: float, pose: FloatArray) -> FloatArray:
    """[n, 4] poses that begin after a displacement [3] and a turn."""
    cosine, sine = np.cos(turn_rad), np.sin(turn_rad)
    x = end[0] + cosine * pose[:, 0] - sine * pose[:, 1]
    y = end[1] + sine * pose[:, 0] + cosine * pose[:, 1]
    return np.stack([x, y, end[2] + pose[:, 2], turn_rad + pose[:, 3]], axis=1)


def _disperse(chains: _Chains, rng: np.random.Generator, most: int, length: int) -> _Chains:
    """Of chains that end in one cell that of the lowest rank, in cells just so large that few
    enough are left."""
    pose, at = chains.pose, chains.at
    rank = EFFORT * chains.spent + rng.random(len(at))
    # Straight on, or one turn: never left to chance.
    first = chains.buffers[:, :1]
    rank[np.all(chains.buffers[:, :length] == first, axis=1)] = -1.0
    order = np.argsort(rank, kind="stable")
    fine_m = FINEST_M
    turned = (pose[:, 3] + np.pi) % (2.0 * np.pi) - np.pi
    while True:
        heading = min(max(HEADINGS_RAD[0], 0.25 * fine_m), HEADINGS_RAD[1])
        key = np.stack(
            [
                np.rint(pose[:, 0] / fine_m),
                np.rint(pose[:, 1] / fine_m),
                np.rint(pose[:, 2] / max(fine_m, COARSER_HEIGHT)),
                np.rint(at // 3 / max(1.0, fine_m)),
                at % 3,
                np.rint(turned / heading),
            ]
        ).astype(np.int64)
        low = key.min(axis=1, keepdims=True)
        sizes = (key.max(axis=1) - low[:, 0] + 1).tolist()
        flat = np.ravel_multi_index(tuple(key - low), sizes)
        _, kept = np.unique(flat[order], return_index=True)
        if len(kept) <= most:
            chosen = np.sort(order[kept])
            return _Chains(pose[chosen], at[chosen], chains.spent[chosen], chains.buffers[chosen])
        fine_m *= GROWS


def _climb_of(lattice: Lattice) -> FloatArray:
    """[attitudes] rate of climb of each class."""
    classes = lattice.automaton.classes
    assert classes is not None  # Only vehicles with inertia come here.
    return classes.climb_mps


def _goes_on(lattice: Lattice) -> BoolArray:
    """[attitudes, movements] which movements may follow others in a chain: climbs begin with its
    first movement, and what stands leads nowhere new."""
    pieces, climbs = lattice.pieces, _climb_of(lattice)
    ends = climbs[np.maximum(pieces.following, 0)]
    idle = ~np.any(pieces.path[:, :, -1], axis=2) & (pieces.turn_rad == 0.0)
    fits: BoolArray = ~idle & ((ends == climbs[:, None]) | (ends == 0.0))
    return fits


def _effort_of(lattice: Lattice) -> FloatArray:
    """[attitudes, movements] how much a movement changes: chains that change little are kept."""
    climbs, pieces = _climb_of(lattice), lattice.pieces
    ends = climbs[np.maximum(pieces.following, 0)]
    widest = np.abs(pieces.turn_rad).max(axis=1, keepdims=True)
    turns = np.abs(pieces.turn_rad) / np.where(widest > 0.0, widest, 1.0)
    effort: FloatArray = (ends != climbs[:, None]) + 0.7 * (ends != 0.0) + 0.5 * turns
    return effort
