"""The libraries that ship with the package.

`python -m clearway.reach.standard` builds them anew, after a change of any selection.
"""

from __future__ import annotations

import sys

from clearway.base.errors import InputError
from clearway.base.grid import AvoidanceGrid
from clearway.reach.escapes.legs import legs_from_level
from clearway.reach.escapes.store import hash_escapes, name_of, search_escapes, store
from clearway.reach.store import SHIPPED, ReachLibrary
from clearway.vehicle.automaton import MovementAutomaton


def standard_libraries() -> tuple[tuple[MovementAutomaton, AvoidanceGrid], ...]:
    """The plane with its pitch limit on the two standard grids."""
    plane = MovementAutomaton.plane()
    return ((plane, AvoidanceGrid.uniform()), (plane, AvoidanceGrid.uniform(15.0, 15)))


def standard_automata() -> tuple[MovementAutomaton, ...]:
    """Those whose escapes ship: the plane with its pitch limit, and the multirotor."""
    return (MovementAutomaton.plane(), MovementAutomaton.inertialess())


def main() -> None:
    """Write the libraries into the package's own folder, and nothing else there."""
    for old in SHIPPED.glob("*.bin"):
        old.unlink()
    for automaton, grid in standard_libraries():
        path = ReachLibrary.build(automaton, grid).store(SHIPPED)
        print(f"{path.name}: {path.stat().st_size} bytes", file=sys.stderr)
    for automaton in standard_automata():
        _, legs = legs_from_level(automaton)
        key = hash_escapes(automaton, legs)
        path = SHIPPED / name_of(key)
        store(path, key, search_escapes(automaton, legs), _refuse)
        print(f"{path.name}: {path.stat().st_size} bytes", file=sys.stderr)


def _refuse(cause: OSError) -> None:
    raise InputError(str(SHIPPED), str(cause))


if __name__ == "__main__":
    main()
