"""`clearway automaton`: measure the movements of a plant, and show what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli.numbers import MOST_COUNTED
from clearway.cli.progress import progress_bar
from clearway.cli.report import print_json, say

if TYPE_CHECKING:
    from clearway.missions.automaton_file import AutomatonFile, CopterSection
    from clearway.sim.plants.plant import PlantKind
    from clearway.vehicle.automaton import MovementAutomaton


def measure(
    plant: Annotated[str, typer.Argument(help="A plant by name, or your own as module:name.")],
    out: Annotated[Path, typer.Option(help="The automaton file to write.")],
    flights: Annotated[
        int, typer.Option(min=1, max=MOST_COUNTED, help="Flights that make the table.")
    ] = 6,
    held_out: Annotated[
        int,
        typer.Option(min=1, max=MOST_COUNTED, help="Flights that predictions are checked against."),
    ] = 3,
    speed: Annotated[
        float | None, typer.Option(max=1e3, help="Speed in m/s; default: its usual one.")
    ] = None,
    movement_s: Annotated[
        float | None,
        typer.Option(max=100.0, help="Duration of a movement; default: its usual one."),
    ] = None,
    inertia: Annotated[
        bool, typer.Option("--inertia", help="As a copter with inertia, by classes of motion.")
    ] = False,
    acceleration: Annotated[
        float | None, typer.Option(max=100.0, help="With --inertia: greatest acceleration, m/s2.")
    ] = None,
    gusts: Annotated[
        float, typer.Option(min=0.0, max=100.0, help="Standard deviation of gusts, m/s.")
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0, help="Of all noise.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Fly every movement of a plant after every other, and write where each leads.

    Each flight is a random round that uses each pair of movements once; with --inertia it flies
    every movement in every class of motion, led by the plan. Held-out flights show how far
    predictions are off.
    """
    from dataclasses import replace

    from clearway.io.results_folder import refuse_unwritable_file
    from clearway.missions.automaton_file import automaton_file, copter_file, write_automaton
    from clearway.sim.plants import PLANTS
    from clearway.sim.plants.measuring import MeasureSettings, measure_plant
    from clearway.sim.plants.measuring_classes import measure_copter
    from clearway.vehicle.automaton import MovementAutomaton
    from clearway.vehicle.copter import CopterLimits

    kind = PLANTS.find(plant)
    refuse_unwritable_file(out, "--out")
    settings = MeasureSettings(flights, held_out, seed, gusts_mps=gusts)
    with progress_bar(f"measuring {plant}", flights + held_out) as bar:
        show_progress = lambda done, total: bar.show(done, total)  # noqa: E731
        if inertia:
            own = kind.copter or CopterLimits(5.0)
            given = {"speed_mps": speed, "acceleration_mps2": acceleration}
            stated = {key: value for key, value in given.items() if value is not None}
            limits = replace(own, gusts_mps=gusts, **stated)
            asked = MovementAutomaton.of_copter(limits)
            copter = measure_copter(kind, asked, settings, show_progress)
            file = copter_file(plant, limits, copter, settings)
        else:
            measured = measure_plant(
                kind, _movements(plant, kind, speed, movement_s), settings, show_progress
            )
            file = automaton_file(plant, measured, settings)
    if as_json:
        print_json(_as_json(file))
    else:
        _print(file)
        if not inertia:
            closed = ", ".join(_quantile(each) for each in measured.closed_form_m)
            print(f"closed form: {closed} m")
    write_automaton(file, out)
    say(f"wrote {out}")


def _movements(
    plant: str, kind: PlantKind, speed_mps: float | None, movement_s: float | None
) -> MovementAutomaton:
    from clearway.base.errors import ClearwayError

    if kind.movements is None:
        raise ClearwayError(
            f"plant {plant}: tells no movements; give it `movements`, a function of speed_mps and "
            "duration_s that gives an automaton"
        )
    given = {"speed_mps": speed_mps, "duration_s": movement_s}
    return kind.movements(**{key: value for key, value in given.items() if value is not None})


def show(
    file: Annotated[Path, typer.Argument(help="An automaton file.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Show the movements of an automaton file, and how well they predict."""
    from clearway.io.toml import read_model
    from clearway.missions.automaton_file import AutomatonFile

    read = read_model(file, AutomatonFile)
    if as_json:
        print_json(_as_json(read))
    else:
        _print(read)


def _quantile(errors: Any) -> str:
    import numpy as np

    return f"{float(np.quantile(errors, 0.95)):.3g}"


def _as_json(file: AutomatonFile) -> dict[str, Any]:
    return file.model_dump(mode="json") | {
        "pair": [
            {
                "previous": pair.previous,
                "movement": pair.movement,
                "displacement_m": list(pair.path[-1][:3]),
                "yaw_change_rad": pair.path[-1][3],
                "spread_m": pair.spread_m,
                "spread_yaw_rad": pair.spread_yaw_rad,
                "path": [list(row) for row in pair.path],
            }
            for pair in file.pair
        ]
    }


def _print_copter(plant: str, copter: CopterSection) -> None:
    print(f"{plant}: {copter.speed_mps:g} m/s, {copter.acceleration_mps2:g} m/s2")
    print("speed (m/s)  tube, 99 % (m)  held out inside (%)")
    inside = copter.inside or (float("nan"),) * len(copter.tube_m)
    for speed, radius, share in zip(copter.speeds_mps, copter.tube_m, inside, strict=True):
        print(f"{speed:11.2f}  {radius:14.3f}  {100.0 * share:19.1f}")


def _print(file: AutomatonFile) -> None:
    from math import degrees

    about = file.automaton
    if file.copter is not None:
        _print_copter(about.plant, file.copter)
        return
    count = len(file.movement)
    print(f"{about.plant}: {count} movements, {len(file.pair)} of {count * count} pairs")
    longest = max(len(one.name) for one in file.movement)
    print(f"{'movement':{longest}s}  after itself: x, y, z (m), turned (deg); spread (m)")
    pairs = {(pair.previous, pair.movement): pair for pair in file.pair}
    for one in file.movement:
        pair = pairs.get((one.name, one.name))
        if pair is None:
            print(f"{one.name:{longest}s}  may not be flown twice")
            continue
        x, y, z, yaw = pair.path[-1]
        print(
            f"{one.name:{longest}s}  {x:8.2f} {y:8.2f} {z:8.2f} {degrees(yaw):8.2f}"
            f"  {pair.spread_m:6.3f}"
        )
    for name, radii in (("held out, 95 %", about.error_p95_m), ("tube, 99.9 %", about.tube_m)):
        print(
            f"{name}: {', '.join(f'{radius:.3g}' for radius in radii)} m after 1, 2, ... movements"
        )
