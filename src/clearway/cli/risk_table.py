"""What `clearway risk` prints: a table of ratios, and the cases to look at."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from clearway.cli.report import table_console

if TYPE_CHECKING:
    from clearway.studies.risk.study import RiskStudy

CASES_SHOWN = 8


def print_tables(result: RiskStudy, summary: dict[str, Any], model: Path | None) -> None:
    """summary: of the result, as `--json` prints it; model: its file, None for the made-up one."""
    from rich.table import Table

    from clearway.studies.risk.ratios import MEASURES

    console = table_console()
    console.print(f"{summary['encounters']} encounters of {summary['model']}: {summary['kind']}")
    table = Table(title="risk ratios with 95 % intervals; of it unresolved + induced")
    table.add_column("planner")
    for name in MEASURES.values():
        table.add_column(name, justify="right")
    table.add_column("aside", justify="right")
    straight = summary["straight"]
    rates = [f"{straight[name]['rate']:.2g} each" for name in MEASURES]
    table.add_row("straight", *rates, "")
    for planner, measures in summary["planners"].items():
        cells = [_cell(measures[name]) for name in MEASURES]
        table.add_row(planner, *cells, f"{measures['mean_aside_m']:.0f} m")
    console.print(table)
    for planner in result.planners:
        _print_cases(summary["planners"][planner], planner, result, model)


def _cell(measure: dict[str, Any]) -> str:
    if measure["ratio"] is None:
        return "no case"
    low, high = measure["ratio_95"]
    split = f"{measure['unresolved']:.3f} + {measure['induced']:.3f}"
    ends = f"[{low:.3f}, {'no bound' if high is None else f'{high:.3f}'}]"
    said = f"\n<= {measure['limit']:g}: {measure['verdict']}" if "verdict" in measure else ""
    return f"{measure['ratio']:.3f} {ends}\n{split}{said}"


def _print_cases(
    measures: dict[str, Any], planner: str, result: RiskStudy, model: Path | None
) -> None:
    cases = measures["near_collision"]["cases"]
    if not cases:
        return
    some = ", ".join(map(str, cases[:CASES_SHOWN]))
    more = f" and {len(cases) - CASES_SHOWN} more" if len(cases) > CASES_SHOWN else ""
    given = f"{model} " if model else ""
    print(f"{planner}: near mid-air collisions in {some}{more}; see one with "
          f"clearway risk {given}{_options(result)}-p {planner} --only NUMBER")  # fmt: skip


def _options(result: RiskStudy) -> str:
    """The options that make these encounters."""
    settings = result.settings
    words = []
    if result.seed:
        words.append(f"--seed {result.seed}")
    if settings.own_kt != 50.0:
        words.append(f"--own-kt {settings.own_kt:g}")
    if settings.position_std_m or settings.velocity_std_mps:
        words.append(f"--noise {settings.position_std_m:g},{settings.velocity_std_mps:g}")
    if settings.report_s != 1.0:
        words.append(f"--report-s {settings.report_s:g}")
    if settings.stretch != 4.0:
        words.append(f"--stretch {settings.stretch:g}")
    if settings.layers:
        words.append(f"--layers {','.join(str(layer + 1) for layer in settings.layers)}")
    return " ".join([*words, ""])
