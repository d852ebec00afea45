"""The adversary: fair to the vehicle, repeatable, and part of the truth about a flight."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import clearway as cw
from clearway.avoidance.plan.planner import Planner
from clearway.base.grid import AvoidanceGrid
from clearway.live import AvoidanceSystem
from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.obstacles.world import CombinedWorld
from clearway.reach import ReachLibrary
from clearway.sensors import BeamPattern, Lidar, Scan
from clearway.sim import Run, SimulationSettings, simulate
from clearway.sim.adversary import crosses
from clearway.vehicle.automaton import MovementAutomaton

Array = npt.NDArray[np.float64]
THIN_M = 0.4


def passed_by(center: Array, radius: float, origin: Array, ways: Array, lengths: Array) -> bool:
    """The test's own: whether any of many places along the beams lies in the ball."""
    shares = np.linspace(0.0, 1.0, 4001)
    for way, length in zip(ways, lengths, strict=True):
        along = origin + (shares * length)[:, None] * way
        if np.linalg.norm(along - center, axis=1).min() < radius:
            return True
    return False


@pytest.mark.parametrize("seed", range(40))
def test_a_beam_crosses_a_ball_or_not(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ways = rng.normal(size=(8, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    origin, center = rng.normal(size=3), rng.normal(size=3) * 4.0
    lengths, radius = rng.uniform(0.0, 8.0, 8), float(rng.uniform(0.2, 1.5))
    wanted = passed_by(center, radius, origin, ways, lengths)
    assert crosses(center, radius, origin, ways, lengths) == wanted


class Watching(AvoidanceSystem):
    """Keeps what sensors told, and from where."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self.seen: list[tuple[Any, Scan]] = []
        self._state: Any = None

    def update(self, reading: Any) -> None:
        if isinstance(reading, cw.State):
            self._state = reading
        elif isinstance(reading, Scan):
            self.seen.append((self._state, reading))
        super().update(reading)


def opposed(seed: int, world: ObstacleMap, **settings: Any) -> tuple[Run, Watching, Lidar]:
    grid = AvoidanceGrid.uniform(10.0)
    library = ReachLibrary.load_or_build(MovementAutomaton.inertialess(2.0), grid)
    mission = cw.Mission("opposed", cw.State(np.zeros(3)), waypoints_m=np.array([[40.0, 0.0, 0.0]]))
    lidar = Lidar("lidar", BeamPattern.per_cell(grid, 6, elevations_per_cell=4, max_range_m=10.0))
    system = Watching(Planner.of(library), mission, lidars=(lidar,), obstacle_map=None)
    simulated = SimulationSettings(seed=seed, time_limit_s=20.0, adversary_m=THIN_M, **settings)
    return simulate(system, world, lidars=(lidar,), settings=simulated), system, lidar


def balls_of(run: Run) -> list[Any]:
    assert isinstance(run.world, CombinedWorld)
    there = run.world.worlds[-1]
    assert isinstance(there, ObstacleMap)
    return list(there.obstacles)


@pytest.mark.parametrize("stands", [True, False], ids=["among balls", "in empty space"])
def test_no_ball_stands_where_the_vehicle_or_a_beam_has_been(stands: bool) -> None:
    """Nor in the ball about the start that counts as seen, nor where the goal is."""
    some = [cw.Obstacle.ball([12.0, 3.0, 0.0], 1.0), cw.Obstacle.ball([20.0, -3.0, 1.0], 1.5)]
    run, system, lidar = opposed(3, ObstacleMap(some if stands else []))
    balls = balls_of(run)
    assert len(balls) > 3
    assert min(ball.radius_m for ball in balls) == 0.5 * THIN_M
    assert max(ball.radius_m for ball in balls) <= 2.5 * THIN_M
    before = [entry.flight.time_s for entry in run.decisions]
    centers = np.array([ball.position_m for ball in balls])
    radii = np.array([ball.radius_m for ball in balls])
    start, goal = np.zeros(3), np.array([40.0, 0.0, 0.0])
    assert np.all(np.linalg.norm(centers - start, axis=1) - radii > system.planner.automaton.step_m)
    assert np.all(np.linalg.norm(centers - goal, axis=1) - radii > 1.5)
    # All beams up to the second decision, which came before all balls but the first.
    early = [(state, scan) for state, scan in system.seen if scan.time_s <= before[0]]
    for state, _scan in early:
        turn = state.world_from_body
        ways = lidar.pattern.directions @ turn.T
        at_first = ObstacleMap(some if stands else [])
        ranges = np.minimum(at_first.cast(state.position_m, ways, 10.0), 10.0)
        for center, radius in zip(centers, radii, strict=True):
            assert not crosses(center, radius, state.position_m, ways, ranges)


def test_the_same_seed_opposes_in_the_same_way_and_another_one_does_not() -> None:
    worlds = [balls_of(opposed(seed, ObstacleMap([]))[0]) for seed in (1, 1, 2)]
    places = [np.array([ball.position_m for ball in one]).tolist() for one in worlds]
    assert places[0] == places[1] != places[2]


def test_a_flight_is_judged_by_the_balls_that_were_put() -> None:
    """Whoever avoids nothing runs into one, and that is seen though its sensors never told."""
    file = read_mission("dense-forest:1")
    file = file.with_values("simulation", adversary_m=THIN_M, time_limit_s=20.0)
    file = file.with_values("columns", rows_m=(), made=None)
    setup = prepare(file.with_values("rules", route_m=None))
    run = setup.fly_with("straight")
    balls = balls_of(run)
    track = run.states[:, :3]
    gaps = np.array(
        [np.linalg.norm(track - ball.position_m, axis=1).min() - ball.radius_m for ball in balls]
    )
    assert run.metrics.min_obstacle_distance_m <= gaps.min() + 1e-6
    assert run.crashed_s is not None
    assert "adversary" in str(run.summary()["crashed"])


def test_every_vehicle_of_a_mission_can_be_opposed() -> None:
    file = read_mission("dense-forest:2").with_values(
        "simulation", adversary_m=0.3, time_limit_s=6.0, scan_rate_hz=5.0
    )
    for kind in ("plane", "inertialess", "multirotor"):
        run = prepare(file.with_values("vehicle", kind=kind)).fly()
        assert len(balls_of(run)) > 0
