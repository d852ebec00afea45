"""What `benchmarks.turns` does in a process of either version; nothing of this version is loaded.

What runs in both is written with the names of version 0.1.0, which later ones know too.
"""

from __future__ import annotations

import json
import math
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from itertools import count
from typing import Any

import numpy as np

Numbers = tuple[float, float, float]
Walls = list[tuple[Numbers, Numbers, float]]
"""Middles and sizes of boxes, and how far each is rolled."""
REPEATS = 12
"""Of what is done over and over in a round."""


def serve(escape: str) -> None:
    """Do rows as they are asked for; [median, 99 %] in ms of each."""
    import clearway

    warnings.simplefilter("ignore")
    made: dict[str, Callable[[], list[float]]] = {}
    for line in sys.stdin:
        name = line.strip()
        if name == "version":
            print(json.dumps(clearway.__version__), flush=True)
            continue
        if name not in made:
            made[name] = ROWS[name](escape)
        each_ms = 1e3 * np.array(made[name]())
        print(
            json.dumps([float(np.median(each_ms)), float(np.percentile(each_ms, 99))]), flush=True
        )


def _named(path: str) -> Any:
    """What has a name that some versions know only as one that has moved."""
    module, _, name = path.rpartition(".")
    return getattr(import_module(module), name)


def _setup(escape: str, beams_per_cell: tuple[int, int] | None = None) -> Any:
    try:
        read = _named("clearway.missions.mission_file.read_mission_file")
    except ImportError:
        read = _named("clearway.io.mission_file.read_mission")
    prepare, file = _named("clearway.flight.prepare"), read("static-obstacles")
    if escape:
        file = file.changed("safety", escape=escape)
    file = with_beams(file, beams_per_cell)
    return prepare(file)


def with_beams(file: Any, beams_per_cell: tuple[int, int] | None) -> Any:
    """A mission file with other beams of its scanner, unless there are none."""
    if beams_per_cell is None:
        return file
    (lidar,) = file.lidar
    other = lidar.model_copy(update={"beams_per_cell": beams_per_cell})
    return file.model_copy(update={"lidar": (other,)})


def _flown(escape: str) -> Callable[[], list[float]]:
    """Whole flights of the static mission: each from take-off to the goal."""
    setup = _setup(escape)

    def flights() -> list[float]:
        began = time.thread_time()
        setup.fly()
        return [time.thread_time() - began]

    return flights


def _decided(escape: str) -> Callable[[], list[float]]:
    """Decisions of a flight of the static mission, with all readings since the one before."""
    AvoidanceSystem = _named("clearway.system.AvoidanceSystem")

    setup, spent = _setup(escape), [0.0]
    each: list[float] = []
    asked, decided = AvoidanceSystem.due, AvoidanceSystem.decide

    def due(self: Any, now_s: float) -> Any:
        began = time.thread_time()
        why = asked(self, now_s)
        spent[0] += time.thread_time() - began
        return why

    def decide(self: Any, now_s: float) -> Any:
        began = time.thread_time()
        found = decided(self, now_s)
        each.append(spent[0] + time.thread_time() - began)
        spent[0] = 0.0
        return found

    def flight() -> list[float]:
        each.clear()
        AvoidanceSystem.due, AvoidanceSystem.decide = due, decide
        try:
            setup.fly()
        finally:
            AvoidanceSystem.due, AvoidanceSystem.decide = asked, decided
        return each

    return flight


def _repeated(escape: str) -> Callable[[], list[float]]:
    """Decisions at places along the way of the static mission, each again and again with the same
    readings: an own state and a sweep."""
    setup = _setup(escape)
    (lidar,), start = setup.lidars, setup.mission.start
    moments = []
    for x, y, z, pitch_deg, yaw_deg in AS_FLOWN:
        turned = np.radians([0.0, pitch_deg, yaw_deg])
        state = replace(start, position_m=np.array([x, y, z]), attitude_rad=turned)
        scan = _seen_from(lidar, setup.world, state)
        moments.append(_standing(setup, lidar, scan, state, escape))
    return lambda: [each for run in moments for each in run()]


def _returns(
    walls: Walls, beams_per_cell: tuple[int, int] = (80, 36), *, crowded: bool = False
) -> Callable[[str], Any]:
    """Decisions of who stands between walls; crowded: with traffic, and shapes of a map."""

    def make(escape: str) -> Callable[[], list[float]]:
        setup = _setup(escape, beams_per_cell)
        (lidar,) = setup.lidars
        far = replace(lidar, dropout=0.0, pattern=replace(lidar.pattern, max_range_m=100.0))
        kind = _named("clearway.obstacles.Obstacle")
        shapes = [*mixed_shapes(20, kind), *_far_off(980, kind)] if crowded else []
        told = (_map_of(shapes), _passing_by(10)) if crowded else ()
        start = setup.mission.start
        return _standing(setup, far, _seen_from(far, _between(walls), start), start, escape, *told)

    return make


