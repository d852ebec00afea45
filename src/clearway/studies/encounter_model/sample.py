"""Aircraft drawn from an encounter model: where their bins lie, and the tracks that they fly.

A second of a track draws the bins a second on, given those now. A variable whose bin has changed
gets a new value inside the new bin; one whose bin stays gets a new value inside it with the
model's resample rate, a probability a second, and else keeps the one that it has. The bin that
holds 0 stands for exactly 0: straight, level or steady flight neither drifts nor jitters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray
from clearway.base.units import FOOT_M, KNOT_MPS
from clearway.studies.encounter_model.conventions import ACCELERATION, CLIMB, LAYER, SPEED, TURN
from clearway.studies.encounter_model.network import EncounterModel, Node
from clearway.studies.encounter_model.seconds import fly_on, step_second, tables_of

MOST_TRIES = 1000
"""Draws of an aircraft before a model counts as impossible."""


@dataclass(frozen=True, eq=False)
class SampledTracks:
    """Tracks of n aircraft at s times; each begins above the origin and flies along x."""

    time_s: FloatArray
    """[s] from 0."""
    position_m: FloatArray
    """[n, s, 3] x along the first heading, y left, z altitude."""
    velocity_mps: FloatArray
    """[n, s, 3]"""
    bins: IntArray
    """[n, seconds + 1, variables] at whole seconds."""
    values: FloatArray
    """[n, seconds + 1, variables] in the model's units; categories as their bin, from 1."""


def sample_initial(model: EncounterModel, count: int, rng: np.random.Generator) -> IntArray:
    """[count, variables] bins from 0, drawn parents first with the shares of the counts."""
    bins = np.zeros((count, len(model.variables)), dtype=np.int64)
    for variable in model.order:
        bins[:, variable] = _draw(model.initial[variable], bins, bins[:, variable], rng)
    return bins


def step_bins(model: EncounterModel, bins: IntArray, rng: np.random.Generator) -> IntArray:
    """[n, variables] bins a second on; configurations that nobody counted keep theirs."""
    tables, after = tables_of(model), np.empty_like(bins)
    shares = rng.random(len(tables.nodes) * len(bins))
    step_second(tables.nodes, tables.parents, tables.cumulative, bins, shares, after)
    return after


def values_of(model: EncounterModel, bins: IntArray, rng: np.random.Generator) -> FloatArray:
    """[n, variables] a value evenly inside each bin; exactly 0 in the bin that holds it."""
    share = rng.random(bins.shape)
    values = np.empty(bins.shape)
    for index, variable in enumerate(model.variables):
        mine = bins[:, index]
        if variable.edges is None:
            values[:, index] = mine + 1
            continue
        low, high = variable.edges[mine], variable.edges[mine + 1]
        values[:, index] = low + share[:, index] * (high - low)
        if variable.zero_bin is not None:
            values[mine == variable.zero_bin, index] = 0.0
    return values


def sample_tracks(
    model: EncounterModel,
    count: int,
    duration_s: int,
    rng: np.random.Generator,
    layers: tuple[int, ...] = (),
    steps_per_s: int = 1,
) -> SampledTracks:
    """Tracks of `count` aircraft over whole seconds, `steps_per_s` samples in each.

    layers: altitude layers, from 0, that aircraft must begin in; all where empty. Aircraft that
    would climb faster than they fly are drawn again. Speed stays between the ends of the model's
    scale, altitude above its lowest. Raises ClearwayError where no such aircraft is found.
    """
    bins, values = _plausible(model, count, rng, layers)
    tables = tables_of(model)
    all_bins = np.empty((duration_s + 1, *bins.shape), dtype=np.int64)
    all_values = np.empty(all_bins.shape)
    all_bins[0], all_values[0] = bins, values
    shares = rng.random((duration_s, len(tables.nodes) * count + 2 * bins.size))
    fly_on(*tables, shares, all_bins, all_values)
    stacked = np.ascontiguousarray(all_values.transpose(1, 0, 2))
    time_s, position, velocity = _fly(model, stacked, steps_per_s)
    return SampledTracks(time_s, position, velocity, all_bins.transpose(1, 0, 2), stacked)


