"""Growth of reach sets with layers, columns and movements, as `python -m benchmarks.growth`.

(6.5) bounds the nodes by a product, so nodes, memory and time should grow as a power of each
factor; the table gives the powers that are measured.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from clearway.base.grid import AvoidanceGrid
from clearway.reach import ReachSet, build_reach_set
from clearway.reach.compare.comparison import compute_bound_6_5
from clearway.vehicle.automaton import MovementAutomaton

SPREAD = 5
METHODS = {"combined": {"harmonic": 2.0, "spread": 3.0}, "cover": {}, "flying": {}}


@dataclass(frozen=True, slots=True)
class Size:
    """One grid and automaton."""

    layers: int = 10
    columns: int = 7
    turn_step_deg: float = 15.0
    movements: int = 9

    def build(self, method: str) -> tuple[ReachSet, float]:
        """The level set, and the seconds that it took the second time."""
        grid = AvoidanceGrid.uniform(float(self.layers), self.layers, columns=self.columns)
        automaton = MovementAutomaton.plane(
            turn_step_deg=self.turn_step_deg, diagonals=self.movements == 9
        )
        build_reach_set(automaton, grid, method=method, **METHODS[method])
        began = time.perf_counter()
        built = build_reach_set(automaton, grid, method=method, **METHODS[method])
        return built, time.perf_counter() - began


def sizes() -> dict[str, tuple[Size, ...]]:
    """Sizes that differ in one thing, by its name."""
    return {
        "layers": tuple(Size(layers=layers) for layers in (5, 10, 15, 20, 25)),
        "columns": tuple(Size(columns=columns) for columns in (3, 7, 13, 21)),
        "movements": tuple(Size(movements=movements) for movements in (5, 9)),
        "turn_step_deg": tuple(Size(turn_step_deg=step) for step in (5.0, 10.0, 15.0, 30.0)),
    }


def memory_bytes(reach_set: ReachSet) -> int:
    """Bytes of all arrays of a set."""
    values = (getattr(reach_set, field.name) for field in dataclasses.fields(reach_set))
    return sum(value.nbytes for value in values if isinstance(value, np.ndarray))


def table() -> Iterator[str]:
    """Lines of a table in Markdown."""
    yield "| varied | method | value | nodes | kB | ms | power of nodes, of time |"
    yield "|---|---|---|---|---|---|---|"
    for name, varied in sizes().items():
        values = np.array([float(getattr(size, name)) for size in varied])
        for method in METHODS:
            built = [size.build(method) for size in varied]
            nodes = np.array([tree.nodes for tree, _ in built], dtype=np.float64)
            seconds = np.array([taken for _, taken in built])
            powers = [np.polyfit(np.log(values), np.log(y), 1)[0] for y in (nodes, seconds)]
            if method == "combined":
                for size, (tree, _) in zip(varied, built, strict=True):
                    assert tree.nodes <= compute_bound_6_5(size.movements, SPREAD, tree.grid)
            yield (
                f"| {name} | {method} | {_row(values)} | {_row(nodes)} "
                f"| {_row([memory_bytes(tree) / 1e3 for tree, _ in built])} "
                f"| {_row(1e3 * seconds)} | {powers[0]:.1f}, {powers[1]:.1f} |"
            )


def _row(values: object) -> str:
    return ", ".join(f"{value:.0f}" for value in np.asarray(values, dtype=np.float64))


if __name__ == "__main__":
    for line in table():
        print(line)
