"""`clearway reach-set compare`: table 6.1 as measured, beside the paper's figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import picture_options as drawn
from clearway.cli import reach_options as given
from clearway.cli.report import print_json, say

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.reach.compare.comparison import Comparison, MethodRow
    from clearway.view.plot.style import Pictures

ESTIMATE = "Full reach set"


def compare_reach_methods(
    layers: given.Layers = 15,
    range_m: given.RangeM = None,
    columns: given.Columns = 7,
    rows: given.Rows = 5,
    azimuth_deg: given.AzimuthDeg = "45",
    elevation_deg: given.ElevationDeg = "30",
    speed: given.Speed = 1.0,
    turn_step_deg: given.TurnStepDeg = 15.0,
    duration: given.Duration = 1.0,
    pitch_limit_deg: given.PitchLimitDeg = "none",
    movements: given.Movements = 9,
    branches: Annotated[
        int, typer.Option(min=1, help="Branches followed by an estimate.", rich_help_panel=ESTIMATE)
    ] = 16,
    repetitions: Annotated[
        int, typer.Option(min=2, help="Independent estimates.", rich_help_panel=ESTIMATE)
    ] = 24,
    seed: Annotated[int, typer.Option(min=0, help="Seed.", rich_help_panel=ESTIMATE)] = 0,
    as_json: given.AsJson = False,
    out: given.Out = None,
    plots: given.Plots = True,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
) -> None:
    """Measure every method on one grid, beside the paper's table 6.1."""
    from clearway.reach.compare.comparison import compare_methods as compared

    pictures = drawn.pictures_of(form, dpi)
    folder = given.check_picture_folder(out, "reach-set-compare") if plots else None
    automaton = given.build_option_automaton(
        speed, turn_step_deg, duration, pitch_limit_deg, movements
    )
    grid = given.grid_of(
        range_m, speed * duration, layers, azimuth_deg, columns, elevation_deg, rows
    )
    result = compared(
        automaton, grid, branches=branches, repetitions=repetitions, seed=seed, progress=say
    )
    if as_json:
        print_json(_as_json(result))
    else:
        print(_as_text(result))
    if folder is not None:
        _draw(result, folder, pictures)


def _draw(result: Comparison, folder: ResultsFolder, pictures: Pictures) -> None:
    from clearway.reach.compare.comparison import over_spreads
    from clearway.view.plot.reach import draw_reach_set_views
    from clearway.view.plot.reach_compare import draw_spreads
    from clearway.view.plot.style import house_style

    say(f"drawing into {folder.path}")
    with folder.write() as scratch, house_style():
        for row in result.rows:
            figure = draw_reach_set_views(row.reach_set, f"{row.contender.name} reach set")
            pictures.save(figure, scratch, row.contender.name.replace(" ", "-"))
        spreads = over_spreads(result.automaton, result.grid)
        pictures.save(draw_spreads(result, spreads), scratch, "nodes-against-coverage")


def _as_json(result: Comparison) -> dict[str, Any]:
    import math

    limit = result.automaton.pitch_limit_rad
    return {
        "layers": result.grid.layers,
        "columns": result.grid.columns,
        "rows": result.grid.rows,
        "range_m": result.grid.range_m,
        "movements": len(result.automaton.movements),
        "pitch_limit_deg": None if limit is None else round(math.degrees(limit), 9),
        "start_pitch_deg": 0.0,
        "full_footprints": result.full.number,
        "full_footprints_stderr": result.full.standard_error,
        "full_footprints_counted": result.full.counted,
        "cells_reachable": result.reachable.number,
        "cells_reachable_proven": result.reachable.proven,
        "equations": {name: value for name, value, _ in _equations(result)},
        "methods": [_row_as_json(row, result) for row in result.rows],
    }


def _row_as_json(row: MethodRow, result: Comparison) -> dict[str, Any]:
    ratio, error = row.ratio(result.full)
    paper = row.contender.paper
    return {
        "name": row.contender.name,
        "method": row.contender.method,
        "tuning": dict(row.contender.tuning),
        "nodes": row.coverage.nodes,
        "trajectories": row.coverage.trajectories,
        "side_exits": row.coverage.side_exits,
        "nodes_with_side_exits": row.coverage.nodes_with_side_exits,
        "footprints": row.coverage.footprints,
        "footprints_of_samples": row.coverage.footprints_of_samples,
        "cells_covered": row.coverage.cells_covered,
        "cells_reachable": result.reachable.number,
        "coverage_ratio": ratio,
        "coverage_ratio_stderr": error,
        "smoothness": row.coverage.smoothness,
        "smoothness_worst": row.coverage.smoothness_worst,
        "dispersion": row.dispersion.largest_m,
        "dispersion_mean": row.dispersion.mean_m,
        "build_s": row.build_s,
        "spread": row.spread,
        "bound_6_5": row.bound,
        "paper": None
        if paper is None
        else {"nodes": paper[0], "trajectories": paper[1], "coverage_ratio": paper[2]},
    }


