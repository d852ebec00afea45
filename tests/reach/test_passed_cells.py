"""Which cells a movement passes: as a much denser sampling of its true path finds them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from clearway.base.frames import FloatArray, world_from_body
from clearway.base.grid import AvoidanceGrid
from clearway.reach.sets import build_reach_set
from clearway.reach.tree import ReachSet
from clearway.vehicle.automaton import Movement, MovementAutomaton

SAMPLES = 2000
OFFSETS_M = 1e-6 * np.array([*itertools.product((-1.0, 0.0, 1.0), repeat=3)])


class _TruePaths:
    """Positions along every node's movement, in the grid frame, from the automaton alone."""

    def __init__(self, automaton: MovementAutomaton, reach_set: ReachSet) -> None:
        self._automaton = automaton
        self._rotation = world_from_body([0.0, reach_set.start_pitch_rad, 0.0]).T
        self._known: dict[tuple[float, int, int], FloatArray] = {}
        start = np.array([0.0, 0.0, 0.0, 0.0, reach_set.start_pitch_rad, 0.0])
        self.starts = [
            start if parent < 0 else self._level_end(reach_set, int(parent))
            for parent in reach_set.parent
        ]

    def _level_end(self, reach_set: ReachSet, node: int) -> FloatArray:
        state = reach_set.states[node].copy()
        state[:3] = self._rotation.T @ state[:3]
        return state

    def at(self, node: int, movement: int, shares: FloatArray) -> FloatArray:
        """[n, 3] of a node's movement at shares of its time."""
        start = self.starts[node]
        key = (round(float(start[4]), 9), movement, len(shares))
        if key not in self._known:
            self._known[key] = self._from_origin(start, movement, shares)
        flown = self._known[key]
        yaw = world_from_body([0.0, 0.0, start[5]])
        return (start[:3] + flown @ yaw.T) @ self._rotation.T

    def _from_origin(self, start: FloatArray, movement: int, shares: FloatArray) -> FloatArray:
        state = np.array([0.0, 0.0, 0.0, start[3], start[4], 0.0])
        movements = self._automaton.movements[movement]
        times = movements.duration_s * shares
        return np.array([self._automaton.predict(state, movements, float(t))[:3] for t in times])


def _differences(automaton: MovementAutomaton, reach_set: ReachSet) -> tuple[int, int]:
    """Cells passed in all; asserts that none is missing and none is far from the path."""
    paths, grid = _TruePaths(automaton, reach_set), reach_set.grid
    shares = np.arange(1, SAMPLES + 1) / SAMPLES
    before: list[set[int]] = []
    total = more = 0
    for node, (parent, movement) in enumerate(
        zip(reach_set.parent.tolist(), reach_set.movement.tolist(), strict=True)
    ):
        known = before[parent] if parent >= 0 else set()
        cells = grid.cell_of(paths.at(node, movement, shares))
        sampled = [c for c in dict.fromkeys(cells.tolist()) if c >= 0 and c not in known]
        listed = reach_set.cell_index[
            reach_set.cell_start[node] : reach_set.cell_start[node + 1]
        ].tolist()
        assert [c for c in listed if c in sampled] == sampled, (
            f"node {node}: missed or out of order"
        )
        for cell in set(listed) - set(sampled):
            fine = np.linspace(0.0, 1.0, 10 * SAMPLES + 1)
            near = paths.at(node, movement, fine)[:, None] + OFFSETS_M
            assert np.any(grid.cell_of(near) == cell), f"node {node}: cell {cell} is not passed"
            more += 1
        total += len(listed)
        before.append(known | set(listed))
    return total, more


@pytest.mark.parametrize("pitch_deg", [-30.0, 0.0, 15.0])
def test_flying_sets_pass_what_dense_samples_pass(pitch_deg: float) -> None:
    automaton = MovementAutomaton.plane()
    reach_set = build_reach_set(
        automaton, AvoidanceGrid.uniform(), start_pitch_rad=np.radians(pitch_deg)
    )
    total, more = _differences(automaton, reach_set)
    assert total > 500
    assert more <= 0.01 * total


GRIDS = {
    "even counts, with borders on the axes": AvoidanceGrid.uniform(
        6.0, 6, azimuth_deg=45.0, columns=6, elevation_deg=30.0, rows=4
    ),
    "uneven edges": AvoidanceGrid(
        np.array([0.3, 1.0, 1.1, 2.7, 5.0]),
        np.radians([-70.0, -21.0, -20.0, 3.0, 50.0]),
        elevation_edges_rad=np.radians([-45.0, -15.0, 1.0, 40.0]),
    ),
    "thin layers": AvoidanceGrid.uniform(
        4.0, 40, azimuth_deg=60.0, columns=9, elevation_deg=45.0, rows=7
    ),
    "all round, to the poles": AvoidanceGrid.uniform(
        5.0, 5, azimuth_deg=180.0, columns=12, elevation_deg=90.0, rows=6
    ),
}


@pytest.mark.parametrize("name", GRIDS)
def test_random_walks_through_other_grids(name: str) -> None:
    grid = GRIDS[name]
    automaton = MovementAutomaton.plane(turn_step_deg=20.0, pitch_limit_deg=40.0)
    reach_set = build_reach_set(automaton, grid, method="chaotic", spread=1, depth=8)
    _differences(automaton, reach_set)


def test_tight_turns_and_slow_movements() -> None:
    grid = AvoidanceGrid.uniform(9.0, 9, azimuth_deg=90.0, columns=9, elevation_deg=60.0, rows=9)
    tight = MovementAutomaton.plane(3.0, turn_step_deg=80.0, pitch_limit_deg=None)
    both = MovementAutomaton(
        (*tight.movements, Movement("Slow", 0.7, yaw_rate_rps=0.1, duration_s=0.5)), None
    )
    reach_set = build_reach_set(both, grid, method="harmonic", harmonic=1, depth=6)
    _differences(both, reach_set)


def test_measured_tables_with_corners() -> None:
    plane = MovementAutomaton.plane(turn_step_deg=30.0)
    table = plane.measure(steps=3)
    automaton = MovementAutomaton(plane.movements, plane.pitch_limit_rad, table=table)
    reach_set = build_reach_set(
        automaton, AvoidanceGrid.uniform(6.0, 6, azimuth_deg=60.0, columns=8), method="harmonic"
    )
    _differences(automaton, reach_set)
