"""`clearway reach-set`: build one, say what it covers, draw it."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from clearway.cli.report import print_json, say
from clearway.errors import ClearwayError

if TYPE_CHECKING:
    from clearway.grid import AvoidanceGrid
    from clearway.movements import MovementAutomaton
    from clearway.reach.coverage import Coverage
    from clearway.reach.tree import ReachSet

GRID, VEHICLE, OUTPUT = "Grid", "Vehicle", "Output"


def reach_set(
    context: typer.Context,
    method: Annotated[
        str,
        typer.Option(
            help="full, chaotic, harmonic, combined, primitives, dispersion, cover, late, flying."
        ),
    ] = "flying",
    layers: Annotated[int, typer.Option(help="Layers of the grid.", rich_help_panel=GRID)] = 10,
    range_m: Annotated[
        float | None,
        typer.Option(
            "--range",
            help="Range of the grid in metres; by default one movement's length per layer.",
            rich_help_panel=GRID,
        ),
    ] = None,
    columns: Annotated[int, typer.Option(help="Columns.", rich_help_panel=GRID)] = 7,
    rows: Annotated[int, typer.Option(help="Rows.", rich_help_panel=GRID)] = 5,
    azimuth_deg: Annotated[
        str, typer.Option(help="Half width, or right,left.", rich_help_panel=GRID)
    ] = "45",
    elevation_deg: Annotated[
        str, typer.Option(help="Half height, or bottom,top.", rich_help_panel=GRID)
    ] = "30",
    speed: Annotated[float, typer.Option(help="Speed in m/s.", rich_help_panel=VEHICLE)] = 1.0,
    turn_step_deg: Annotated[
        float, typer.Option(help="Turn by one movement.", rich_help_panel=VEHICLE)
    ] = 15.0,
    duration: Annotated[
        float, typer.Option(help="Seconds of one movement.", rich_help_panel=VEHICLE)
    ] = 1.0,
    pitch_limit_deg: Annotated[
        str, typer.Option(help="Steepest pitch, or none.", rich_help_panel=VEHICLE)
    ] = "30",
    movements: Annotated[
        int, typer.Option(help="9, or 5 without diagonals.", rich_help_panel=VEHICLE)
    ] = 9,
    start_pitch_deg: Annotated[
        float, typer.Option(help="Pitch at the start, nose down.", rich_help_panel=VEHICLE)
    ] = 0.0,
    spread: Annotated[
        int | None, typer.Option(help="Nodes per cell of chaotic and combined.")
    ] = None,
    harmonic: Annotated[
        int | None, typer.Option(help="Nodes per cell of harmonic and combined.")
    ] = None,
    side_exits: Annotated[
        bool, typer.Option(help="Keep trajectories that leave through the side.")
    ] = True,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object.", rich_help_panel=OUTPUT)
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the picture; clearway-out/reach-set by default.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    plots: Annotated[bool, typer.Option(help="Draw it.", rich_help_panel=OUTPUT)] = True,
) -> None:
    """Build a reach set, print its nodes, trajectories and smoothness, and draw it."""
    if context.invoked_subcommand is not None:
        return
    from clearway.reach.coverage import measure
    from clearway.reach.sets import build_reach_set

    automaton = automaton_of(speed, turn_step_deg, duration, pitch_limit_deg, movements)
    grid = grid_of(
        layers * speed * duration if range_m is None else range_m,
        layers,
        azimuth_deg,
        columns,
        elevation_deg,
        rows,
    )
    tuning = {} if spread is None else {"spread": float(spread)}
    tuning |= {} if harmonic is None else {"harmonic": float(harmonic)}
    tuning |= {} if side_exits else {"side_exits": 0.0}
    start_pitch_rad = checked_pitch(start_pitch_deg, automaton)
    # Once on a small grid, so that the time printed is not the compiler's.
    _warm_up(automaton, grid, method, start_pitch_rad, tuning)
    began = time.perf_counter()
    tree = build_reach_set(automaton, grid, method, start_pitch_rad, **tuning)
    build_s = time.perf_counter() - began
    coverage = measure(tree)
    if plots:
        picture = _draw(tree, method, out or Path("clearway-out/reach-set"))
        say(f"picture: {picture}")
    if as_json:
        print_json(_as_json(method, tree, automaton, coverage, build_s))
    else:
        print(_as_text(method, tree, automaton, coverage, build_s))


def automaton_of(
    speed_mps: float, turn_step_deg: float, duration_s: float, pitch_limit_deg: str, movements: int
) -> MovementAutomaton:
    """The plane's automaton of command-line values; raises ClearwayError naming the option."""
    from clearway.movements import MovementAutomaton

    if movements not in (5, 9):
        raise ClearwayError(f"--movements: {movements} is neither 5 nor 9")
    if not (0.0 < speed_mps < 1e6):
        raise ClearwayError(f"--speed: {speed_mps} is not a speed in m/s above 0")
    if not (0.0 < duration_s < 1e6):
        raise ClearwayError(f"--duration: {duration_s} is not a time in s above 0")
    if not (0.0 <= abs(turn_step_deg) <= 180.0):
        raise ClearwayError(f"--turn-step-deg: {turn_step_deg} is not within [-180, 180]")
    limit = None
    if pitch_limit_deg != "none":
        (limit,) = _numbers("--pitch-limit-deg", pitch_limit_deg, (1,), "or none")
        if not 0.0 <= limit < 90.0:
            raise ClearwayError(f"--pitch-limit-deg: {limit:g} is not within [0, 90)")
    return MovementAutomaton.plane(
        speed_mps, turn_step_deg, duration_s, limit, diagonals=movements == 9
    )


