"""The libraries that ship with the package.

`python -m clearway.reach.standard` builds them anew, after a change of any selection.
"""

from __future__ import annotations

import sys

from clearway.base.grid import AvoidanceGrid
from clearway.reach.store import SHIPPED, ReachLibrary
from clearway.vehicle.automaton import MovementAutomaton


def standard_libraries() -> tuple[tuple[MovementAutomaton, AvoidanceGrid], ...]:
    """The plane with its pitch limit on the two standard grids."""
    plane = MovementAutomaton.plane()
    return ((plane, AvoidanceGrid.uniform()), (plane, AvoidanceGrid.uniform(15.0, 15)))


def main() -> None:
    """Write the libraries into the package's own folder, and nothing else there."""
    for old in SHIPPED.glob("reach-*.bin"):
        old.unlink()
    for automaton, grid in standard_libraries():
        path = ReachLibrary.build(automaton, grid).store(SHIPPED)
        print(f"{path.name}: {path.stat().st_size} bytes", file=sys.stderr)


if __name__ == "__main__":
    main()
