"""Plants that follow the references of a plan, alone and in the closed loop."""

from __future__ import annotations

import sys
from functools import cache

import numpy as np
import pytest

import clearway as cw
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import State
from clearway.sim.plants import PLANTS, Air
from clearway.sim.plants.kinematic import KinematicPlant
from clearway.sim.plants.measuring import MeasureSettings
from clearway.sim.plants.measuring_classes import measure_copter, round_of_classes
from clearway.sim.plants.plant import LedPlant, PlantKind, leading, own_plant
from clearway.vehicle.class_table import ClassTable
from clearway.vehicle.copter import CopterLimits
from clearway.vehicle.reference import Reference
from repository import REPOSITORY

START = np.array([4.0, -3.0, 12.0, 0.0, 0.0, 0.8])
GUSTS_MPS = 1.0


def mass(limits: CopterLimits) -> PlantKind:
    """The plant that is flown where a mission names none."""

    def make(state: FloatArray, _speed_mps: float, air: Air) -> LedPlant:
        settings = cw.SimulationSettings(gusts_mps=air.gusts_mps, seed=air.seed)
        start = State(state[:3], state[3:])
        noise = np.random.default_rng(air.seed)
        return KinematicPlant(copter(limits), start, settings, noise, 1.0)

    return PlantKind("a mass", make, copter=limits)


@cache
def copter(limits: CopterLimits) -> cw.MovementAutomaton:
    return cw.MovementAutomaton.of_copter(limits)


def flyable(classes: ClassTable, names: list[str]) -> list[str]:
    """Those that may be flown, one after the other, from rest on."""
    at, found = classes.first, []
    for name in names:
        end = int(classes.following[at, classes.names.index(name)])
        if end >= 0:
            found.append(name)
            at = end
    return found


def flown(plant: LedPlant, automaton: cw.MovementAutomaton, names: list[str]) -> FloatArray:
    """[n] distance from the plan, 20 times a second."""
    classes = automaton.classes
    assert classes is not None
    state, off = START.copy(), []
    state[3] = classes.label_of(classes.first)
    names = flyable(classes, names)
    for name, then in zip(names, [*names[1:], names[-1]], strict=True):
        movement, next_one = automaton[name], automaton[then]
        end, lasts_s = automaton.predict(state, movement), movement.duration_s

        def asked(later_s: float, begin=(state, movement, end, next_one, lasts_s)) -> Reference:
            state, movement, end, next_one, lasts_s = begin
            if later_s < lasts_s:
                return Reference.of(automaton, state, movement, later_s)
            return Reference.of(automaton, end, next_one, later_s - lasts_s)

        plant.follow(asked)
        for step in range(1, 9):
            plant.step(lasts_s / 8)
            planned = Reference.of(automaton, state, movement, step * lasts_s / 8)
            off.append(float(np.linalg.norm(plant.state[:3] - planned.position_m)))
        state = end
    return np.array(off)


WAY = (
    ["Accelerate"] * 6
    + ["Keep-Left"] * 4
    + ["Keep-Right"] * 6
    + ["Keep-Up", "Keep-Up", "Keep", "Brake-Half-Left"]
    + ["Brake"] * 6
    + ["Brake-Half"] * 2
    + ["Hold"] * 4
)


@pytest.mark.parametrize("name", ["quadrotor", "F450", "a mass"])
def test_a_plant_keeps_near_its_plan_at_its_own_acceleration(name: str) -> None:
    if name == "F450":
        pytest.importorskip("jsbsim")
    kind = mass(CopterLimits(20.0, 8.0)) if name == "a mass" else PLANTS.find(name)
    assert kind.copter is not None
    automaton = copter(kind.copter)
    off = []
    for seed in range(3):
        plant = leading(kind.make(START, 0.0, Air(gusts_mps=GUSTS_MPS, seed=seed)))
        off.append(flown(plant, automaton, WAY))
        # It stands where it was to stop, and does not drift off.
        assert off[-1][-1] < 0.35
    assert np.quantile(np.concatenate(off), 0.99) < 0.35 + 0.03 * kind.copter.speed_mps


def test_undisturbed_the_mass_is_where_the_plan_says() -> None:
    automaton = copter(CopterLimits(10.0, 5.0))
    settings = cw.SimulationSettings()
    plant = KinematicPlant(
        automaton, State(START[:3], START[3:]), settings, np.random.default_rng(0), 1.0
    )
    assert flown(plant, automaton, WAY).max() < 1e-9
    assert plant.lag_s == 0.0


def test_an_acceleration_that_is_asked_for_late_is_answered_late() -> None:
    """What leads: without the next movement, a plant finds out about it when it begins."""
    kind = PLANTS.find("quadrotor")
    assert kind.copter is not None
    automaton = copter(kind.copter)
    late = leading(kind.make(START, 0.0, Air()))
    follow = late.follow
    late.follow = lambda asked: follow(  # type: ignore[method-assign]
        lambda later_s: asked(min(later_s, automaton.movements[0].duration_s - 1e-9))
    )
    early = leading(kind.make(START, 0.0, Air()))
    assert flown(early, automaton, WAY).max() < flown(late, automaton, WAY).max()


class Frozen:
    """A plant that knows constant inputs alone."""

    def __init__(self, state, _speed_mps, _air):
        self.state, self.outputs = np.array(state, dtype=float), {}

    def begin(self, _movement):
        pass

    def step(self, _duration_s):
        pass


