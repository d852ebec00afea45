"""Sets chosen for what they cover: dispersed nodes, few nodes, many footprints, and for flying."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clearway.base.grid import AvoidanceGrid
from clearway.reach.choose.cover import (
    end_cells,
    footprints,
    greedy_cover,
    headings_in_cells,
    list_passed_cells,
)
from clearway.reach.choose.dispersion import farthest_of_cell
from clearway.reach.choose.keep import best_of_cell, harmonic
from clearway.reach.choose.late import most_footprints, near_corners
from clearway.reach.choose.primitives import primitives
from clearway.reach.choose.select import Select, merge_sets, select_by_keeping, tree_of
from clearway.reach.choose.unique import without_duplicate_states
from clearway.reach.expand.buffers import ByteArray
from clearway.reach.expand.lattice import Lattice
from clearway.reach.tree import LAST_LAYER


def select_dispersed(spread: float = 6.0, side_exits: float = 1.0) -> Select:
    """From every cell the `spread` nodes that lie farthest apart go on."""

    def select(
        lattice: Lattice, grid: AvoidanceGrid, start_pitch_rad: float, deep: int
    ) -> ByteArray:
        rule = farthest_of_cell(int(spread), _look_ahead_m(lattice, grid))
        return select_by_keeping(rule, side_exits)(lattice, grid, start_pitch_rad, deep)

    return select


def select_cover(pool: float = 6.0) -> Select:
    """Few nodes for all cells: a greedy cover out of primitives, dispersed and harmonic nodes."""

    def select(
        lattice: Lattice, grid: AvoidanceGrid, start_pitch_rad: float, deep: int
    ) -> ByteArray:
        held = primitives(lattice, grid, start_pitch_rad, deep)
        others = merge_sets(
            select_dispersed(pool, side_exits=0.0)(lattice, grid, start_pitch_rad, deep),
            select_by_keeping(best_of_cell(harmonic, int(pool)), side_exits=0.0)(
                lattice, grid, start_pitch_rad, deep
            ),
        )
        buffers = without_duplicate_states(held, others, lattice, start_pitch_rad)
        if not len(buffers):
            return buffers
        tree = tree_of(buffers, lattice, grid, start_pitch_rad)
        buffers = buffers[tree.exit_kind[tree.trajectories] == LAST_LAYER]
        tree = tree_of(buffers, lattice, grid, start_pitch_rad)
        return greedy_cover(tree, buffers, buffers[:0], lattice.mirror, end_cells(tree))

    return select


def select_late(
    nodes: float = 2480.0, width: float = 10.0, entry: float = 10.0, layers: float = 3.0
) -> Select:
    """The cover, and as many footprints as late branches make of up to `nodes` nodes.

    `width` nodes of every cell follow the corners between cells; behind the `entry` best of them
    the pool branches in full, over the last `layers` layers.
    """

    def select(
        lattice: Lattice, grid: AvoidanceGrid, start_pitch_rad: float, deep: int
    ) -> ByteArray:
        held = select_cover()(lattice, grid, start_pitch_rad, deep)
        rule = near_corners(int(width), int(entry), int(layers), 2.0 * lattice.automaton.step_m)
        branches = select_by_keeping(rule, side_exits=0.0)(lattice, grid, start_pitch_rad, deep)
        buffers = merge_sets(held, branches)
        if not len(buffers):
            return buffers
        tree = tree_of(buffers, lattice, grid, start_pitch_rad)
        branched = most_footprints(tree, buffers, held, lattice.mirror, int(nodes))
        # Whole clusters of branches come at one cost, so some room is left for single ones.
        return greedy_cover(tree, buffers, branched, lattice.mirror, footprints(tree), nodes)

    return select


def select_for_flying(pool: float = 6.0, nodes_per_cell: float = 2.5) -> Select:
    """The primitives, a cover of all cells of a dispersed pool, and more headings in them.

    The pool is expanded from the `pool` most different nodes of every cell. Headings are added
    until there are `nodes_per_cell` nodes for every cell covered.
    """

    def select(
        lattice: Lattice, grid: AvoidanceGrid, start_pitch_rad: float, deep: int
    ) -> ByteArray:
        held = primitives(lattice, grid, start_pitch_rad, deep)
        spread = select_dispersed(pool)(_on_the_move(lattice), grid, start_pitch_rad, deep)
        buffers = without_duplicate_states(held, spread, lattice, start_pitch_rad)
        if not len(buffers):
            return buffers
        tree = tree_of(buffers, lattice, grid, start_pitch_rad)
        cells = list_passed_cells(tree)
        most = nodes_per_cell * len(set(tree.cell_index.tolist()))
        covered = greedy_cover(tree, buffers, held, lattice.mirror, cells)
        headings = headings_in_cells(tree)
        return greedy_cover(tree, buffers, covered, lattice.mirror, headings, most)

    return select


def _on_the_move(lattice: Lattice) -> Lattice:
    """The lattice without what stands: by it every place can be come to in many ways, each as far
    from the others as any, and hardly any would be left that fly on."""
    stands = np.array(lattice.automaton.stands)
    if not stands.any():
        return lattice
    following = np.where(stands, np.int32(-1), lattice.pieces.following)
    return replace(lattice, pieces=lattice.pieces._replace(following=following))


def _look_ahead_m(lattice: Lattice, grid: AvoidanceGrid) -> float:
    """A turn counts as far as it leads off over the turning radius, within reason."""
    return min(lattice.automaton.turning_radius_m, grid.range_m)
