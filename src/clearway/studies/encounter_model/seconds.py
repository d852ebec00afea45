"""Bins and values second by second, compiled: a study draws thousands of tracks."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Bools, Floats, Floats2, Floats3, Ints2, Ints3
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.studies.encounter_model.network import EncounterModel

END = 1_000_000
"""No model has as many variables."""


class Tables(NamedTuple):
    """A model as flat arrays."""

    nodes: IntArray
    """[nodes, 4] of the transition network: variable, bins, where its parents begin in `parents`,
    and its shares in `cumulative`."""
    parents: IntArray
    """[k, 2] variable, or `~variable` for its bin a second on, and size; END ends each node."""
    cumulative: FloatArray
    """Of all nodes, configuration after configuration."""
    low: FloatArray
    """[variables, most bins] lower and upper ends of bins; both are the bin's number from 1 for
    categories, and 0 for the bin that holds 0."""
    high: FloatArray
    rates: FloatArray
    """[variables] resample rates."""
    moving: BoolArray
    """[variables] whether it has a transition."""


@lru_cache(maxsize=4)
def tables_of(model: EncounterModel) -> Tables:
    """The flat arrays of a model."""
    nodes, shares, at = [], [], 0
    parents: list[tuple[int, int]] = []
    for changed, node in model.transition.items():
        table = node.cumulative
        nodes.append((changed, table.shape[1], len(parents), at))
        parents += [*zip(node.parents, node.sizes, strict=True), (END, 0)]
        shares.append(table.ravel())
        at += table.size
    most = max(variable.bins for variable in model.variables)
    low = np.zeros((len(model.variables), most))
    high = np.zeros_like(low)
    for index, variable in enumerate(model.variables):
        of = slice(0, variable.bins)
        if variable.edges is None:
            low[index, of] = high[index, of] = np.arange(1.0, variable.bins + 1.0)
            continue
        low[index, of], high[index, of] = variable.edges[:-1], variable.edges[1:]
        if variable.zero_bin is not None:
            low[index, variable.zero_bin] = high[index, variable.zero_bin] = 0.0
    moving = np.zeros(len(model.variables), dtype=np.bool_)
    moving[list(model.transition)] = True
    return Tables(
        np.array(nodes, dtype=np.int64).reshape(-1, 4),
        np.array(parents, dtype=np.int64).reshape(-1, 2),
        np.concatenate([np.zeros(0), *shares]),
        low,
        high,
        np.array([variable.resample_rate for variable in model.variables]),
        moving,
    )


@compiled
def step_second(
    nodes: Ints2,
    parents: Ints2,
    cumulative: Floats,
    bins: Ints2,
    shares: Floats,
    after: Ints2,
) -> None:
    """Set `after` [n, variables] to the bins a second on, drawn by shares [nodes * n]."""
    count = len(bins)
    for row in range(count):
        for variable in range(bins.shape[1]):
            after[row, variable] = bins[row, variable]
    for node in range(len(nodes)):
        variable, size, parent, table = nodes[node]
        for row in range(count):
            configuration, stride, at = 0, 1, parent
            while parents[at, 0] < END:
                parent_of = parents[at, 0]
                if parent_of >= 0:
                    configuration += stride * bins[row, parent_of]
                else:
                    configuration += stride * after[row, -1 - parent_of]
                stride *= parents[at, 1]
                at += 1
            begins = table + configuration * size
            if np.isnan(cumulative[begins]):
                continue
            drawn = 0
            # The last column is 1 but for rounding.
            for n in range(size - 1):
                drawn += int(shares[node * count + row] >= cumulative[begins + n])
            after[row, variable] = drawn


@compiled
def fly_on(
    nodes: Ints2,
    parents: Ints2,
    cumulative: Floats,
    low: Floats2,
    high: Floats2,
    rates: Floats,
    moving: Bools,
    shares: Floats2,
    bins: Ints3,
    values: Floats3,
) -> None:
    """Fill bins and values [seconds + 1, n, variables] from the first second on.

    shares: [seconds, (nodes + 2 * variables) * n] random numbers: of bins, of values, and of
    whether a value is drawn again.
    """
    count, variables = bins.shape[1], bins.shape[2]
    for second in range(len(shares)):
        step_second(nodes, parents, cumulative, bins[second], shares[second], bins[second + 1])
        fresh = len(nodes) * count
        again = fresh + count * variables
        for row in range(count):
            for n in range(variables):
                at = row * variables + n
                now = bins[second + 1, row, n]
                new = now != bins[second, row, n] or shares[second, again + at] < rates[n]
                if new and moving[n]:
                    width = high[n, now] - low[n, now]
                    values[second + 1, row, n] = low[n, now] + shares[second, fresh + at] * width
                else:
                    values[second + 1, row, n] = values[second, row, n]