def _leaves(escape: str) -> Callable[[], list[float]]:
    """Decisions of who stands among returns in no order, all within 10 m."""
    setup, rng = _setup(escape, (80, 36)), np.random.default_rng(0)
    (lidar,) = setup.lidars
    low, high = [0.5, -0.8, -0.53], [10.0, 0.8, 0.53]
    away, azimuth, elevation = rng.uniform(low, high, (100_000, 3)).T
    level = away * np.cos(elevation)
    points = [level * np.cos(azimuth), level * np.sin(azimuth), away * np.sin(elevation)]
    scan = _named("clearway.sensors.Scan")(np.stack(points, axis=1), sensor=lidar.name)
    return _standing(setup, lidar, scan, setup.mission.start, escape)


def _between(walls: Walls) -> Any:
    Obstacle = _named("clearway.obstacles.Obstacle")
    return _map_of(
        [
            Obstacle.cuboid(np.array(place), size, orientation_rad=np.array([roll_rad, 0.0, 0.0]))
            for place, size, roll_rad in walls
        ]
    )


def _map_of(shapes: list[Any]) -> Any:
    return _named("clearway.obstacle_map.ObstacleMap")(shapes)


def _binned(walls: Walls) -> Callable[[str], Any]:
    """The returns of one sweep into what they say of the cells."""

    def make(_escape: str) -> Callable[[], list[float]]:
        AvoidanceGrid = _named("clearway.grid.AvoidanceGrid")
        State = _named("clearway.state.State")
        sensors = import_module("clearway.sensors")

        grid = AvoidanceGrid.uniform()
        pattern = sensors.BeamPattern.per_cell(grid, 80, 36, max_range_m=100.0)
        lidar, here = sensors.Lidar("far", pattern), State(np.zeros(3))
        scan = _seen_from(lidar, _between(walls), here)
        return lambda: _timed(lambda: sensors.detect(grid, lidar, scan).visibility)

    return make


def _seen_from(lidar: Any, world: Any, state: Any) -> Any:
    simulate_scan = _named("clearway.sensors.simulate_scan")
    return simulate_scan(lidar, world, state, np.random.default_rng(0))


def _standing(
    setup: Any,
    lidar: Any,
    scan: Any,
    state: Any,
    escape: str,
    obstacle_map: Any = None,
    intruders: Sequence[Any] = (),
) -> Callable[[], list[float]]:
    """Decisions of who stands somewhere, each a second after the one before."""
    AvoidanceSystem = _named("clearway.system.AvoidanceSystem")
    DataLimits = _named("clearway.system.DataLimits")

    system = AvoidanceSystem(
        setup.planner,
        setup.mission,
        (lidar,),
        obstacle_map=obstacle_map,
        limits=DataLimits(patience_turns=1e9),
    )
    if escape:
        system.followed = False
    clock = count()

    def run() -> list[float]:
        each = []
        for _ in range(REPEATS):
            now, began = float(next(clock)), time.thread_time()
            system.update(replace(state, time_s=now))
            system.update(replace(scan, time_s=now))
            for intruder in intruders:
                system.update(replace(intruder, time_s=now))
            system.decide(now)
            each.append(time.thread_time() - began)
        return each

    return run


def mixed_shapes(number: int, Obstacle: Any) -> list[Any]:
    """Balls, rods and boxes in any pose beside the way, all in view; Obstacle: of a version."""
    rng = np.random.default_rng(0)
    shapes: list[Any] = []
    while len(shapes) < number:
        place = rng.uniform([2.0, -7.0, -4.0], [11.0, 7.0, 4.0])
        if abs(place[1]) > 1.5:
            turn, size = rng.uniform(-np.pi, np.pi, 3), rng.uniform(0.1, 0.5, 3)
            kinds = (
                Obstacle.ball(place, 0.2),
                Obstacle.line(place, size[0], 0.1, orientation_rad=turn),
                Obstacle.cuboid(place, (size[0], size[1], size[2]), orientation_rad=turn),
            )
            shapes.append(kinds[len(shapes) % 3])
    return shapes


def _far_off(number: int, Obstacle: Any) -> list[Any]:
    away = np.random.default_rng(2).uniform([30, -400, -20], [400, 400, 20], (number, 3))
    return [Obstacle.ball(place, 0.5) for place in away]


def _shapes(escape: str) -> Callable[[], list[float]]:
    AvoidanceSystem = _named("clearway.system.AvoidanceSystem")

    setup, told = _setup(escape), _map_of(mixed_shapes(1000, _named("clearway.obstacles.Obstacle")))
    system = AvoidanceSystem(setup.planner, setup.mission, obstacle_map=told)
    system.update(setup.mission.start)
    return lambda: _timed(lambda: system.decide(0.0))


def _passing_by(number: int) -> list[Any]:
    """On straight paths through the grid, each in it after six seconds."""
    Intruder = _named("clearway.intruders.Intruder")

    rng, found = np.random.default_rng(1), []
    for each in range(number):
        through, velocity = rng.uniform([1, -3, -2], [9, 3, 2]), rng.normal(size=3)
        place, spread = through - 6.0 * velocity, rng.uniform(0.05, 0.4, 2)
        found.append(replace(Intruder(place, velocity, spread, 1.0), name=f"i{each}"))
    return found


