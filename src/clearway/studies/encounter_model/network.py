"""Encounter models as values: two Bayes networks, one of how aircraft are and one of how they
change within a second (MIT Lincoln Laboratory, ATC-345).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import IntArray


@dataclass(frozen=True, eq=False)
class Node:
    """One node of a network, given its parents."""

    parents: tuple[int, ...]
    """Indices of variables, ascending."""
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
    """By variable: its bin a second on, given bins now. Variables without one keep theirs."""

    def index(self, name: str) -> int:
        """Index of a variable by name."""
        return [variable.name for variable in self.variables].index(name)

    def span(self, name: str) -> tuple[float, float]:
        """Ends of the scale of a variable that is no category, in the file's units."""
        edges = self.variables[self.index(name)].edges
        return (-math.inf, math.inf) if edges is None else (float(edges[0]), float(edges[-1]))