def grid_of(
    range_m: float, layers: int, azimuth_deg: str, columns: int, elevation_deg: str, rows: int
) -> AvoidanceGrid:
    """The grid of command-line values; raises ClearwayError naming the option."""
    from clearway.grid import AvoidanceGrid

    spans = {}
    for option, value in (("--azimuth-deg", azimuth_deg), ("--elevation-deg", elevation_deg)):
        numbers = _numbers(option, value, (1, 2), "or two with a comma")
        spans[option] = numbers[0] if len(numbers) == 1 else (numbers[0], numbers[1])
    return AvoidanceGrid.uniform(
        range_m, layers, spans["--azimuth-deg"], columns, spans["--elevation-deg"], rows
    )


def checked_pitch(start_pitch_deg: float, automaton: MovementAutomaton) -> float:
    """Start pitch in radians; raises ClearwayError beyond the limit."""
    import math

    pitch = math.radians(start_pitch_deg)
    limit = automaton.pitch_limit_rad
    if not abs(pitch) <= (math.pi / 2 if limit is None else limit + 1e-9):
        raise ClearwayError(f"--start-pitch-deg: {start_pitch_deg} is beyond the pitch limit")
    return pitch


def _numbers(option: str, value: str, counts: tuple[int, ...], others: str) -> list[float]:
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts:
        raise ClearwayError(f"{option}: {value!r} is not a number, {others}")
    return numbers


def _warm_up(
    automaton: MovementAutomaton,
    grid: AvoidanceGrid,
    method: str,
    start_pitch_rad: float,
    tuning: dict[str, float],
) -> None:
    """Load or make the compiled loops on the first layers alone."""
    from clearway.grid import AvoidanceGrid
    from clearway.reach.sets import build_reach_set

    few = min(3, grid.layers)
    small = AvoidanceGrid(
        grid.range_edges_m[: few + 1], grid.azimuth_edges_rad, grid.elevation_edges_rad
    )
    build_reach_set(automaton, small, method, start_pitch_rad, **tuning)


def _draw(tree: ReachSet, method: str, folder: Path) -> Path:
    from clearway.io.staging import staged
    from clearway.plot.reach import draw_reach_set_views

    name = f"reach-set-{method}-{tree.grid.layers}-layers.png"
    with staged(folder) as scratch:
        figure = draw_reach_set_views(tree, title=f"{method} reach set")
        figure.savefig(scratch / name)
    return folder / name


def _as_json(
    method: str,
    tree: ReachSet,
    automaton: MovementAutomaton,
    coverage: Coverage,
    build_s: float,
) -> dict[str, object]:
    import math
    from dataclasses import asdict

    limit = automaton.pitch_limit_rad
    grid = tree.grid
    return {
        "method": method,
        **asdict(coverage),
        "build_s": build_s,
        "pitch_limit_deg": None if limit is None else round(math.degrees(limit), 9),
        "start_pitch_deg": round(math.degrees(tree.start_pitch_rad), 9),
        "movements": len(automaton.movements),
        "layers": grid.layers,
        "columns": grid.columns,
        "rows": grid.rows,
        "range_m": grid.range_m,
        "cells": grid.cells,
    }


def _as_text(
    method: str,
    tree: ReachSet,
    automaton: MovementAutomaton,
    coverage: Coverage,
    build_s: float,
) -> str:
    import math

    limit = automaton.pitch_limit_rad
    bound = "none" if limit is None else f"{math.degrees(limit):g} deg"
    layers, columns, rows = tree.grid.shape
    lines = {
        "reach set": f"{method}, {len(automaton.movements)} movements",
        "grid": f"{layers} x {columns} x {rows} cells to {tree.grid.range_m:g} m",
        "pitch": f"{math.degrees(tree.start_pitch_rad):g} deg at the start, limit {bound}",
        "nodes": f"{coverage.nodes}",
        "trajectories": f"{coverage.trajectories} to the last layer",
        "side exits": f"{coverage.side_exits}, with them {coverage.nodes_with_side_exits} nodes",
        "footprints": f"{coverage.footprints}",
        "cells covered": f"{coverage.cells_covered} of {tree.grid.cells}",
        "smoothness": f"{coverage.smoothness:.3f} mean, {coverage.smoothness_worst:.3f} worst",
        "built in": f"{1e3 * build_s:.0f} ms",
    }
    return "\n".join(f"{name:<14}{value}" for name, value in lines.items())
