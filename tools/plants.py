"""Plants measured and flown at their own scale: the tables of docs/plants.md.

`python -m tools.plants` prints them, with `--write` into the page; `--worlds N` flies so many
worlds a plant, `--flights N` measures with so many flights.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from clearway.io.marked_page import put_between_marks
from clearway.io.toml import parse_model
from clearway.missions.automaton_file import automaton_file, write_automaton
from clearway.missions.mission_file import MissionFile
from clearway.missions.setup import prepare
from clearway.sim import Run
from clearway.sim.plants import PLANTS
from clearway.sim.plants.measuring import MeasuredPlant, MeasureSettings, measure

PAGE = Path(__file__).resolve().parent.parent / "docs" / "plants.md"
STRAYED = "state: outside the tube of its plan"


@dataclass(frozen=True)
class Scale:
    """One plant's worlds, in its own lengths."""

    plant: str
    leg_m: float
    apart_m: float
    """Between masts, at least."""
    radius_m: tuple[float, float]
    wide_m: float
    range_m: float
    margin_m: float
    reach_m: float
    mapped: bool = False
    """By a complete map, without a sensor."""


SCALES = (
    Scale("quadrotor", 120.0, 16.0, (0.3, 1.5), 60.0, 50.0, 1.5, 4.0),
    Scale("F450", 100.0, 12.0, (0.3, 1.5), 50.0, 40.0, 1.5, 4.0),
    Scale("c172x", 12_000.0, 1_600.0, (5.0, 60.0), 6_000.0, 3_500.0, 60.0, 250.0, mapped=True),
)
WINDS = (("calm", 0.0, 0.0), ("wind of a quarter of the speed, gusts", 0.25, 0.05))


def masts(scale: Scale, seed: int) -> list[dict[str, Any]]:
    """Masts too tall to fly over, at random in front of a leg."""
    rng = np.random.default_rng([seed, 41])
    places: list[np.ndarray] = []
    for _ in range(4000):
        place = rng.uniform(
            [0.15 * scale.leg_m, -0.5 * scale.wide_m], [0.9 * scale.leg_m, 0.5 * scale.wide_m]
        )
        if all(np.linalg.norm(place - other) >= scale.apart_m for other in places):
            places.append(place)
    tall = 2.0 * scale.range_m
    return [
        {
            "shape": "line",
            "position_m": [float(x), float(y), 0.0],
            "orientation_deg": [0.0, 90.0, 0.0],
            "size_m": [tall],
            "radius_m": float(rng.uniform(*scale.radius_m)),
            "known": "both" if scale.mapped else "world",
        }
        for x, y in places
    ]


def mission(
    scale: Scale, automaton: Path, seed: int, wind: float, gusts: float, speed_mps: float
) -> MissionFile:
    """A leg through masts."""
    rng = np.random.default_rng([seed, 42])
    from_rad, strength = rng.uniform(-np.pi, np.pi), wind * speed_mps
    tables: dict[str, Any] = {
        "mission": {
            "name": f"{scale.plant}-{seed}",
            "waypoints_m": [[scale.leg_m, 0.0, 0.0]],
            "reach_radius_m": scale.reach_m,
        },
        "vehicle": {"plant": scale.plant, "automaton": str(automaton)},
        "grid": {"range_m": scale.range_m, "layers": 12},
        "safety": {"margin_m": scale.margin_m},
        "simulation": {
            "seed": seed,
            "wind_mps": [strength * np.cos(from_rad), strength * np.sin(from_rad), 0.0],
            "gusts_mps": gusts * speed_mps,
        },
        "obstacle": masts(scale, seed),
    }
    if scale.mapped:
        tables["safety"]["escape"] = "mapped"
        tables["map"] = {"files": [], "complete": True}
        tables["lidar"] = []
    return parse_model(f"{scale.plant} {seed}", tables, MissionFile)


def told(runs: Sequence[tuple[Run[Any], float]]) -> str:
    """What came of some flights, as cells of a row."""
    arrived = sum(run.reached for run, _ in runs)
    crashed = sum(run.crashed_s is not None for run, _ in runs)
    lost = sum(run.metrics.margin_violations > 0 for run, _ in runs)
    counts = Counter[str]()
    for run, _ in runs:
        counts.update(run.counts)
    looks = sum(len(run.decisions) for run, _ in runs)
    inside = 100.0 * (1.0 - counts[STRAYED] / max(looks, 1))
    factor = sum(run.metrics.time_s for run, _ in runs) / sum(cpu for _, cpu in runs)
    without = sum(run.summary()["without_way_out"] or 0 for run, _ in runs)
    return (
        f"{len(runs)} | {arrived} | {crashed} | {lost} | {without} of {looks} | {inside:.1f} % | "
        f"{factor:.1f}"
    )


def measured_row(plant: str, measured: MeasuredPlant) -> str:
    """How far predictions stray: 95 % after one and after five movements."""
    own, closed = measured.error_m, measured.closed_form_m
    cells = [
        f"{np.quantile(errors[moves - 1], 0.95):.3g}"
        for errors in (own, closed)
        for moves in (1, 5)
    ]
    table = measured.automaton.pairs
    assert table is not None
    tube = " / ".join(f"{radius:.3g}" for radius in (table.tube_m[0], table.tube_m[4]))
    return f"| `{plant}` | {measured.samples} | {' | '.join(cells)} | {tube} |"


def main(arguments: Sequence[str]) -> None:
    """Measure, fly, and print or write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=20)
    parser.add_argument("--flights", type=int, default=6)
    parser.add_argument("--plants", default=",".join(scale.plant for scale in SCALES))
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args(arguments)
    predicted = [
        "| plant | movements measured | 95 % off after one, m | after five | closed form: one "
        "| five | tube after one / five |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    flown = [
        "| plant | air | worlds | arrived | crashed | margin lost | decisions without a way out | "
        "within the tube | real-time factor |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    with TemporaryDirectory() as folder:
        for scale in (one for one in SCALES if one.plant in given.plants.split(",")):
            kind = PLANTS[scale.plant]
            assert kind.movements is not None
            settings = MeasureSettings(given.flights, max(1, given.flights // 2))
            measured = measure(kind, kind.movements(), settings)
            predicted.append(measured_row(scale.plant, measured))
            file = Path(folder) / f"{scale.plant}.toml"
            write_automaton(automaton_file(scale.plant, measured, settings), file)
            speed = measured.automaton.fastest_mps
            for air, wind, gusts in WINDS:
                runs = []
                for seed in range(given.worlds):
                    setup = prepare(mission(scale, file, seed, wind, gusts, speed))
                    began = time.process_time()
                    runs.append((setup.fly(), time.process_time() - began))
                    run = runs[-1][0]
                    print(f"{scale.plant} {air} {seed}: {run}", file=sys.stderr, flush=True)
                flown.append(f"| `{scale.plant}` | {air} | {told(runs)} |")
    made = "\n".join([*predicted, "", *flown])
    if given.write:
        put_between_marks(PAGE, "plants", made)
    else:
        print(made)


if __name__ == "__main__":
    main(sys.argv[1:])
