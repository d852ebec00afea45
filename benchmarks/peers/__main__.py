"""`python -m benchmarks.peers --python PATH`: clearway and its peers on the same encounters.

Level encounters, since ORCA knows two dimensions; a straight intruder that avoids nobody, on a
collision course; 1.2 to keep and a turning radius of 3.82, in units of what the ownship flies in a
second. Peers fly in their own environment, by scripts that only it runs; all tracks are judged
here, by the same measure. `make bench-peers` builds that environment first.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers.courses import courses, lasts_s
from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.intervals import wilson
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sim import SimulationSettings, simulate
from clearway.sim.baselines import CLEARWAY, Craft, pilot_named
from clearway.sim.scripted import ScriptedIntruder, Traffic
from clearway.studies.encounters.encounter import Encounter
from clearway.studies.encounters.flights import (
    RANGE_M,
    REACH_RADIUS_M,
    SAFETY_MARGIN_M,
    SPEED_MPS,
    distance_to_keep_m,
    is_avoidable,
    planner_at,
)
from clearway.vehicle.automaton import MovementAutomaton

HERE = Path(__file__).resolve().parent
SCRIPTS = ("fly_orca.py", "fly_bluesky.py")
OURS = (CLEARWAY, "clearway, level only", "velocity-obstacle", "mvp", "straight")
RADIUS_M = 0.6


@dataclass(frozen=True, slots=True)
class Line:
    """One planner on the encounters of one distance of detection."""

    planner: str
    kept: int
    flown: int
    nearest: float
    median: float
    aside: float
    """Farthest from straight flight, on average."""


def main() -> None:
    """Fly, judge and print."""
    options = _options()
    for detected_at_m in options.detected_at:
        given = [each for each in courses(options.count, detected_at_m) if is_avoidable(each)]
        tracks = {name: [_ours(name, each) for each in given] for name in OURS}
        for script in SCRIPTS:
            tracks |= _theirs(options.python, script, given, options.work)
        lines = [_judged(name, flown) for name, flown in tracks.items()]
        print(_table(detected_at_m, options.count, lines))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers", description=__doc__)
    parser.add_argument("--python", type=Path, required=True, help="of the peers' environment")
    parser.add_argument("--count", type=int, default=100, help="encounters of each kind")
    parser.add_argument("--work", type=Path, help="folder for what BlueSky keeps between runs")
    parser.add_argument(
        "--detected-at", type=float, action="append", help="distance of detection; 10, 6 and 4"
    )
    options = parser.parse_args()
    options.detected_at = options.detected_at or [10.0, 6.0, 4.0]
    options.work = options.work or options.python.parent.parent / "bluesky"
    return options


def _ours(name: str, encounter: Encounter) -> FloatArray:
    """[n, 5] time and both level positions, flown here; heights count when distances are taken."""
    planner = _level_planner() if name.endswith("level only") else planner_at(1.0)
    far = np.array([[lasts_s(encounter) + 3.0 * RANGE_M, 0.0, 0.0]])
    mission = Mission(
        f"level {encounter.seed}",
        State(np.zeros(3)),
        waypoints_m=far,
        reach_radius_m=REACH_RADIUS_M,
    )
    system = AvoidanceSystem(planner, mission)
    craft = Craft(planner, 0.3, planner.automaton.turning_radius_m)
    pilot = pilot_named(name.partition(",")[0], system, craft)
    intruder = ScriptedIntruder(
        "intruder", 0.0, encounter.position_m, encounter.velocity_mps,
        radius_m=RADIUS_M, spawn="world",
    )  # fmt: skip
    limits = SimulationSettings(seed=encounter.seed, time_limit_s=lasts_s(encounter))
    run = simulate(
        pilot,
        ObstacleMap(),
        lidars=(),
        settings=limits,
        on_decision=None,
        traffic=Traffic([intruder], mission, SPEED_MPS),
    )
    other = run.intruder_tracks["intruder"][:, 1:]
    return np.column_stack([run.time_s, run.states[:, :3], other])


_planners: dict[str, Planner] = {}


def _level_planner() -> Planner:
    """The planner of the others, but neither climbing nor descending."""
    if not _planners:
        automaton = MovementAutomaton.plane(speed_mps=SPEED_MPS, pitch_limit_deg=0.0)
        library = ReachLibrary.load_or_build(automaton, AvoidanceGrid.uniform(RANGE_M))
        settings = AvoidanceSettings(safety_margin_m=SAFETY_MARGIN_M, transponder_address="ownship")
        _planners["level"] = Planner.of(library, settings)
    return _planners["level"]


def _theirs(
    python: Path, script: str, given: Sequence[Encounter], work: Path
) -> dict[str, list[FloatArray]]:
    """Tracks by name, flown by a script of theirs."""
    work.mkdir(parents=True, exist_ok=True)
    order = {
        "keep_m": distance_to_keep_m(1.0),
        "turn_rps": SPEED_MPS / planner_at(1.0).automaton.turning_radius_m,
        "courses": [
            {
                "position": each.position_m[:2].tolist(),
                "velocity": each.velocity_mps[:2].tolist(),
                "lasts_s": lasts_s(each),
            }
            for each in given
        ],
    }
    with tempfile.TemporaryDirectory() as folder:
        asked, told = Path(folder) / "courses.json", Path(folder) / "tracks.json"
        asked.write_text(json.dumps(order), encoding="utf-8")
        command = [str(python), str(HERE / script), str(asked), str(told)]
        command += [str(work)] if script == "fly_bluesky.py" else []
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            print(f"{script} failed:\n{done.stderr[-2000:]}", file=sys.stderr)
            raise SystemExit(1)
        flown: Mapping[str, Any] = json.loads(told.read_text(encoding="utf-8"))
    return {name: [_in_space(track) for track in tracks] for name, tracks in flown.items()}


def _in_space(track: Sequence[Sequence[float]]) -> FloatArray:
    """[n, 7] of a level track [n, 5]."""
    rows = np.array(track)
    level = np.zeros((len(rows), 1))
    return np.concatenate([rows[:, :3], level, rows[:, 3:], level], axis=1)


def _judged(name: str, tracks: Sequence[FloatArray]) -> Line:
    apart = np.array([_nearest(track) for track in tracks])
    aside = [float(np.hypot(track[:, 2], track[:, 3]).max()) for track in tracks]
    kept = int(np.count_nonzero(apart >= distance_to_keep_m(1.0) - 1e-3))
    return Line(
        name, kept, len(tracks), float(apart.min()), float(np.median(apart)), float(np.mean(aside))
    )


def _nearest(track: FloatArray) -> float:
    """Smallest distance; both fly straight between samples."""
    off = track[:, 4:] - track[:, 1:4]
    step = np.diff(off, axis=0)
    length2 = np.maximum(np.einsum("ij,ij->i", step, step), 1e-12)
    share = np.clip(-np.einsum("ij,ij->i", off[:-1], step) / length2, 0.0, 1.0)
    return float(np.linalg.norm(off[:-1] + share[:, None] * step, axis=1).min())


def _table(detected_at_m: float, count: int, lines: Sequence[Line]) -> str:
    """Markdown; the ratio is that of losses with and without avoidance."""
    flown = lines[0].flown
    rows = [
        f"\nDetected at {detected_at_m:g}: {flown} of {count} level encounters can be avoided\n",
        "| planner | kept 1.2 | 95 % (Wilson) | lost, of straight flight's | nearest | median "
        "| lateral |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    without = next(line for line in lines if line.planner == "straight")
    lost = without.flown - without.kept
    for line in lines:
        low, high = wilson(line.kept, line.flown)
        rows.append(
            f"| {line.planner} | {line.kept} | {100 * low:.1f} to {100 * high:.1f} % "
            f"| {(line.flown - line.kept) / lost:.3f} | {line.nearest:.2f} "
            f"| {line.median:.2f} | {line.aside:.1f} |"
        )
    return "\n".join(rows)


if __name__ == "__main__":
    main()
