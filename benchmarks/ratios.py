"""Has anything become slower? `python -m benchmarks.ratios`: times against references beside them.

What is measured and its reference run by turns in one process, so that a slow hour slows both; the
ratio is held against the one kept in `ratios.toml`. More than a fifth above it is a warning, never
a failure: machines differ. `--write` keeps the ratios of this run.
"""

from __future__ import annotations

import argparse
import time
import tomllib
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.decisions import seen_from, standing, static_mission
from benchmarks.intruders import paper_intruders
from benchmarks.references import bincount_detection, minimal_hits, node_ratings, plain_python
from benchmarks.scenes import AS_FLOWN, scattered
from benchmarks.sensors import GRID, LIDAR
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.situation import Situation
from clearway.avoidance.rate.reach_rating import rate_reach_set
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.sensors import PointMemory, Scan, detect, remember_reading, update_memory
from clearway.sim import simulate
from clearway.sim.kept_scans import KeepingScanner
from clearway.studies.encounters.flights import planner_at

KEPT = Path(__file__).with_name("ratios.toml")
SLOWER = 1.2
"""Ratio to the kept one above which it is told."""
ROUNDS, ROUND_S = 15, 0.04
PYTHON_STEPS = 1_000
FOREST, FLOWN_S = "copter-forest", 6.0
"""Mission of the copter that decides, and how long it has flown."""
Run = Callable[[], object]


def pairs() -> dict[str, tuple[Run, Run]]:
    """What is measured, and what it is held against, by name."""
    scan = Scan(scattered(100_000))
    beams = detect(GRID, LIDAR, scan).beams
    planner, here = planner_at(1.0), State(np.zeros(3))
    tree = planner.prepare_at(here).reach_set
    rating = np.random.default_rng(0).uniform(0.0, 1.0, GRID.cells)
    empty = PointMemory.empty(0.15)
    situation = Situation(here, np.array([100.0, 0.0, 0.0]), intruders=paper_intruders())
    return {
        "100,000 returns into cells, to a minimal loop": (
            lambda: detect(GRID, LIDAR, scan).visibility,
            lambda: minimal_hits(GRID, scan.points_m),
        ),
        "100,000 returns into cells, to NumPy": (
            lambda: detect(GRID, LIDAR, scan).visibility,
            lambda: bincount_detection(GRID, beams, scan.points_m),
        ),
        "100,000 returns remembered, to a minimal loop": (
            lambda: update_memory(empty, LIDAR, scan, here),
            lambda: minimal_hits(GRID, scan.points_m),
        ),
        "a reach set rated, to NumPy": (
            lambda: rate_reach_set(tree, rating),
            lambda: node_ratings(tree, rating),
        ),
        "a decision, to plain Python": (_decision("off"), lambda: plain_python(PYTHON_STEPS)),
        "a decision with an escape, to plain Python": (
            _decision("strict"),
            lambda: plain_python(PYTHON_STEPS),
        ),
        "a decision among 32 intruders, to plain Python": (
            lambda: decide(planner, situation),
            lambda: plain_python(PYTHON_STEPS),
        ),
        "a decision of a copter with sight, field and known points, to plain Python": (
            _copter_decision(),
            lambda: plain_python(PYTHON_STEPS),
        ),
        "a scan of a copter remembered, to a minimal loop": (
            _copter_memory(),
            lambda: minimal_hits(GRID, scan.points_m),
        ),
    }


@cache
def _copter_in_flight() -> tuple[AvoidanceSystem, Scan]:
    """A copter that has flown into the forest for a while, and its latest scan."""
    setup, scans = prepare(read_mission_file(FOREST)), list[Scan]()
    system = setup.system()
    simulate(
        system,
        setup.world,
        lidars=[KeepingScanner(sensor, scans) for sensor in setup.sensors],
        settings=replace(setup.simulation, time_limit_s=FLOWN_S),
        plant=setup.plant,
    )
    return system, scans[-1]


def _copter_decision() -> Run:
    """All that is known gathered, the time to go marched anew, and chosen."""
    system, scan = _copter_in_flight()
    return lambda: decide(system.planner, system.situation(scan.time_s)[0])


def _copter_memory() -> Run:
    """Its latest scan, once more."""
    system, scan = _copter_in_flight()
    known = system._known
    (memory,), (sensor,) = known.sensing._memories.values(), known.sensing.sensors.values()
    state = known.own_states.at(scan.time_s)
    return lambda: remember_reading(memory, sensor, scan, state)


def _decision(escape: str) -> Run:
    """Of who stands where the static mission leads past something."""
    setup = static_mission(escape=escape)
    (lidar,) = setup.lidars
    x, y, z, pitch_deg, yaw_deg = AS_FLOWN[1]
    place = State(np.array([x, y, z]), np.radians([0.0, pitch_deg, yaw_deg]))
    return standing(setup, lidar, seen_from(lidar, setup.world, place), place)


def ratio_of(measured: Run, reference: Run) -> float:
    """Of processor time, the median of rounds taken by turns."""
    ratios = [_each_s(measured) / _each_s(reference) for _ in range(ROUNDS + 1)]
    return float(np.median(ratios[1:]))


def _each_s(run: Run) -> float:
    calls, began = 0, time.thread_time()
    while time.thread_time() - began < ROUND_S:
        run()
        calls += 1
    return (time.thread_time() - began) / calls


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.ratios", description=__doc__)
    parser.add_argument("--write", action="store_true", help="keep the ratios of this run")
    write = parser.parse_args().write
    kept: dict[str, float] = tomllib.loads(KEPT.read_text()) if KEPT.exists() else {}
    found = {name: ratio_of(*pair) for name, pair in pairs().items()}
    print("| what | ratio | kept |\n| --- | --- | --- |")
    for name, ratio in found.items():
        print(f"| {name} | {ratio:.3g} | {kept.get(name, np.nan):.3g} |")
    for name, ratio in found.items():
        if ratio > SLOWER * kept.get(name, np.inf):
            print(f"warning: {name}: {ratio / kept[name]:.2f} of what it was")
    if write:
        lines = (f'"{name}" = {ratio:.3g}\n' for name, ratio in found.items())
        KEPT.write_text("".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
