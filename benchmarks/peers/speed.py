"""`python -m benchmarks.peers.speed --python PATH`: how fast clearway and others do the same.

By turns, a round of one and then a round of the other, each of processor time. They do not do quite
the same: BlueSky resolves for all aircraft at once and looks at nothing but aircraft, while the
decision is for one of them and looks at everything; OctoMap keeps probabilities in a tree without
bounds, clearway whether a voxel was seen, and the nearest return, within reach.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.decisions import MANY_BEAMS, static_mission
from benchmarks.intruders import random_intruders
from benchmarks.scenes import street
from benchmarks.table import machine
from benchmarks.timing import in_words
from clearway.avoidance.decide import decide
from clearway.avoidance.plan.situation import Situation
from clearway.base.state import State
from clearway.live.inputs.range_sensing import free_space_for
from clearway.sensors import LidarSensor, simulate_scan

HERE = Path(__file__).resolve().parent
ROUNDS, CALLS = 5, 20
MARKED_M = 12.0
"""Range of what is marked: that of the static mission's decisions."""
Times = list[float]
Round = Callable[[Path], Times]
START = State(np.zeros(3))


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers.speed", description=__doc__)
    parser.add_argument("--python", type=Path, required=True, help="that has the peers")
    python, load = parser.parse_args().python, os.getloadavg()[0]
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        for what, name, ours, theirs in (*_marking(python), *_deciding(python)):
            rounds = [(ours(Path(folder)), theirs(Path(folder))) for _ in range(ROUNDS)]
            mine, other = (np.median(np.array(each), axis=1) for each in zip(*rounds, strict=True))
            ratio = other / mine
            lines.append(
                f"| {what} | {in_words(float(np.median(mine)))} | {name} "
                f"| {in_words(float(np.median(other)))} | {np.median(ratio):.2g} "
                f"({ratio.min():.2g} to {ratio.max():.2g}) |"
            )
    print("| what | clearway | peer | its time | in clearway's times |")
    print("| --- | --- | --- | --- | --- |", *lines, sep="\n")
    print(f"\nProcessor time, medians of {ROUNDS} rounds of {CALLS}. Measured on {machine(load)}.")


def _marking(python: Path) -> list[tuple[str, str, Round, Round]]:
    """Free space of a sweep in a street, as far as decisions look."""
    setup = static_mission(beams_per_cell=MANY_BEAMS)
    (lidar,) = setup.lidars
    near = replace(lidar, dropout=0.0, pattern=replace(lidar.pattern, max_range_m=MARKED_M))
    scan = simulate_scan(near, street(), START, np.random.default_rng(0))
    space, sensor = free_space_for(setup.planner, START.position_m), LidarSensor(near)
    voxel_m = space.seen.voxel_m

    def ours(_folder: Path) -> Times:
        return _times(lambda: space.take(sensor, scan, START, 0.0))

    def theirs(folder: Path) -> Times:
        np.save(folder / "returns.npy", scan.points_m)
        return list(_run(python, "time_octomap.py", folder / "returns.npy", voxel_m, CALLS))

    count = len(scan.points_m)
    what = f"what {count:,} returns of a street show to be free, voxels of {voxel_m:.2f} m"
    return [(what, "OctoMap (pyoctomap), discretized", ours, theirs)]


def _deciding(python: Path) -> list[tuple[str, str, Round, Round]]:
    """A decision among 32 intruders."""
    intruders = random_intruders()
    planner = static_mission(escape="off").planner
    situation = Situation(START, np.array([100.0, 0.0, 0.0]), intruders=intruders)
    courses: Sequence[Any] = [
        {"position": [0.0, 0.0, 0.0], "velocity": [planner.speed_mps, 0.0, 0.0]},
        *(
            {"position": each.position_m.tolist(), "velocity": each.velocity_mps.tolist()}
            for each in intruders
        ),
    ]

    def ours(_folder: Path) -> Times:
        return _times(lambda: decide(planner, situation))

    def theirs(folder: Path) -> Times:
        (folder / "courses.json").write_text(json.dumps(courses), encoding="utf-8")
        told = _run(python, "time_bluesky.py", folder / "courses.json", CALLS, folder)
        return list(told["taken_s"])

    what = f"among {len(intruders)} intruders on random paths"
    return [(what, "BlueSky, finding and resolving (MVP) for all 33", ours, theirs)]


def _times(run: Callable[[], object]) -> Times:
    taken = []
    for _ in range(CALLS + 1):
        began = time.process_time()
        run()
        taken.append(time.process_time() - began)
    return taken[1:]


def _run(python: Path, script: str, *arguments: object) -> Any:
    """What a script of the peers prints last."""
    command = [str(python), str(HERE / script), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{script} failed:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


if __name__ == "__main__":
    main()
