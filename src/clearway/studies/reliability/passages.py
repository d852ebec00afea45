"""Trajectories as passages from cell to cell, up to the first place that is too near."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.state import BoolArray, IntArray
from clearway.reach.tree import ReachSet


@dataclass(frozen=True, slots=True, eq=False)
class Passages:
    """The complete trajectories of a reach set; rows shorter than the longest end in -1."""

    cell: IntArray
    """[trajectories, cells] in the order in which they are entered."""
    node: IntArray
    """[trajectories, steps] nodes on the way."""
    entered: IntArray
    """[trajectories, steps, samples] which of the cells each sample counts to: the one it lies in,
    or outside the grid the last one entered."""

    @classmethod
    def of(cls, reach_set: ReachSet) -> Passages:
        ends = reach_set.trajectories
        paths = [reach_set.path(int(end)) for end in ends]
        samples = reach_set.samples_m.shape[1]
        lies_in = reach_set.grid.cell_of(reach_set.samples_m.reshape(-1, 3)).reshape(-1, samples)
        begin, index = reach_set.cell_start, reach_set.cell_index
        lists = [np.concatenate([index[begin[n] : begin[n + 1]] for n in path]) for path in paths]
        cell = np.full((len(ends), max(map(len, lists))), -1, dtype=np.int64)
        node = np.full((len(ends), max(map(len, paths))), -1, dtype=np.int64)
        entered = np.zeros((*node.shape, samples), dtype=np.int64)
        for row, (path, cells) in enumerate(zip(paths, lists, strict=True)):
            cell[row, : len(cells)] = cells
            node[row, : len(path)] = path
            place, last = {int(c): k for k, c in enumerate(cells)}, 0
            for step, n in enumerate(path):
                for sample in range(samples):
                    last = place.get(int(lies_in[n, sample]), last)
                    entered[row, step, sample] = last
        return cls(cell, node, entered)

    def judge_flown(self, clear: BoolArray) -> tuple[BoolArray, BoolArray, BoolArray]:
        """What comes of all trajectories if samples [nodes, samples] are clear: which cells are
        entered [trajectories, cells], in which of these all stays clear, and which trajectories
        do [trajectories].

        Nobody flies on from the first place that is too near.
        """
        bad = ~clear[self.node] & (self.node >= 0)[:, :, None]
        flat = bad.reshape(len(bad), -1)
        kept: BoolArray = np.logical_not(flat.any(axis=1))
        ended = self.entered.reshape(len(bad), -1)[np.arange(len(bad)), flat.argmax(axis=1)]
        number = np.arange(self.cell.shape[1])
        entered = (self.cell >= 0) & (kept[:, None] | (number <= ended[:, None]))
        good = entered & (kept[:, None] | (number < ended[:, None]))
        return np.asarray(entered), np.asarray(good), kept


class KnownPassages:
    """Of the reach sets of one flight, which has few of them."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[ReachSet, Passages]] = {}

    def of(self, reach_set: ReachSet) -> Passages:
        if id(reach_set) not in self._known:
            self._known[id(reach_set)] = (reach_set, Passages.of(reach_set))
        return self._known[id(reach_set)][1]