def test_a_plant_that_follows_nothing_is_refused_with_what_to_do() -> None:
    kind = own_plant("plant frozen", Frozen)
    with pytest.raises(ClearwayError, match=r"follow\(asked\)"):
        measure_copter(kind, copter(CopterLimits(1.0)), MeasureSettings(1, 1))


# --- measuring by classes -----------------------------------------------------------------


@pytest.mark.parametrize("limits", [CopterLimits(1.0), CopterLimits(10.0, 5.0)])
def test_a_round_flies_every_movement_in_every_class(limits: CopterLimits) -> None:
    classes = copter(limits).classes
    assert classes is not None
    flown_in = round_of_classes(classes.following, np.random.default_rng(2))
    every = {(int(at), int(m)) for at, m in np.argwhere(classes.following >= 0)}
    assert set(flown_in) == every
    assert len(flown_in) < 1.5 * len(every)
    for edge, then in zip(flown_in, [*flown_in[1:], flown_in[0]], strict=True):
        assert classes.following[edge] == then[0]


def test_each_of_a_class_each_once_where_all_lead_to_all() -> None:
    following = np.tile(np.arange(4), (4, 1))
    flown_in = round_of_classes(following, np.random.default_rng(0))
    assert len(flown_in) == len(set(flown_in)) == 16


def test_the_measured_tube_holds_what_was_held_out_and_not_much_more() -> None:
    limits = CopterLimits(2.0, 3.0)
    settings = MeasureSettings(2, 2, gusts_mps=GUSTS_MPS)
    measured = measure_copter(PLANTS.find("quadrotor"), copter(limits), settings)
    assert measured.inside.min() > 0.9
    assert measured.inside.mean() > 0.97
    assert np.all(measured.tube_m < 0.35 + 0.03 * measured.speeds_mps)
    classes = measured.automaton.classes
    assert classes is not None
    at = np.searchsorted(measured.speeds_mps, classes.speed_mps)
    np.testing.assert_array_equal(classes.class_tube_m, measured.tube_m[at])


# --- in the closed loop -------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(2))
def test_a_quadrotor_with_inertia_flies_between_columns_in_gusts(seed: int) -> None:
    columns = [
        cw.Obstacle.line_between([x, y, 0.0], [x, y, 8.0], radius_m=0.6)
        for x, y in ((12.0, 1.0), (18.0, -4.0), (24.0, 3.0), (30.0, -1.0))
    ]
    world = cw.ObstacleMap(columns)
    automaton = copter(CopterLimits(6.0, 4.0))
    library = cw.ReachLibrary.load_or_build(automaton, cw.AvoidanceGrid.uniform(range_m=25.0))
    settings = cw.AvoidanceSettings(safety_margin_m=0.4, body_radius_m=0.2)
    rng = np.random.default_rng(seed)
    place = np.array([0.0, 0.0, 3.0]) + rng.uniform(-1.0, 1.0, 3)
    start = State(place, [0.0, 0.0, rng.uniform(-1.0, 1.0)])
    flight = cw.Mission("columns", start, waypoints_m=np.array([[40.0, 0.0, 3.0]]))
    system = cw.AvoidanceSystem(cw.Planner.of(library, settings), flight, obstacle_map=world)
    run = cw.simulate(
        system,
        world,
        lidars=[],
        plant=PLANTS.find("quadrotor"),
        settings=cw.SimulationSettings(seed=seed, gusts_mps=GUSTS_MPS),
    )
    assert run.reached
    assert run.metrics.min_obstacle_distance_m > 0.2
    # It is where the plan has it, so that decisions need not begin anew.
    assert run.counts.get("state: outside the tube of its plan", 0) < 0.05 * len(run.time_s)


def test_a_vehicle_with_inertia_is_sensed_within_its_movements() -> None:
    """A movement lasts up to a second; a sensor scans ten times in it."""
    automaton = copter(CopterLimits(10.0, 1.0))
    lasts_s = automaton.movements[0].duration_s
    assert lasts_s > 0.5
    library = cw.ReachLibrary.load_or_build(automaton, cw.AvoidanceGrid.uniform(range_m=25.0))
    flight = cw.Mission("on", State(np.zeros(3)), waypoints_m=np.array([[30.0, 0.0, 0.0]]))
    lidar = cw.Lidar("top", cw.BeamPattern.rotating(np.arange(-8.0, 9.0, 4.0), 8.0))
    system = cw.AvoidanceSystem(
        cw.Planner.of(library, cw.AvoidanceSettings(escape="off")), flight, lidars=[lidar]
    )
    taken: list[float] = []
    update = system.update

    def take(reading):
        if hasattr(reading, "sensor"):
            taken.append(reading.time_s)
        update(reading)

    system.update = take  # type: ignore[method-assign]
    cw.simulate(
        system,
        cw.ObstacleMap([]),
        lidars=[lidar],
        settings=cw.SimulationSettings(time_limit_s=4.0),
    )
    assert np.diff(taken).max() <= 0.1 + 1e-9


def test_rotorpy_follows_a_plan_as_a_plant_of_ones_own() -> None:
    pytest.importorskip("rotorpy", reason="rotorpy is not installed (it needs --no-deps)")
    sys.path.insert(0, str(REPOSITORY / "examples"))
    try:
        from rotorpy_plant import RotorPy
    finally:
        sys.path.pop(0)
    kind = own_plant("plant rotorpy", RotorPy)
    assert kind.copter is not None
    automaton = copter(kind.copter)
    plant = leading(kind.make(START, 0.0, Air(gusts_mps=GUSTS_MPS)))
    off = flown(plant, automaton, WAY)
    assert np.quantile(off, 0.99) < 0.35 + 0.03 * kind.copter.speed_mps
