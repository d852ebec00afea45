"""Dispersion: how far a state that can be reached may lie from the nearest one that is kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.reach.expand.buffers import nodes_of
from clearway.reach.expand.lattice import build_lattice, grid_from_level, in_grid, movements_deep
from clearway.reach.expand.replay import complete_buffers, level_states
from clearway.reach.tree import ReachSet
from clearway.vehicle.automaton import MovementAutomaton

PERSISTENCE = 0.6


@dataclass(frozen=True)
class Dispersion:
    """Distances from sampled states to the nearest kept one, in metres."""

    largest_m: float
    """The dispersion, estimated from below: the sample may miss the farthest state."""
    mean_m: float
    states: int
    """States in the sample."""


@dataclass(frozen=True, eq=False)
class ReachableSample:
    """States at movement ends of randomly flown trajectories."""

    position_m: FloatArray
    """[n, 3] grid frame."""
    heading: FloatArray
    """[n, 3] unit vectors of flight, grid frame."""
    turn_weight_m: float
    """What a turn by one radian counts: the turning radius, or the range if that is less."""


def sample_reachable(
    automaton: MovementAutomaton,
    grid: AvoidanceGrid,
    start_pitch_rad: float = 0.0,
    trajectories: int = 3000,
    seed: int = 0,
) -> ReachableSample:
    """Draw movements at random and keep the trajectories that are complete.

    All movements are as likely, and each repeats the one before it with a chance of 0.6, since
    without persistence hardly any trajectory leads far off the axis.
    """
    deep = movements_deep(automaton, grid)
    lattice = build_lattice(automaton, grid, (start_pitch_rad,), deep)
    rng = np.random.default_rng(seed)
    rows = rng.integers(1, len(automaton.movements) + 1, (trajectories, deep)).astype(np.uint8)
    repeats = rng.random((trajectories, deep)) < PERSISTENCE
    for movement in range(1, deep):
        again = repeats[:, movement]
        rows[again, movement] = rows[again, movement - 1]
    nodes = nodes_of(complete_buffers(rows, lattice, grid, start_pitch_rad))
    states, attitudes = level_states(nodes, lattice.start[start_pitch_rad], lattice.pieces)
    rotation = grid_from_level(start_pitch_rad)
    position = in_grid(states[:, :3], rotation)
    heading = _heading(lattice.pieces.attitude_rad[attitudes, 1], states[:, 3], rotation)
    inside = grid.cell_of(position) >= 0
    weight = min(automaton.turning_radius_m, grid.range_m)
    return ReachableSample(position[inside], heading[inside], weight)


def measure_dispersion(reach_set: ReachSet, sample: ReachableSample) -> Dispersion:
    """Largest and mean distance of sampled states to the set's nearest node.

    The distance of two states is that of their positions plus the turning radius times the angle
    between their directions of flight; the start counts as kept.
    """
    rotation = grid_from_level(reach_set.start_pitch_rad)
    kept = np.concatenate([np.zeros((1, 3)), reach_set.states[:, :3]])
    pitch = np.concatenate([[reach_set.start_pitch_rad], reach_set.states[:, 4]])
    yaw = np.concatenate([[0.0], reach_set.states[:, 5]])
    gaps = _nearest(
        np.ascontiguousarray(sample.position_m),
        np.ascontiguousarray(sample.heading),
        kept,
        np.ascontiguousarray(_heading(pitch, yaw, rotation)),
        sample.turn_weight_m,
    )
    return Dispersion(float(gaps.max()), float(gaps.mean()), len(gaps))


def _heading(pitch_rad: FloatArray, yaw_rad: FloatArray, rotation: FloatArray) -> FloatArray:
    level = [
        np.cos(pitch_rad) * np.cos(yaw_rad),
        np.cos(pitch_rad) * np.sin(yaw_rad),
        -np.sin(pitch_rad),
    ]
    return in_grid(np.stack(level, axis=1), rotation)


@compiled
def _nearest(
    position: Floats2,
    heading: Floats2,
    kept_position: Floats2,
    kept_heading: Floats2,
    weight: float,
) -> Floats:
    """[n] distance of each state to the nearest kept one."""
    gaps = np.empty(len(position))
    for n in range(len(position)):
        best = np.inf
        for k in range(len(kept_position)):
            dx = position[n, 0] - kept_position[k, 0]
            dy = position[n, 1] - kept_position[k, 1]
            dz = position[n, 2] - kept_position[k, 2]
            apart = np.sqrt(dx * dx + dy * dy + dz * dz)
            if apart >= best:
                continue
            along = (
                heading[n, 0] * kept_heading[k, 0]
                + heading[n, 1] * kept_heading[k, 1]
                + heading[n, 2] * kept_heading[k, 2]
            )
            apart += weight * np.arccos(min(1.0, max(-1.0, along)))
            best = min(best, apart)
        gaps[n] = best
    return gaps
