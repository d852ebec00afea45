"""`clearway reach-set`: build one, say what it covers, draw it."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from clearway.base.errors import ClearwayError
from clearway.cli import picture_options as drawn
from clearway.cli import reach_options as given
from clearway.cli.report import print_json, say

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.reach.choose.coverage import Coverage
    from clearway.reach.tree import ReachSet
    from clearway.vehicle.automaton import MovementAutomaton
    from clearway.view.plot.style import Pictures


def reach_set(
    context: typer.Context,
    method: Annotated[str, typer.Option(help="Which trajectories are kept: {methods}.")] = "flying",
    layers: given.Layers = 10,
    range_m: given.RangeM = None,
    columns: given.Columns = 7,
    rows: given.Rows = 5,
    azimuth_deg: given.AzimuthDeg = "45",
    elevation_deg: given.ElevationDeg = "30",
    speed: given.Speed = 1.0,
    turn_step_deg: given.TurnStepDeg = 15.0,
    duration: given.Duration = 1.0,
    pitch_limit_deg: given.PitchLimitDeg = "30",
    movements: given.Movements = 9,
    start_pitch_deg: Annotated[
        float,
        typer.Option(
            help="Pitch at the start; nose down is positive.", rich_help_panel=given.VEHICLE
        ),
    ] = 0.0,
    spread: Annotated[
        int | None, typer.Option(help="Nodes per cell, for methods that limit them.")
    ] = None,
    harmonic: Annotated[
        int | None, typer.Option(help="Harmonic nodes per cell, for methods that limit them.")
    ] = None,
    side_exits: Annotated[
        bool, typer.Option(help="Keep trajectories that leave through the side.")
    ] = True,
    as_json: given.AsJson = False,
    out: given.Out = None,
    plots: given.Plots = True,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
) -> None:
    """Build and draw a reach set, and print its nodes, trajectories and smoothness."""
    if context.invoked_subcommand is not None:
        return
    from clearway.reach.choose.coverage import measure_coverage
    from clearway.reach.expand.lattice import movements_deep
    from clearway.reach.sets import build_reach_set

    pictures = drawn.pictures_of(form, dpi)
    folder = given.check_picture_folder(out, "reach-set") if plots else None
    automaton = given.build_option_automaton(
        speed, turn_step_deg, duration, pitch_limit_deg, movements
    )
    grid = given.grid_of(
        range_m, speed * duration, layers, azimuth_deg, columns, elevation_deg, rows
    )
    tuning = {} if spread is None else {"spread": float(spread)}
    tuning |= {} if harmonic is None else {"harmonic": float(harmonic)}
    tuning |= {} if side_exits else {"side_exits": 0.0}
    start_pitch_rad = check_pitch(start_pitch_deg, automaton)
    movements_deep(automaton, grid)  # Tells of a grid that no chain of movements should cross.
    began = time.perf_counter()
    tree = build_reach_set(
        automaton, grid, method=method, start_pitch_rad=start_pitch_rad, **tuning
    )
    build_s = time.perf_counter() - began
    coverage = measure_coverage(tree)
    if as_json:
        print_json(_as_json(method, tree, automaton, coverage, build_s))
    else:
        print(_as_text(method, tree, automaton, coverage, build_s))
    if folder is not None:
        say(f"picture: {_draw(tree, method, folder, pictures)}")


def check_pitch(start_pitch_deg: float, automaton: MovementAutomaton) -> float:
    """Start pitch in radians; raises ClearwayError beyond the limit."""
    import math

    pitch = math.radians(start_pitch_deg)
    limit = automaton.pitch_limit_rad
    if not abs(pitch) <= (math.pi / 2 if limit is None else limit + 1e-9):
        raise ClearwayError(f"--start-pitch-deg: {start_pitch_deg} is beyond the pitch limit")
    return pitch


def _draw(tree: ReachSet, method: str, folder: ResultsFolder, pictures: Pictures) -> Path:
    from clearway.view.plot.reach import draw_reach_set_views
    from clearway.view.plot.style import house_style

    name = f"reach-set-{method}-{tree.grid.layers}-layers"
    with folder.write() as scratch, house_style():
        figure = draw_reach_set_views(tree, title=f"{method} reach set")
        return folder.path / pictures.save(figure, scratch, name)


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
        "footprints": f"{coverage.footprints}, of finer samples {coverage.footprints_of_samples}",
        "cells covered": f"{coverage.cells_covered} of {tree.grid.cells}",
        "smoothness": f"{coverage.smoothness:.3f} mean, {coverage.smoothness_worst:.3f} worst",
        "built in": f"{1e3 * build_s:.0f} ms",
    }
    return "\n".join(f"{name:<14}{value}" for name, value in lines.items())
