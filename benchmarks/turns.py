"""This version against another by turns: `python -m benchmarks.turns OTHER/src`.

A process of each does the same rows one after the other, a round of one and then a round of the
other, so that what slows the machine slows both. Times are CPU of one thread; ratios are medians
over the rounds, with their least and greatest.

What runs in both is written with the names of version 0.1.0, which later ones know too.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

Walls = list[tuple[tuple[float, float, float], tuple[float, float, float]]]
"""Middles and sizes of boxes."""
REPEATS = 12
"""Of what is done over and over in a round."""
HERE = Path(__file__).resolve().parent.parent


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.turns", description=__doc__)
    parser.add_argument("other", type=Path, help="folder that holds the other version's package")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--only", default="", help="rows whose name contains it")
    options = parser.parse_args()
    load = os.getloadavg()[0]
    sides = {
        "other": _worker(options.other, ""),
        "off": _worker(HERE / "src", "off"),
        "strict": _worker(HERE / "src", "strict"),
    }
    print(f"against {_ask(sides['other'], 'version')}, load {load:.1f} before; ms of CPU")
    print("| what | other | `off` | to other | `strict` | to other |\n|---|---|---|---|---|---|")
    for name in ROWS:
        if options.only in name:
            print(_row(name, sides, options.rounds), flush=True)
    for side in sides.values():
        side.communicate("")


def _row(name: str, sides: dict[str, Any], rounds: int) -> str:
    taken: dict[str, list[list[float]]] = {side: [] for side in sides}
    for _ in range(rounds + 1):  # The first one warms up.
        for side, worker in sides.items():
            taken[side].append(_ask(worker, name))
    table = {side: np.array(found[1:]) for side, found in taken.items()}
    cells = [name, _told(table["other"])]
    for side in ("off", "strict"):
        ratio = table[side][:, 0] / table["other"][:, 0]
        spread = f"{np.median(ratio):.2f} ({ratio.min():.2f} to {ratio.max():.2f})"
        cells += [_told(table[side]), spread]
    return "| " + " | ".join(cells) + " |"


def _told(rounds: Any) -> str:
    median, p99 = np.median(rounds, axis=0)
    return f"{median:.2f}, p99 {p99:.2f}"


def _worker(source: Path, escape: str) -> Any:
    words = [sys.executable, "-W", "ignore", str(Path(__file__).resolve()), "--serve", escape]
    environment = os.environ | {"PYTHONPATH": str(source.resolve())}
    return subprocess.Popen(
        words, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip


def _ask(worker: Any, name: str) -> Any:
    worker.stdin.write(name + "\n")
    worker.stdin.flush()
    return json.loads(worker.stdout.readline())


# --- in a process of either version ---------------------------------------------------------


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
    if beams_per_cell is not None:
        (lidar,) = file.lidar
        other = lidar.model_copy(update={"beams_per_cell": beams_per_cell})
        file = file.model_copy(update={"lidar": (other,)})
    return prepare(file)


def _flown(escape: str) -> Callable[[], list[float]]:
    """Whole flights of the static mission: each from take-off to the goal, without warming up."""
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
        return each[2:]  # The first two are of a system that warms up.

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
        moments.append(_standing(setup, lidar, setup.world, state, escape))
    return lambda: [each for run in moments for each in run()]


def _returns(walls: Walls) -> Callable[[str], Any]:
    def make(escape: str) -> Callable[[], list[float]]:
        ObstacleMap = _named("clearway.obstacle_map.ObstacleMap")
        Obstacle = _named("clearway.obstacles.Obstacle")

        setup = _setup(escape, (80, 36))
        (lidar,) = setup.lidars
        far = replace(lidar, dropout=0.0, pattern=replace(lidar.pattern, max_range_m=100.0))
        world = ObstacleMap([Obstacle.cuboid(list(place), size) for place, size in walls])
        return _standing(setup, far, world, setup.mission.start, escape)

    return make


def _standing(
    setup: Any, lidar: Any, world: Any, state: Any, escape: str
) -> Callable[[], list[float]]:
    """Decisions of who stands somewhere, each a second after the one before."""
    simulate_scan = _named("clearway.sensors.simulate_scan")
    AvoidanceSystem = _named("clearway.system.AvoidanceSystem")
    DataLimits = _named("clearway.system.DataLimits")

    scan = simulate_scan(lidar, world, state, np.random.default_rng(0))
    patient = DataLimits(patience_turns=1e9)
    system = AvoidanceSystem(setup.planner, setup.mission, (lidar,), limits=patient)
    if escape:
        system.followed = False
    clock = count()

    def run() -> list[float]:
        each = []
        for _ in range(REPEATS):
            now, began = float(next(clock)), time.thread_time()
            system.update(replace(state, time_s=now))
            system.update(replace(scan, time_s=now))
            system.decide(now)
            each.append(time.thread_time() - began)
        return each

    return run


def _shapes(escape: str) -> Callable[[], list[float]]:
    ObstacleMap = _named("clearway.obstacle_map.ObstacleMap")
    Obstacle = _named("clearway.obstacles.Obstacle")
    AvoidanceSystem = _named("clearway.system.AvoidanceSystem")

    setup, rng = _setup(escape), np.random.default_rng(0)
    shapes: list[Any] = []
    while len(shapes) < 1000:
        place = rng.uniform([2.0, -7.0, -4.0], [11.0, 7.0, 4.0])
        if abs(place[1]) > 1.5:
            turn, size = rng.uniform(-np.pi, np.pi, 3), rng.uniform(0.1, 0.5, 3)
            kinds = (
                Obstacle.ball(place, 0.2),
                Obstacle.line(place, size[0], 0.1, orientation_rad=turn),
                Obstacle.cuboid(place, (size[0], size[1], size[2]), orientation_rad=turn),
            )
            shapes.append(kinds[len(shapes) % 3])
    system = AvoidanceSystem(setup.planner, setup.mission, obstacle_map=ObstacleMap(shapes))
    system.update(setup.mission.start)
    return lambda: _timed(lambda: system.decide(0.0))


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
STREET = [
    ((0.0, 14.0, 0.0), (200.0, 4.0, 80.0)),
    ((0.0, -14.0, 0.0), (200.0, 4.0, 80.0)),
    ((0.0, 0.0, -44.05), (200.0, 200.0, 80.0)),
    ((40.0, 0.0, 0.0), (4.0, 40.0, 80.0)),
    ((7.0, 0.5, 0.0), (2.0, 2.0, 2.0)),
]
CHAMBER = [
    ((8.0, 0.0, 0.0), (0.5, 12.0, 12.0)),
    ((2.0, 5.5, 0.0), (12.0, 0.5, 12.0)),
    ((2.0, -5.5, 0.0), (12.0, 0.5, 12.0)),
    ((2.0, 0.0, 4.0), (12.0, 12.0, 0.5)),
    ((2.0, 0.0, -4.0), (12.0, 12.0, 0.5)),
]
ROWS: dict[str, Callable[[str], Callable[[], list[float]]]] = {
    "a decision of the static mission": _decided,
    "a decision of the static mission, repeated": _repeated,
    "the static mission flown": _flown,
    "100,800 beams in a street": _returns(STREET),
    "100,800 returns within 10 m": _returns(CHAMBER),
    "1,000 mixed shapes in view": _shapes,
    "32 intruders across": _intruders("across"),
    "32 intruders at random": _intruders("at random"),
    "32 intruders leaving": _intruders("leaving"),
}

if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(sys.argv[2])
    else:
        main()
