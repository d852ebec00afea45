"""Reach sets: reference figures, laws of every tree, and the paths against the automaton."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
import pytest

from clearway.base.errors import ClearwayError
from clearway.base.frames import world_from_body
from clearway.base.grid import AvoidanceGrid
from clearway.reach.choose.coverage import measure_coverage
from clearway.reach.sets import METHODS, build_reach_set
from clearway.reach.tree import LAST_LAYER, SIDE
from clearway.vehicle.automaton import Movement, MovementAutomaton
from clearway.vehicle.table import MovementTable

PLANE = MovementAutomaton.plane()
FREE = MovementAutomaton.plane(pitch_limit_deg=None)
FIVE = MovementAutomaton.plane(diagonals=False)
GRID = AvoidanceGrid.uniform()
SMALL = AvoidanceGrid.uniform(5.0, 5)
STEP = float(np.radians(15.0))

CASES = [
    pytest.param(PLANE, grid, method, pitch, id=f"{method}-{grid.layers}-{round(pitch, 2)}")
    for grid, method, pitch in [
        (SMALL, "full", 0.0),
        (GRID, "chaotic", 0.0),
        (GRID, "harmonic", STEP),
        (GRID, "combined", -STEP),
        (GRID, "primitives", 2 * STEP),
        (GRID, "dispersion", 0.0),
        (GRID, "cover", STEP),
        (SMALL, "late", 0.0),
        (GRID, "flying", 0.0),
        (GRID, "flying", -2 * STEP),
    ]
] + [
    pytest.param(
        MovementAutomaton.plane(12.0, 10.0, duration_s=0.8),
        AvoidanceGrid.uniform(
            (20.0, 150.0), 11, azimuth_deg=60.0, columns=9, elevation_deg=(-20.0, 40.0), rows=6
        ),
        "flying",
        0.0,
        id="fast-and-far",
    ),
    pytest.param(
        MovementAutomaton.plane(0.7), AvoidanceGrid.uniform(7.0, 10), "flying", 0.0, id="slow"
    ),
    pytest.param(FIVE, GRID, "flying", 0.0, id="five-movements"),
    pytest.param(
        MovementAutomaton.plane(turn_step_deg=10.0),
        AvoidanceGrid.uniform(25.0, 25, columns=9),
        "cover",
        0.0,
        id="ten-degrees-25-layers",
    ),
    pytest.param(
        MovementAutomaton.plane(turn_step_deg=5.0), GRID, "combined", STEP / 3, id="five-degrees"
    ),
    pytest.param(
        MovementAutomaton.plane(turn_step_deg=30.0, pitch_limit_deg=60.0),
        GRID,
        "flying",
        0.0,
        id="thirty-degrees",
    ),
]


def buffers(reach_set):
    return {reach_set.movements_to(int(node)) for node in reach_set.trajectories}


@cache
def built(automaton, grid, method, pitch):
    return build_reach_set(automaton, grid, method=method, start_pitch_rad=pitch)


@pytest.mark.parametrize(("automaton", "grid", "method", "pitch"), CASES)
def test_laws_of_every_tree(automaton, grid, method, pitch):
    tree = built(automaton, grid, method, pitch)
    nodes = np.arange(tree.nodes)
    assert np.all(tree.parent < nodes)
    has_child = np.isin(nodes, tree.parent)
    assert np.array_equal(has_child, ~tree.complete), "leaves, and only they, are complete"
    below = tree.parent >= 0
    assert np.array_equal(tree.depth[below], tree.depth[tree.parent[below]] + 1)
    assert np.all(tree.depth[~below] == 1)
    assert len({tree.movements_to(int(node)) for node in nodes}) == tree.nodes
    assert np.array_equal(tree.end_cell, grid.cell_of(tree.states[:, :3]))
    last = tree.exit_kind == LAST_LAYER
    per_layer = grid.columns * grid.rows
    assert np.all((tree.end_cell[last] // per_layer == grid.layers - 1) | (tree.end_cell[last] < 0))
    assert np.all(tree.end_cell[tree.exit_kind == SIDE] == -1)
    assert np.array_equal(tree.samples_m[:, -1], tree.states[:, :3])


@pytest.mark.parametrize(("automaton", "grid", "method", "pitch"), CASES)
def test_nodes_lie_where_the_automaton_predicts(automaton, grid, method, pitch):
    tree = built(automaton, grid, method, pitch)
    to_grid = world_from_body([0.0, pitch, 0.0]).T
    start = np.array([0.0, 0.0, 0.0, 0.0, pitch, 0.0])
    for node in np.linspace(0, tree.nodes - 1, 25).astype(int):
        names = tree.movements_to(node)
        path = automaton.rollout(start, names, step_s=automaton.movements[0].duration_s / 32)
        assert tree.states[node, :3] == pytest.approx(to_grid @ path.states[-1, :3], abs=1e-9)
        assert tree.states[node, 3:] == pytest.approx(path.states[-1, 3:], abs=1e-9)
        assert tree.end_time_s[node] == pytest.approx(path.time_s[-1])
        flown = sum(automaton[name].speed_mps * automaton[name].duration_s for name in names)
        assert tree.length_m[node] == pytest.approx(flown)
        # The fine path stays within the sagitta of the chords between samples.
        fine = path.states[-33:, :3] @ to_grid.T
        samples = np.concatenate([fine[:1], tree.samples_m[node]])
        gap = max(_from_chords(point, samples) for point in fine)
        assert gap <= tree.sagitta_m[node] + 1e-12
        passed = set()
        for above in tree.path(node):
            passed |= set(tree.cell_index[tree.cell_start[above] : tree.cell_start[above + 1]])
        ends = {int(tree.end_cell[above]) for above in tree.path(node)} - {-1}
        assert ends <= passed


def _from_chords(point, corners):
    """Distance of a point from a polyline."""
    best = np.inf
    for start, end in itertools.pairwise(corners):
        along = end - start
        share = np.clip((point - start) @ along / (along @ along), 0.0, 1.0)
        best = min(best, np.linalg.norm(point - start - share * along))
    return best


@pytest.mark.parametrize(("automaton", "grid", "method", "pitch"), CASES)
def test_no_cell_twice_on_a_way(automaton, grid, method, pitch):
    tree = built(automaton, grid, method, pitch)
    for leaf in tree.trajectories[::7]:
        cells = np.concatenate(
            [tree.cell_index[tree.cell_start[n] : tree.cell_start[n + 1]] for n in tree.path(leaf)]
        )
        assert len(np.unique(cells)) == len(cells)
        assert np.all((cells >= 0) & (cells < grid.cells))


@pytest.mark.parametrize(("automaton", "grid", "method", "pitch"), CASES)
def test_mirror_symmetric_and_deterministic(automaton, grid, method, pitch):
    tree = built(automaton, grid, method, pitch)
    names = dict(zip(automaton.names, (automaton.names[i] for i in automaton.mirror), strict=True))
    ways = buffers(tree)
    assert {tuple(names[name] for name in way) for way in ways} == ways
    again = build_reach_set(automaton, grid, method=method, start_pitch_rad=pitch)
    assert again.parent.tobytes() == tree.parent.tobytes()
    assert again.samples_m.tobytes() == tree.samples_m.tobytes()


def test_full_set_holds_every_trajectory():
    """By brute force: every chain of movements that stays inside until the last layer."""
    grid = AvoidanceGrid.uniform(4.0, 4)
    tree = build_reach_set(FREE, grid, method="full", side_exits=0)
    found = set()

    def follow(state, way, layer):
        for movement in FREE.movements:
            end = FREE.predict(state, movement)
            cell = int(grid.cell_of(end[:3]))
            at = cell // 35
            if cell < 0 or at < layer:
                continue
            longer = (*way, movement.name)
            if at == 3:
                found.add(longer)
            elif len(longer) < 4:
                follow(end, longer, at)

    follow(np.zeros(6), (), 0)
    assert buffers(tree) == found


@pytest.mark.parametrize(
    ("method", "tuning", "nodes", "trajectories", "smoothness"),
    [
        ("chaotic", {"spread": 9}, 2880, 1944, 0.007),
        ("harmonic", {"harmonic": 1}, 207, 81, 0.63),
        ("harmonic", {"harmonic": 3}, 1399, 891, 0.52),
        ("combined", {"harmonic": 3, "spread": 5}, 3370, 2241, 0.21),
    ],
)
def test_reference_figures_of_table_6_1(method, tuning, nodes, trajectories, smoothness):
    """SPEC 4; other rules for ties move them by up to 15 %."""
    grid = AvoidanceGrid.uniform(15.0, 15)
    tree = build_reach_set(FREE, grid, method=method, side_exits=0, **tuning)
    assert tree.nodes == pytest.approx(nodes, rel=0.15)
    assert len(tree.trajectories) == pytest.approx(trajectories, rel=0.15)
    smooth = np.array(tree.movement_smooth)
    shares = [np.mean(smooth[tree.movement[tree.path(n)]]) for n in tree.trajectories]
    assert np.mean(shares) == pytest.approx(smoothness, abs=0.05)


def test_primitives_turn_then_fly_straight():
    tree = build_reach_set(PLANE, GRID, method="primitives")
    inside = np.count_nonzero(tree.end_cell >= 0)
    assert inside == 388  # SPEC 4 says 389
    for way in buffers(tree):
        left = [name.endswith("Left") for name in way]
        right = [name.endswith("Right") for name in way]
        up = [name.startswith("Up") for name in way]
        assert not (any(left) and any(right))
        for turning in (left, right, up):
            assert turning == sorted(turning, reverse=True), way
    assert ("Straight",) * 10 in buffers(tree)


def test_flying_holds_the_primitives_and_no_state_twice():
    for pitch in PLANE.start_pitches_rad:
        flying = build_reach_set(PLANE, GRID, method="flying", start_pitch_rad=pitch)
        assert buffers(
            build_reach_set(PLANE, GRID, method="primitives", start_pitch_rad=pitch)
        ) <= buffers(flying)
        assert 400 <= flying.nodes <= 1500
        states = np.column_stack([np.round(flying.states / 1e-6), flying.depth])
        assert len(np.unique(states, axis=0)) == flying.nodes


def test_level_flying_set_reaches_all_cells_that_can_be_reached():
    """278 of 350 and 453 of 525 (SPEC 4)."""
    for grid, cells in ((GRID, 278), (AvoidanceGrid.uniform(15.0, 15), 453)):
        ends = build_reach_set(PLANE, grid, method="flying").end_cell
        assert len(np.unique(ends[ends >= 0])) == cells


@pytest.mark.parametrize(("layers", "cells", "nodes"), [(10, 278, 330), (15, 453, 500)])
def test_cover_reaches_every_cell_with_few_smooth_nodes(layers, cells, nodes):
    covered = measure_coverage(
        build_reach_set(FREE, AvoidanceGrid.uniform(layers, layers), method="cover")
    )
    assert covered.cells_covered == cells
    assert covered.nodes <= nodes
    assert covered.smoothness >= 0.4


@pytest.mark.nightly
def test_late_branches_make_many_footprints_of_few_nodes():
    late = measure_coverage(build_reach_set(FREE, AvoidanceGrid.uniform(15.0, 15), method="late"))
    assert late.footprints >= 1000
    assert late.nodes <= 2480
    assert late.cells_covered == 453


def test_dispersed_nodes_are_never_the_same_state():
    tree = build_reach_set(PLANE, GRID, method="dispersion", spread=4)
    going_on = tree.parent[tree.parent >= 0]
    states = np.round(tree.states[np.unique(going_on)] / 1e-6)
    assert len(np.unique(states, axis=0)) == len(states)


def test_merging_keeps_every_trajectory_of_both():
    tuning = {"harmonic": 2, "spread": 3}
    both = build_reach_set(PLANE, GRID, method="combined", **tuning)
    harmonic = build_reach_set(PLANE, GRID, method="harmonic", harmonic=2)
    chaotic = build_reach_set(PLANE, GRID, method="chaotic", spread=3)
    assert buffers(both) == buffers(harmonic) | buffers(chaotic)


def test_hovering_vehicle_with_vertical_movements():
    rows = {
        "Ahead": [1, 0, 0, 0, 0, 0],
        "Hover": [0, 0, 0, 0, 0, 0],
        "Climb": [0, 0, 1, 0, 0, 0],
        "Sink": [0, 0, -0.6, 0, 0, 0],
        "Left": [0.9, 0.3, 0, 0, 0, 0.5],
        "Right": [0.9, -0.3, 0, 0, 0, -0.5],
    }
    hover = MovementAutomaton(
        tuple(Movement(name, 1.0, smooth=name == "Ahead") for name in rows),
        table=MovementTable.from_rows(rows),
    )
    tree = build_reach_set(hover, GRID, method="harmonic", harmonic=2)
    assert ("Climb",) in buffers(tree)
    assert any("Climb" in way and "Ahead" in way for way in buffers(tree))


def test_movements_known_by_measurement_alone():
    """(4.14) is off by up to 3 cm a movement; the set reaches as many cells all the same."""
    table = PLANE.measure(4)
    measured = MovementAutomaton(PLANE.movements, PLANE.pitch_limit_rad, table=table)
    coverage = measure_coverage(build_reach_set(measured, GRID, method="cover"))
    assert coverage.cells_covered == 278
    assert coverage.nodes <= 330


def test_two_speeds_and_unlike_climb_rates():
    automaton = MovementAutomaton(
        (
            Movement("Slow", 1.0, smooth=True),
            Movement("Fast", 2.0, smooth=True),
            Movement("Climb", 1.0, pitch_rate_rps=-np.radians(5)),
            Movement("Sink", 1.0, pitch_rate_rps=np.radians(10)),
        ),
        np.radians(10),
    )
    assert np.degrees(automaton.start_pitches_rad) == pytest.approx([-10, -5, 0, 5, 10])
    tree = build_reach_set(automaton, GRID, method="flying")
    assert {"Slow", "Fast", "Climb", "Sink"} <= {name for way in buffers(tree) for name in way}


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (
            lambda: build_reach_set(PLANE, GRID, method="best"),
            "valid reach set methods are full, chaotic",
        ),
        (lambda: build_reach_set(PLANE, GRID, method="chaotic", width=3), "it takes depth, spread"),
        (lambda: build_reach_set(PLANE, GRID, method="chaotic", spread=0), "at least 1"),
        (lambda: build_reach_set(PLANE, GRID, method="full"), "outgrows"),
        (lambda: build_reach_set(PLANE, GRID, method="flying", depth=3), "leads through"),
        (
            lambda: build_reach_set(MovementAutomaton.plane(0.01), GRID, method="flying"),
            "takes 1000 movements of 0.01 m, more than 100",
        ),
        (
            lambda: build_reach_set(
                MovementAutomaton((Movement("Stay", 0.0),)), GRID, method="full"
            ),
            "leads anywhere",
        ),
    ],
)
def test_bad_input_is_named(build, words):
    with pytest.raises(ClearwayError, match=words):
        build()


@pytest.mark.parametrize("method", ["chaotic", "harmonic", "combined", "dispersion"])
def test_nodes_stay_within_the_bound(method):
    """(6.5): m (r + 1) h v l for every spread r."""
    for spread in (1, 3, 7):
        tuning = {"harmonic": spread} if method == "harmonic" else {"spread": spread}
        tree = build_reach_set(PLANE, GRID, method=method, **tuning)
        kept = spread + (method == "combined")
        assert tree.nodes <= 9 * (kept + 1) * GRID.cells


def test_method_names():
    assert set(METHODS) >= {"full", "chaotic", "harmonic", "combined", "primitives", "flying"}


def test_sets_of_uneven_grids_that_the_vehicle_soon_leaves():
    """Leaving out duplicates may take away every trajectory of the longest kind."""
    azimuth_deg = [-20.0, -14.85193, -8.62768, -2.063207, 0.947202, 9.29149, 11.914919, 17.62, 20.0]
    elevation_deg = [-10.0, -3.691055, -0.169984, 10.0]
    grid = AvoidanceGrid(
        np.linspace(20.0, 200.0, 4),
        np.radians(azimuth_deg),
        elevation_edges_rad=np.radians(elevation_deg),
    )
    vehicle = MovementAutomaton.plane(12.0)
    tree = build_reach_set(vehicle, grid, method="flying", start_pitch_rad=np.radians(30.0))
    assert tree.nodes > 50
    assert np.count_nonzero(tree.exit_kind) > 10


@pytest.mark.parametrize("method", ["chaotic", "harmonic", "combined"])
def test_layers_thicker_than_a_movement_are_crossed(method):
    grid = AvoidanceGrid(
        np.array([0.0, 1.0, 3.5, 6.0, 10.0]),
        GRID.azimuth_edges_rad,
        elevation_edges_rad=GRID.elevation_edges_rad,
    )
    tree = build_reach_set(PLANE, grid, method=method)
    assert np.count_nonzero(tree.exit_kind == LAST_LAYER) > 0
    assert tree.nodes < 3000
