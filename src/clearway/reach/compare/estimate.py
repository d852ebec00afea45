"""How many footprints the full reach set has, estimated without bias (4.27).

Branches of the tree of footprints are followed, few at a time. Where more open than are followed,
some are drawn with unequal chances, and each counts for the inverse of its chance. A footprint that
stands for too many trajectory ends to hold is followed by random walks instead: a cell behind it
that a share of the walks finds counts for this share over its true chance, so that what walks miss
is made up for by what they find, on average exactly. The inverse of a chance is estimated without
bias by how many fresh walks it takes to find the cell again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.base.frames import FloatArray
from clearway.reach.compare.footprints import Footprint, FootprintTree

HELD_STATES = 100_000
"""Trajectory ends up to which a footprint is followed exactly."""
WALKS = 400
"""Random walks along a footprint that should get through, where it stands for more."""
MOST_WALKS = 4000
"""Walks started for that, however few of them get through."""
FOUND_AGAIN = 4
"""Times that walks have to find a cell again, for the inverse of its chance."""
SIZE_EXPONENT = 0.1
"""Footprints of many states have more below them, but not in proportion."""


@dataclass(frozen=True)
class FootprintEstimate:
    """Unbiased estimate of the number of footprints, from independent repetitions."""

    footprints: float
    standard_error: float
    repetitions: int
    walked: int
    """Footprints followed by random walks, since they stood for too many states."""


@dataclass(frozen=True, eq=False)
class _Branch:
    """A footprint, and how many it counts for.

    Either `footprint` itself, or what lies along `way` from it on.
    """

    weight: float
    footprint: Footprint
    states: float
    """How many trajectory ends it stands for, about if it is known by its way."""
    way: tuple[int, ...] = ()
    """Cells from the footprint's own on; empty where the branch is the footprint itself."""
    walks: int = 0
    """How many to start along the way."""
    found: int = 0
    """Walks that have found it, if its weight lacks the inverse of its chance as yet; else 0."""


def estimate_footprints(
    tree: FootprintTree,
    branches: int = 16,
    repetitions: int = 8,
    seed: int = 0,
    held_states: int = HELD_STATES,
    walks: int = WALKS,
) -> FootprintEstimate:
    """Number of footprints by following `branches` at a time, `repetitions` times over.

    Branches are drawn with chances in proportion to weight x states^0.1 (stochastic enumeration
    with Horvitz-Thompson weights), which makes each repetition unbiased. Footprints of more than
    `held_states` states are followed by random walks of which about `walks` get through.
    """
    rng = np.random.default_rng(seed)
    results = [
        _Repetition(tree, branches, held_states, walks, rng).run() for _ in range(repetitions)
    ]
    totals = np.array([total for total, _ in results])
    error = float(np.std(totals, ddof=1) / np.sqrt(repetitions)) if repetitions > 1 else np.inf
    walked = sum(walked for _, walked in results)
    return FootprintEstimate(float(np.mean(totals)), error, repetitions, walked)


@dataclass(frozen=True, eq=False)
class _Repetition:
    """One pass through the tree, from its root to the last layer."""

    tree: FootprintTree
    branches: int
    held_states: int
    walks: int
    rng: np.random.Generator

    def run(self) -> tuple[float, int]:
        """The estimate, and how many footprints were followed by walks."""
        total, walked = 0.0, 0
        followed = [_Branch(1.0, self.tree.root, 1.0)]
        while followed:
            opened: list[_Branch] = []
            for branch in followed:
                ended, below = self._walk(branch) if branch.way else self._hold(branch)
                total += ended
                opened += below
                walked += bool(branch.way)
            followed = [self._settle(branch) for branch in _draw(opened, self.branches, self.rng)]
        return total, walked

    def _hold(self, branch: _Branch) -> tuple[float, list[_Branch]]:
        """Footprints that end here, and branches on, from all states of a footprint."""
        footprint, weight = branch.footprint, branch.weight
        below = self.tree.offspring(footprint)
        opened = []
        for index, cell in enumerate(below.cells):
            states = int(below.start[index + 1] - below.start[index])
            if states <= self.held_states:
                opened.append(_Branch(weight, below.child(index), states))
                continue
            ways = (footprint.cell, int(cell))
            walks = self._enough(states / below.start[-1])
            opened.append(_Branch(weight, footprint, states, ways, walks))
        return weight * np.count_nonzero(below.ended), opened

    def _walk(self, branch: _Branch) -> tuple[float, list[_Branch]]:
        """Footprints that end here, and branches on, as random walks find them."""
        counts = self.tree.outcomes(branch.footprint, branch.way, branch.walks, self._seed())
        inner = self.tree.inner_cells
        total, opened = 0.0, []
        for outcome in np.flatnonzero(counts):
            found = int(counts[outcome])
            child = _Branch(
                branch.weight * found / branch.walks,
                branch.footprint,
                max(1.0, branch.states * found / branch.walks),
                (*branch.way, int(outcome)),
                branch.walks,
                found,
            )
            if outcome < inner:
                opened.append(child)
            else:
                total += self._settle(child).weight
        return total, opened

    def _settle(self, branch: _Branch) -> _Branch:
        """The branch with the inverse of its chance of being found made good in its weight."""
        if not branch.found:
            return branch
        times = min(FOUND_AGAIN, 2 * branch.found)
        taken = self.tree.walks_until(
            branch.footprint, branch.way[:-1], branch.way[-1], times, self._seed()
        )
        walks = self._enough(times / taken)
        return replace(branch, weight=branch.weight * taken / times, walks=walks, found=0)

    def _enough(self, share: float) -> int:
        """Walks to start if that share gets through."""
        return int(min(self.walks / share, max(MOST_WALKS, self.walks)))

    def _seed(self) -> int:
        return int(self.rng.integers(2**62))


def _draw(opened: list[_Branch], count: int, rng: np.random.Generator) -> list[_Branch]:
    """A systematic sample with unequal chances, each with its weight over its chance."""
    if len(opened) <= count:
        return opened
    size = np.array([_size(branch) for branch in opened])
    chance = _chances(size, count)
    order = rng.permutation(len(opened))
    ends = np.cumsum(chance[order]) - rng.random()
    hit = np.diff(np.ceil(np.concatenate([[ends[0] - chance[order[0]]], ends]))) > 0
    return [replace(opened[n], weight=opened[n].weight / chance[n]) for n in order[hit]]


def _size(branch: _Branch) -> float:
    """What chances of being drawn are in proportion to: about the footprints that it counts for."""
    made_good = branch.weight * branch.walks / branch.found if branch.found else branch.weight
    return float(made_good * branch.states**SIZE_EXPONENT)


def _chances(size: FloatArray, count: int) -> FloatArray:
    """Chances of being drawn in proportion to size, none above 1, that add up to `count`."""
    certain = np.zeros(len(size), dtype=np.bool_)
    while True:
        rest = count - np.count_nonzero(certain)
        chance = np.where(certain, 1.0, rest * size / max(size[~certain].sum(), 1e-300))
        above = (chance > 1.0) & ~certain
        if not np.any(above):
            return chance
        certain |= above