def _intruders(where: str) -> Callable[[str], Any]:
    def make(escape: str) -> Callable[[], list[float]]:
        Intruder = _named("clearway.intruders.Intruder")
        Mission = _named("clearway.mission.Mission")
        State = _named("clearway.state.State")
        AvoidanceSystem = _named("clearway.system.AvoidanceSystem")

        rng, start = np.random.default_rng(1), State(np.zeros(3))
        mission = Mission("benchmark", start, np.array([[100.0, 0.0, 0.0]]))
        system = AvoidanceSystem(_setup(escape).planner, mission)
        system.update(start)
        for number in range(32):
            velocity, spread = rng.normal(size=3), rng.uniform(0.05, 0.4, 2)
            place = rng.uniform([1, -3, -2], [9, 3, 2]) - 6.0 * velocity
            if where == "across":
                place, velocity = np.array([6.0, 8.0, 0.0]), np.array([0.0, -1.0, 0.0])
                spread = np.array([np.pi / 12, np.pi / 16])
            if where == "leaving":
                place, velocity = np.array([500.0, 10.0 * number, 0.0]), np.array([20.0, 0.0, 0.0])
            system.update(replace(Intruder(place, velocity, spread, 1.0), name=f"i{number}"))
        system.update(replace(start, time_s=0.5))
        return lambda: _timed(lambda: system.decide(0.5))

    return make


def _timed(run: Callable[[], Any]) -> list[float]:
    each = []
    for _ in range(REPEATS):
        began = time.thread_time()
        run()
        each.append(time.thread_time() - began)
    return each


AS_FLOWN = (
    (0.0, 0.0, 0.0, 0.0, 0.0), (5.5, 2.3, 0.3, 0.0, 30.0), (11.3, 2.9, 0.5, 0.0, -15.0),
    (16.8, 0.6, 0.5, 0.0, -15.0), (21.5, 3.3, 0.7, -15.0, 75.0), (22.7, 9.1, 1.2, -15.0, 75.0),
    (21.6, 14.7, 0.3, 0.0, 120.0), (18.7, 19.8, 0.0, 0.0, 150.0), (13.4, 22.4, 0.0, 0.0, 165.0),
    (7.5, 22.4, -0.2, 0.0, 195.0), (1.9, 20.7, -0.4, -15.0, 195.0), (-0.7, 16.5, 2.0, -30.0, 270.0),
)  # fmt: skip
"""Places [m], pitch and heading [deg] at every sixth decision of the static mission."""
STREET: Walls = [
    ((0.0, 14.0, 0.0), (200.0, 4.0, 80.0), 0.0),
    ((0.0, -14.0, 0.0), (200.0, 4.0, 80.0), 0.0),
    ((0.0, 0.0, -44.05), (200.0, 200.0, 80.0), 0.0),
    ((40.0, 0.0, 0.0), (4.0, 40.0, 80.0), 0.0),
    ((7.0, 0.5, 0.0), (2.0, 2.0, 2.0), 0.0),
]
CHAMBER: Walls = [
    ((8.0, 0.0, 0.0), (0.5, 12.0, 12.0), 0.0),
    ((2.0, 5.5, 0.0), (12.0, 0.5, 12.0), 0.0),
    ((2.0, -5.5, 0.0), (12.0, 0.5, 12.0), 0.0),
    ((2.0, 0.0, 4.0), (12.0, 12.0, 0.5), 0.0),
    ((2.0, 0.0, -4.0), (12.0, 12.0, 0.5), 0.0),
]
TUBE: Walls = [
    (
        (25.0, 2.5 * math.cos(roll_rad), 2.5 * math.sin(roll_rad)),
        (70.0, 0.1, 5.25 * math.tan(math.pi / 24)),
        roll_rad,
    )
    for roll_rad in (2.0 * math.pi * plank / 24 for plank in range(24))
] + [((60.0, 0.0, 0.0), (0.2, 6.0, 6.0), 0.0)]
"""Round and straight, of flat planks, closed at its far end."""
ROWS: dict[str, Callable[[str], Callable[[], list[float]]]] = {
    "a decision of the static mission": _decided,
    "a decision of the static mission, repeated": _repeated,
    "the static mission flown": _flown,
    "100,800 beams in a street": _returns(STREET),
    "100,800 returns within 10 m": _returns(CHAMBER),
    "100,000 returns of leaves within 10 m": _leaves,
    "100,800 returns of a street into cells": _binned(STREET),
    "100,800 returns within 10 m into cells": _binned(CHAMBER),
    "50,400 returns of a tube": _returns(TUBE, (40, 36)),
    "everything at once": _returns(STREET, crowded=True),
    "1,000 mixed shapes in view": _shapes,
    "32 intruders across": _intruders("across"),
    "32 intruders at random": _intruders("at random"),
    "32 intruders leaving": _intruders("leaving"),
}

if __name__ == "__main__":
    serve(sys.argv[1])