def _draw(node: Node, bins: IntArray, kept: IntArray, rng: np.random.Generator) -> IntArray:
    """[n] bins of a node given all bins [n, variables]; `kept` where nothing was counted."""
    cumulative = node.cumulative[node.configuration(bins)]
    share = rng.random(len(bins))
    # The last column is 1 but for rounding.
    drawn = (share[:, None] >= cumulative[:, :-1]).sum(axis=1)
    return np.where(np.isnan(cumulative[:, 0]), kept, drawn)


def _plausible(
    model: EncounterModel, count: int, rng: np.random.Generator, layers: tuple[int, ...]
) -> tuple[IntArray, FloatArray]:
    layer, climb = model.index(LAYER), model.index(CLIMB)
    bins = np.empty((0, len(model.variables)), dtype=np.int64)
    values = np.empty(bins.shape)
    for _ in range(MOST_TRIES):
        more = sample_initial(model, count, rng)
        inside = values_of(model, more, rng)
        good = np.ones(count, dtype=np.bool_)
        if not model.drifts:
            speed = inside[:, model.index(SPEED)] * KNOT_MPS
            good = np.abs(inside[:, climb]) * model.climb_mps < speed
        if layers:
            good &= np.isin(more[:, layer], layers)
        bins, values = np.concatenate([bins, more[good]]), np.concatenate([values, inside[good]])
        if len(bins) >= count:
            return bins[:count], values[:count]
    raise ClearwayError(f"{model.source}: no aircraft found in altitude layers {layers}")


def _fly(
    model: EncounterModel, values: FloatArray, steps_per_s: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times [s], positions and velocities [n, s, 3]: rates held for a second, by the midpoint."""
    rate = np.repeat(values[:, :-1], steps_per_s, axis=1)
    step = 1.0 / steps_per_s
    first = values[:, 0]
    climb = rate[:, :, model.index(CLIMB)] * model.climb_mps
    height = _sum(first[:, model.index(LAYER)] * FOOT_M, step * climb)
    height = np.maximum(height, model.span(LAYER)[0] * FOOT_M)
    level, between = _across(model, first, rate, step, climb)
    none = np.zeros(len(values))
    x = _sum(none, step * level * np.cos(between))
    y = _sum(none, step * level * np.sin(between))
    position = np.stack([x, y, height], axis=-1)
    velocity = np.diff(position, axis=1) / step
    velocity = np.concatenate([velocity, velocity[:, -1:]], axis=1)
    return step * np.arange(position.shape[1]), position, velocity


def _across(
    model: EncounterModel, first: FloatArray, rate: FloatArray, step: float, climb: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Level speeds and headings [n, s] in the middle of steps; 0 for what goes with the air."""
    if model.drifts:
        return np.zeros_like(climb), np.zeros_like(climb)
    acceleration = rate[:, :, model.index(ACCELERATION)] * KNOT_MPS
    turn = -np.radians(rate[:, :, model.index(TURN)])
    slowest, fastest = model.span(SPEED)
    speed = _sum(first[:, model.index(SPEED)] * KNOT_MPS, step * acceleration)
    speed = np.clip(speed, slowest * KNOT_MPS, fastest * KNOT_MPS)
    heading = _sum(np.zeros(len(first)), step * turn)
    # A climb is along the slope: what is left of the speed goes forward.
    forward = 0.5 * (speed[:, 1:] + speed[:, :-1])
    level = np.sqrt(np.maximum(forward**2 - climb**2, 0.0))
    return level, 0.5 * (heading[:, 1:] + heading[:, :-1])


def _sum(start: FloatArray, steps: FloatArray) -> FloatArray:
    """[n, s + 1] running sums of steps [n, s] from a start [n]."""
    summed: FloatArray = start[:, None] + np.concatenate(
        [np.zeros((len(start), 1)), np.cumsum(steps, axis=1)], axis=1
    )
    return summed
