"""MeasuredPlant movements: every one after every other, in a file, and flown by what they say."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.avoidance.escape.finder import WaysOut
from clearway.avoidance.plan.evidence import gather_in_reach
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.avoidance.plan.situation import Situation
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.missions.automaton_file import automaton_file, read_automaton, write_automaton
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach.escapes.library import EscapeLibrary
from clearway.reach.flown import fly_reach_set, turns_of
from clearway.reach.store import ReachLibrary
from clearway.sim.plants import PLANTS
from clearway.sim.plants.exact_rounds import with_exact_rounds
from clearway.sim.plants.measuring import (
    MeasuredPlant,
    MeasureSettings,
    fit_tube,
    measure_plant,
    round_of_pairs,
)
from clearway.sim.plants.plant import PlantKind, own_plant
from clearway.vehicle.automaton import MovementAutomaton
from clearway.vehicle.class_table import ClassTable
from in_process import clearway

SETTINGS = MeasureSettings(flights=2, held_out=1, seed=3)
ASKED = MovementAutomaton.inertialess(2.0, 15.0, duration_s=2.0, climb_mps=0.5, diagonals=False)


def way(table: ClassTable, previous: str, name: str) -> FloatArray:
    """[steps, 4] of a movement after another one."""
    return table.paths[table.classes.index(previous), table.names.index(name)]


def in_class_after(automaton: MovementAutomaton, state: State, previous: str) -> State:
    """A state after a movement."""
    assert automaton.classes is not None
    return automaton.in_class(state, automaton.classes.classes.index(previous))


class Lagging:
    """A vehicle that takes half a second to do what it is asked for."""

    def __init__(self, state, speed_mps, _air):
        self.state, self.now = np.array(state, dtype=float), np.array([speed_mps, 0.0, 0.0])
        self.outputs = {}

    def begin(self, movement):
        self.asked = np.array([movement.speed_mps, movement.yaw_rate_rps, movement.climb_mps or 0])

    def step(self, duration_s):
        self.now = self.now + (self.asked - self.now) * (1.0 - np.exp(-duration_s / 0.5))
        speed, rate, climb = self.now
        yaw = self.state[5] + rate * duration_s
        way = np.array([speed * np.cos(yaw), speed * np.sin(yaw), climb]) * duration_s
        self.state = np.concatenate([self.state[:3] + way, [0.0, 0.0, yaw]])


@pytest.fixture(scope="module")
def kind() -> PlantKind:
    return own_plant("plant lagging", Lagging)


@pytest.fixture(scope="module")
def measured(kind: PlantKind) -> MeasuredPlant:
    return measure_plant(kind, ASKED, SETTINGS)


@given(st.integers(1, 9), st.integers(0, 5))
def test_a_round_of_pairs_flies_each_after_each_once(count: int, seed: int):
    names = [f"m{n}" for n in range(count)]
    way = round_of_pairs(names, np.random.default_rng(seed))
    pairs = list(pairwise(way))
    assert len(pairs) == len(set(pairs)) == count**2
    assert way[0] == way[-1]


def test_what_was_measured_predicts_far_better_than_the_closed_form(measured: MeasuredPlant):
    assert measured.samples == 2 * len(ASKED.names) ** 2
    for own, closed in zip(measured.error_m, measured.closed_form_m, strict=True):
        assert np.quantile(own, 0.95) < 0.2 * np.quantile(closed, 0.95)
    table = measured.automaton.classes
    assert table is not None
    # A lag of T: after a stop from v, v T (1 - exp(-t / T)) are left to go.
    braked = way(table, "Straight", "Hold")[-1]
    assert braked[0] == pytest.approx(2.0 * 0.5 * (1.0 - np.exp(-4.0)), abs=0.15)
    assert list(table.tube_m) == sorted(table.tube_m)
    inside = [(each <= table.tube_m[n]).mean() for n, each in enumerate(measured.error_m)]
    assert min(inside) >= 0.99


def test_the_tube_holds_the_pair_that_strays_most_also_where_it_is_flown_over_and_over():
    """Random rounds fly each pair once; a flight may fly the worst again and again."""
    rng = np.random.default_rng(5)
    near, far = rng.normal(0.0, 0.02, 990), rng.normal(0.0, 0.1, 10)
    first, second = np.abs(np.concatenate([near, far])), np.full(1000, 0.4)
    tube_m = fit_tube([first, second], worst_m=0.1)
    worst = np.abs(rng.normal(0.0, 0.1, 10_000))
    assert (worst <= tube_m[0]).mean() >= 0.985
    assert tube_m[1] / tube_m[0] == pytest.approx(0.4 / fit_tube([first], 0.0)[0])
    # Where no pair strays more than the others, errors alone say how wide it is.
    assert fit_tube([first, second], worst_m=0.01) == (np.sort(first)[-1], 0.4)
    assert fit_tube([np.zeros(9)], worst_m=0.0) == (0.0,)


def test_it_can_stand_and_circle_for_ever_whatever_was_flown_before(measured: MeasuredPlant):
    automaton = measured.automaton
    assert automaton.can_stop
    assert automaton.hold is not None
    assert automaton.hold.name == "Hold"
    escapes = EscapeLibrary.of(automaton)
    assert escapes.exists
    table = automaton.classes
    assert table is not None
    for name in automaton.names:
        assert len(
            escapes.ways[escapes.nearest(table.label_of(table.classes.index(name)), 0.0)].begins
        )
    # The way to a stop from full speed brakes first.
    straight = escapes.nearest(table.label_of(table.classes.index("Straight")), 0.0)
    hold = automaton.names.index("Hold")
    assert escapes.legs.path[straight, hold, -1, 0] > 0.5


def test_reach_sets_are_rooted_at_what_was_flown_last(measured: MeasuredPlant):
    automaton = measured.automaton
    library = ReachLibrary.build(automaton, AvoidanceGrid.uniform(range_m=20.0))
    reach_set = library.nearest(0.0)
    state = in_class_after(automaton, State(np.zeros(3), [0.2, -0.3, 0.4]), "Left")
    roll = float(state.attitude_rad[0])
    flown, _ = fly_reach_set(reach_set, turns_of(reach_set), automaton, roll, 0.0)
    names = [automaton.names[m] for m in flown.movement]
    table = automaton.classes
    assert table is not None
    first = [n for n in range(flown.nodes) if flown.parent[n] < 0]
    for n in first:
        expected = way(table, "Left", names[n])[-1, :3]
        np.testing.assert_allclose(flown.states[n, :3], expected, atol=1e-12)
    second = next(n for n in range(flown.nodes) if flown.parent[n] in first)
    parent = int(flown.parent[second])
    vector = automaton.rollout(state.vector, [names[parent], names[second]]).states[-1]
    turned = vector[:3] @ [[np.cos(0.4), -np.sin(0.4), 0], [np.sin(0.4), np.cos(0.4), 0], [0, 0, 1]]
    np.testing.assert_allclose(flown.states[second, :3], turned, atol=1e-9)


def test_every_movement_that_may_have_been_flown_last_has_a_reach_set_of_its_own(
    measured: MeasuredPlant,
):
    automaton = measured.automaton
    table = automaton.classes
    assert table is not None
    library = ReachLibrary.build(
        automaton, AvoidanceGrid.uniform(range_m=12.0), method="primitives"
    )
    planner = Planner.of(library)
    for previous in automaton.names:
        state = in_class_after(automaton, State(np.zeros(3)), previous)
        reach_set = planner.prepare_at(state).reach_set
        for n in np.flatnonzero(reach_set.parent < 0):
            name = automaton.names[reach_set.movement[n]]
            expected = way(table, previous, name)[-1, :3]
            np.testing.assert_allclose(reach_set.states[n, :3], expected, atol=1e-9)
    roots = [one.reach_set.start_pitch_rad for _, one in planner.prepared_sets]
    assert len(set(roots)) == len(automaton.names)


def test_ways_out_keep_clear_by_the_tube(measured: MeasuredPlant):
    automaton = measured.automaton
    library = ReachLibrary.build(
        automaton, AvoidanceGrid.uniform(range_m=12.0), method="primitives"
    )
    body_m = 0.3

    def margin_of_hold(tube_m: tuple[float, ...]) -> bool:
        """Whether a stop from rest holds beside something that stands 1 m and the body away."""
        table = automaton.classes
        assert table is not None
        sure = replace(automaton, table=replace(table, tube_m=tube_m))
        settings = AvoidanceSettings(safety_margin_m=1.0, body_radius_m=body_m, escape="known")
        planner = Planner.of(replace(library, automaton=sure), settings)
        beside = ObstacleMap([Obstacle.ball([0.0, 2.1, 0.0], 1.0)])
        state = in_class_after(sure, State(np.zeros(3)), "Hold")
        situation = Situation(state, target_m=np.array([50.0, 0, 0]), obstacle_map=beside)
        assert planner.escapes is not None
        near = gather_in_reach(planner, situation)
        return WaysOut(planner, planner.escapes, situation, near).now() is not None

    assert margin_of_hold((0.01,) * 8)
    assert not margin_of_hold((0.2,) * 8)


def test_a_file_holds_all_of_it(measured: MeasuredPlant, tmp_path: Path):
    file = tmp_path / "lagging.toml"
    write_automaton(automaton_file("lagging", measured, SETTINGS), file)
    read = read_automaton(file)
    state = [1.0, 2.0, 3.0, 0.0, 0.0, 0.5]
    names = ["Straight", "Left", "Hold", "Turn-Right", "Up"]
    expected = measured.automaton.rollout(state, names).states
    np.testing.assert_allclose(read.rollout(state, names).states, expected, atol=1e-4)
    assert read.can_stop
    shown = clearway("automaton", "show", file, "--json")
    told = json.loads(shown.stdout)
    assert len(told["pair"]) == len(ASKED.names) ** 2
    assert "13 movements, 169 of 169 pairs" in clearway("automaton", "show", file).stdout


@pytest.mark.parametrize(
    ("was", "becomes", "wrong"),
    [
        ('first = "Hold"', 'first = "Fall"', "first is 'Fall'"),
        ('previous = "Hold"', 'previous = "Fall"', "unknown; there are"),
        ("duration_s = 2.0", "duration_s = -2.0", "duration_s"),
    ],
)
def test_a_file_that_does_not_fit_is_refused(
    measured: MeasuredPlant, tmp_path: Path, was: str, becomes: str, wrong: str
):
    file = tmp_path / "bad.toml"
    write_automaton(automaton_file("lagging", measured, SETTINGS), file)
    text = file.read_text()
    assert was in text
    file.write_text(text.replace(was, becomes, 1))
    with pytest.raises(InputError, match=wrong):
        read_automaton(file)


def test_a_turn_that_is_asked_to_climb_is_not_made_level_however_much_it_spreads():
    shares = np.arange(1, 9)[:, None] / 8.0
    climbing = {("Up-Left", "Up-Left"): shares * np.array([200.0, 30.0, 10.0, 0.26])}
    spread_m = {("Up-Left", "Up-Left"): 10.0}
    kept = with_exact_rounds(climbing, spread_m, level=["Left"])["Up-Left", "Up-Left"]
    assert kept[-1].tolist() == [200.0, 30.0, 10.0, 0.26]
    made = with_exact_rounds(climbing, spread_m, level=["Up-Left"])["Up-Left", "Up-Left"]
    assert np.all(made[:, 2] == 0.0)


def test_what_stands_after_something_that_stands_does_so_exactly():
    shares = np.arange(1, 9)[:, None] / 8.0
    off = shares * np.array([-0.01, 0.02, -0.02, 0.8])
    braking = shares * np.array([2.0, 0.1, 0.0, 0.8])
    paths = {(a, b): off for a in ("Hold", "Turn") for b in ("Hold", "Turn")}
    paths["Straight", "Turn"] = braking
    exact = with_exact_rounds(paths, dict.fromkeys(paths, 0.05), level=["Hold", "Turn", "Straight"])
    for pair in paths:
        stands = pair[0] != "Straight"
        assert np.any(exact[pair][:, :3]) != stands
        assert exact[pair][-1, 3] == 0.8
    wide = with_exact_rounds(paths, dict.fromkeys(paths, 0.005), level=["Hold", "Turn"])
    assert np.array_equal(wide["Hold", "Turn"], off), "farther off than it spreads"


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "gusts_mps", "movements", "most_m"),
    [("quadrotor", 0.0, 1, 0.1), ("c172x", 0.0, 5, 20.0), ("c172x", 2.5, 5, 35.0)],
)
def test_flights_held_out_are_predicted_as_well_as_asked_for(
    name: str, gusts_mps: float, movements: int, most_m: float
):
    if name != "quadrotor":
        pytest.importorskip("jsbsim")
    kind = PLANTS.find(name)
    assert kind.movements is not None
    found = measure_plant(kind, kind.movements(), MeasureSettings(4, 2, gusts_mps=gusts_mps))
    assert np.quantile(found.error_m[movements - 1], 0.95) <= most_m
    table = found.automaton.classes
    assert table is not None
    inside = found.error_m[movements - 1] <= table.tube_m[movements - 1]
    assert inside.mean() >= 0.99
