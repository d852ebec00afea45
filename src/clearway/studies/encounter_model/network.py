"""Encounter models as values: two Bayes networks, one of how aircraft are and one of how they
change within a second (MIT Lincoln Laboratory, ATC-345).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.base.units import FOOT_PER_MINUTE_MPS
from clearway.studies.encounter_model.conventions import SPEED


@dataclass(frozen=True, eq=False)
class Node:
    """One node of a network, given its parents."""

    parents: tuple[int, ...]
    """Indices of variables as the file orders them; of a transition, `~n` for n a second on."""
    sizes: tuple[int, ...]
    """Bins of each parent."""
    counts: FloatArray
    """[configurations of the parents, bins]"""

    def configuration(self, bins: IntArray) -> IntArray:
        """[n] row of `counts` for bins [n, variables]; the first parent varies fastest."""
        row = np.zeros(len(bins), dtype=np.int64)
        stride = 1
        for parent, size in zip(self.parents, self.sizes, strict=True):
            row += stride * bins[:, parent]
            stride *= size
        return row

    def follow(self, following: Mapping[int, int]) -> Node:
        """Return the node with parents a second on named by variable, as negative numbers.

        following: variable by index of what it is a second on. Variable n a second on is `~n`.
        """
        parents = tuple(~following[p] if p in following else p for p in self.parents)
        return replace(self, parents=parents)

    @cached_property
    def cumulative(self) -> FloatArray:
        """[configurations, bins] shares added up along the bins; NaN where nothing was counted."""
        total = self.counts.sum(axis=1, keepdims=True)
        shares = self.counts / np.where(total > 0.0, total, np.nan)
        summed: FloatArray = np.cumsum(shares, axis=1)
        return summed


@dataclass(frozen=True, eq=False)
class Variable:
    """What one variable's bins stand for."""

    name: str
    bins: int
    edges: FloatArray | None
    """[bins + 1] in the file's units; None where bins are categories."""
    resample_rate: float
    """Probability a second of a new value within the same bin."""

    @cached_property
    def zero_bin(self) -> int | None:
        """The bin that holds 0 inside, which means exactly 0; None without one."""
        if self.edges is None:
            return None
        held = (self.edges[:-1] < 0.0) & (self.edges[1:] > 0.0)
        return int(np.argmax(held)) if held.any() else None


@dataclass(frozen=True, eq=False)
class EncounterModel:
    """How aircraft of one kind fly: `read_encounter_model` makes it."""

    source: str
    variables: tuple[Variable, ...]
    initial: tuple[Node, ...]
    """One node per variable; parents come before their children in `order`."""
    order: tuple[int, ...]
    """Variables, parents first."""
    transition: Mapping[int, Node]
    """By variable: its bin a second on, given bins now and those of earlier nodes a second on.
    Variables without one keep theirs."""
    climb_mps: float = FOOT_PER_MINUTE_MPS
    """A climb of one unit of the file."""

    @property
    def drifts(self) -> bool:
        """Whether aircraft have no speed of their own and go with the air, as balloons do."""
        return SPEED not in (variable.name for variable in self.variables)

    def index(self, name: str) -> int:
        """Index of a variable by name."""
        return [variable.name for variable in self.variables].index(name)

    def span(self, name: str) -> tuple[float, float]:
        """Ends of the scale of a variable that is no category, in the file's units."""
        edges = self.variables[self.index(name)].edges
        return (-math.inf, math.inf) if edges is None else (float(edges[0]), float(edges[-1]))
