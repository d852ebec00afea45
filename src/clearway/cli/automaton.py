"""`clearway automaton`: measure the movements of a plant, and show what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli.numbers import MOST_COUNTED
from clearway.cli.progress import progress_bar
from clearway.cli.report import print_json, say

if TYPE_CHECKING:
    from clearway.missions.automaton_file import AutomatonFile


def measure(
    plant: Annotated[str, typer.Argument(help="A plant by name, or your own as module:name.")],
    out: Annotated[Path, typer.Option(help="The automaton file to write.")],
    flights: Annotated[
        int, typer.Option(min=1, max=MOST_COUNTED, help="Flights that make the table.")
    ] = 6,
    held_out: Annotated[
        int,
        typer.Option(min=1, max=MOST_COUNTED, help="Flights that predictions are held against."),
    ] = 3,
    speed: Annotated[
        float | None, typer.Option(max=1e3, help="Speed in m/s; default: its usual one.")
    ] = None,
    movement_s: Annotated[
        float | None,
        typer.Option(max=100.0, help="Duration of a movement; default: its usual one."),
    ] = None,
    gusts: Annotated[
        float, typer.Option(min=0.0, max=100.0, help="Standard deviation of gusts, m/s.")
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0, help="Of all noise.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Fly every movement of a plant after every other, and write what came of it.

    Each flight is a random round that uses each pair of movements once; those held out tell how far
    predictions are off.
    """
    from clearway.base.errors import ClearwayError
    from clearway.io.results_folder import refuse_unwritable_file
    from clearway.missions.automaton_file import automaton_file, write_automaton
    from clearway.sim.plants import PLANTS
    from clearway.sim.plants.measuring import MeasureSettings
    from clearway.sim.plants.measuring import measure_plant as measured_of

    kind = PLANTS.named(plant)
    if kind.movements is None:
        raise ClearwayError(
            f"plant {plant}: tells no movements; give it `movements`, a function of speed_mps and "
            "duration_s that gives an automaton"
        )
    given = {"speed_mps": speed, "duration_s": movement_s}
    asked = kind.movements(**{key: value for key, value in given.items() if value is not None})
    refuse_unwritable_file(out, "--out")
    settings = MeasureSettings(flights, held_out, seed, gusts_mps=gusts)
    with progress_bar(f"measuring {plant}", flights + held_out) as bar:
        measured = measured_of(kind, asked, settings, lambda done, total: bar.show(done, total))
    file = automaton_file(plant, measured, settings)
    if as_json:
        print_json(_as_json(file))
    else:
        _print(file)
        closed = ", ".join(_quantile(each) for each in measured.closed_form_m)
        print(f"closed form: {closed} m")
    write_automaton(file, out)
    say(f"wrote {out}")


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


def _print(file: AutomatonFile) -> None:
    from math import degrees

    about = file.automaton
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
