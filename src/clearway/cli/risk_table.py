"""What `clearway risk` prints: a table of ratios, and the cases to look at."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from clearway.base.own_code import shorten_own_name
from clearway.cli.tables import plain_table, print_table

if TYPE_CHECKING:
    from clearway.studies.risk.study import RiskStudy

PLURALS = {"near_collision": "near mid-air collisions", "lost_well_clear": "losses of well clear"}
CASES_SHOWN = 8
WORST_SHOWN = 3
REAL_SCALE = ("all hear the same reports through the same tracker and fly the same vehicle",)
VERDICTS = {"shown": "pass", "missed": "fail", "not shown": "not shown"}


def print_risk(result: RiskStudy, summary: dict[str, Any]) -> None:
    """summary: of the result, as `--json` prints it."""
    from clearway.sim.baselines import NOT_APPLICABLE
    from clearway.sim.baselines.notes import list_shared_notes, not_known
    from clearway.studies.risk.ratios import MEASURES

    print(f"{summary['encounters']} encounters of {summary['model']}: {summary['kind']}")
    title = "risk ratios with 95 % intervals; of it unresolved + induced"
    table = plain_table(("planner",), tuple(MEASURES.values()), title)
    straight = summary["straight"]
    table.add_row("straight", *(f"{straight[name]['rate']:.2g} each" for name in MEASURES))
    for planner, measures in summary["planners"].items():
        hidden = measures["hidden"]
        cells = [NOT_APPLICABLE if hidden else _cell(measures[name]) for name in MEASURES]
        table.add_row(shorten_own_name(planner), *cells)
    print_table(table)
    for planner, measures in summary["planners"].items():
        took = measures["decision_ms"]
        decides = "" if took is None else f"; a decision takes {took:.2f} ms"
        print(f"{planner}: {measures['mean_aside_m']:.0f} m off its path in the mean{decides}")
    for line in not_known((name, each["hidden"]) for name, each in summary["planners"].items()):
        print(line)
    for line in REAL_SCALE if result.settings.vehicle else list_shared_notes(result.planners):
        print(line)
    effective = ", ".join(
        f"{PLURALS[name]} {summary['effective'][name]:.0f}" for name in summary["effective"]
    )
    print(f"without avoidance, effective sample size: {effective}")
    if len(summary["layers"]) > 1:
        _print_layers(summary, result.planners[0])
    for planner in result.planners:
        _print_cases(summary["planners"][planner], planner)
    if result.settings.vehicle:
        for planner in result.planners:
            print(f"{planner}: {nuisance_in_words(summary['planners'][planner]['nuisance'])}")


def nuisance_in_words(told: dict[str, Any]) -> str:
    """Return needless manoeuvres, by both definitions, and detours in a line."""
    if told["of_clear"] is None:
        return "no encounter that straight flight keeps well clear"
    line = f"manoeuvres in {_share(told, 'of_clear')} of what straight flight keeps well clear"
    if told["of_manoeuvres"] is None:
        return line
    return (
        f"{line}; {_share(told, 'of_manoeuvres')} of its manoeuvres are such; "
        f"{told['extra_path_m']:.0f} m of extra path in a manoeuvre"
    )


def _share(told: dict[str, Any], name: str) -> str:
    low, high = told[f"{name}_95"]
    return f"{100.0 * told[name]:.0f} % [{100.0 * low:.0f}, {100.0 * high:.0f}]"


def _cell(measure: dict[str, Any]) -> str:
    if measure["ratio"] is None:
        return "no case"
    low, high = measure["ratio_95"]
    split = f"{measure['unresolved']:.3f} + {measure['induced']:.3f}"
    said = (
        f"\n<= {measure['limit']:g}: {VERDICTS[measure['verdict']]}" if "verdict" in measure else ""
    )
    return f"{_number(measure['ratio'])} {_ends(low, high)}\n{split}{said}"


def _ends(low: float, high: float | None) -> str:
    """An interval's ends in brackets."""
    return f"[{_number(low)}, {'no bound' if high is None else _number(high)}]"


def _number(value: float) -> str:
    """Three digits, and three decimals at most."""
    return f"{value:.3f}" if value < 1.0 else f"{value:.3g}" if value < 1e3 else f"{value:.0f}"


def _print_cases(measures: dict[str, Any], planner: str) -> None:
    cases = measures["near_collision"]["cases"] or []
    if cases:
        some = ", ".join(map(str, cases[:CASES_SHOWN]))
        more = f" and {len(cases) - CASES_SHOWN} more" if len(cases) > CASES_SHOWN else ""
        print(f"{planner}: near mid-air collisions in {some}{more}")
    for worst in measures["worst"][:WORST_SHOWN]:
        print(f"{planner}: see encounter {worst['number']} with {worst['replay']}")


def _print_layers(summary: dict[str, Any], planner: str) -> None:
    for row in summary["layers"]:
        ratio = row[planner]["lost_well_clear"]
        low, high = ratio["ratio_95"]
        told = "no case"
        if ratio["ratio"] is not None:
            told = f"{_number(ratio['ratio'])} {_ends(low, high)}"
        print(
            f"layer {row['layer']}: {100.0 * row['weight']:.1f} % of the weight, "
            f"{row['encounters']} encounters, {planner}'s loss of well clear {told}"
        )