def _equations(result: Comparison) -> list[tuple[str, float, str]]:
    """Eqs. (6.4)-(6.7): name, value, and in words."""
    from clearway.reach.compare.comparison import compute_bound_6_5

    moves, cells = len(result.automaton.movements), result.grid.cells
    full = float(sum(moves**depth for depth in range(1, result.grid.layers + 1)))
    linear, residue = float(moves * 9 * cells), 2.718281828459045 ** (moves * 9)
    return [
        ("6.4", linear + residue, f"m r h v l + e^(m r) = {linear:.0f} + {residue:.3g}, r = 9"),
        ("6.5", float(compute_bound_6_5(moves, 9, result.grid)), "m (r + 1) h v l, r = 9"),
        ("6.6", float(moves * cells), f"{moves} x {cells}, to be multiplied by k"),
        ("6.7", 2483.0 / full, f"2483 of {full:.4e} nodes; printed, for 15 layers, as 1.2088e-12"),
        ("6.7 combined", 2162.0 / full, "the combined method's own 2162 nodes"),
    ]


def _as_text(result: Comparison) -> str:
    full, limit = result.full, result.automaton.pitch_limit_rad
    layers, columns, rows = result.grid.shape
    number = f"{full.number:.0f}" if full.counted else f"{full.number:.2g}"
    error = "counted" if full.counted else f"estimated, standard error {full.standard_error:.1g}"
    bound = "none" if limit is None else f"{57.29577951308232 * limit:g} deg"
    head = (
        f"{'method':<16}{'nodes':>7}{'traj.':>7}{'side':>6}{'footpr.':>9}{'cells':>7}"
        f"{'C_R':>10}{'+-':>9}{'smooth':>8}{'worst':>7}{'disp. m':>9}{'built':>9}"
        f"   paper, 15 layers"
    )
    lines = [
        f"{layers} x {columns} x {rows} cells to {result.grid.range_m:g} m, "
        f"{len(result.automaton.movements)} movements, level start, pitch limit {bound}",
        f"full reach set: {number} footprints ({error}), {_reachable(result)}",
        "",
        head,
        *(_row_as_text(row, result) for row in result.rows),
        "",
        "Nodes, trajectories, footprints (of movement end points) and smoothness count what ends",
        "in the last layer; trajectories out through the side stand apart (side).",
        *_why_not(result),
        "",
        *(f"({name}) {value:.4g}: {words}" for name, value, words in _equations(result)),
        "Nodes within (6.5) for each set's own spread: "
        + ("all." if all(r.reach_set.nodes <= r.bound for r in result.rows) else "NOT ALL."),
    ]
    return "\n".join(lines)


def _reachable(result: Comparison) -> str:
    cells = f"{result.reachable.number} of {result.grid.cells} cells can be reached"
    return cells if result.reachable.proven else f"at least {cells}"


def _row_as_text(row: MethodRow, result: Comparison) -> str:
    ratio, error = row.ratio(result.full)
    coverage, paper = row.coverage, row.contender.paper
    printed = "" if paper is None else f"   {paper[0]}, {paper[1]}, {paper[2]:.2f}"
    return (
        f"{row.contender.name:<16}{coverage.nodes:>7}{coverage.trajectories:>7}"
        f"{coverage.side_exits:>6}{coverage.footprints:>9}{coverage.cells_covered:>7}"
        f"{ratio:>10.2g}{error:>9.1g}{coverage.smoothness:>8.3f}{coverage.smoothness_worst:>7.2f}"
        f"{row.dispersion.largest_m:>9.2f}{1e3 * row.build_s:>6.0f} ms{printed}"
    )


def _why_not(result: Comparison) -> list[str]:
    """Why the coverage ratios of table 6.1 cannot be."""
    return [
        "The printed ratios cannot be: a set has at most as many footprints as trajectories, so",
        "305 trajectories at C_R = 0.87 would need a full reach set of at most "
        f"{305 / 0.87:.1f} footprints,",
        f"not {result.full.number:.2g}. Cells covered of those reached is what comes near 0.9.",
    ]
