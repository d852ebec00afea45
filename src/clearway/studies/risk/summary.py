"""A risk study as one JSON object, and as a table with a row per encounter and planner."""

from __future__ import annotations

import csv
import shlex
from pathlib import Path
from typing import Any

from clearway.base.intervals import Interval
from clearway.base.provenance import provenance, sha256_of
from clearway.base.verdict import DemandVerdict, at_most, worst_of
from clearway.io.json_values import finite
from clearway.studies.encounter_model import EncounterModel
from clearway.studies.risk.long_flight import surveillance_of
from clearway.studies.risk.nuisance import compute_nuisance
from clearway.studies.risk.ratios import (
    LARGEST_RATIOS,
    MEASURES,
    RiskLimits,
    by_layer,
    compute_risk,
    decision_ms,
    effective_number,
    mean_aside_m,
    mean_reversals,
    worst_cases,
)
from clearway.studies.risk.settings import STRAIGHT, RiskSettings
from clearway.studies.risk.study import RiskStudy

TOLD = {
    DemandVerdict.SHOWN: "pass",
    DemandVerdict.MISSED: "fail",
    DemandVerdict.NOT_SHOWN: "not shown",
}
"""Of the whole study, by the first planner."""
NOTHING_TOLD: dict[str, Any] = {
    **dict.fromkeys(("rate", "ratio", "unresolved", "induced")),
    **{f"{key}_95": [None, None] for key in ("rate", "ratio", "unresolved", "induced")},
    "cases": None,
    "induced_cases": None,
}
"""Of a planner that cannot know what there is to avoid."""


def summary(
    result: RiskStudy, model: EncounterModel, limits: RiskLimits | None = None
) -> dict[str, Any]:
    """The object that `risk --json` prints."""
    limits, made_by = limits or RiskLimits(), provenance([model.source])
    planners = {name: _measures(result, name, limits) for name in result.planners}
    emergencies = {
        name: sum(outcome.emergencies[name] > 0 for outcome in result.outcomes)
        for name in result.planners
    }
    return {
        "version": made_by["clearway"],
        "command": made_by["command"],
        "model": Path(model.source).name,
        "model_sha256": sha256_of(Path(model.source)),
        "kind": result.settings.in_words,
        "dynamics": result.settings.dynamics_in_words,
        "surveillance": result.settings.surveillance_in_words,
        "margin_m": result.settings.margin_m,
        **_at_real_scale(result.settings),
        "encounters": len(result.outcomes),
        "seed": result.seed,
        "limits": {name: limits.of(name) for name in LARGEST_RATIOS},
        "verdict": TOLD[verdict_of(planners[result.planners[0]])] if result.planners else None,
        "effective": {name: effective_number(result, name) for name in LARGEST_RATIOS},
        "straight": _measures(result, STRAIGHT, limits),
        "planners": {
            name: measures
            | {
                "hidden": result.describe_hidden(name),
                "with_emergency": emergencies[name],
                "decision_ms": finite(decision_ms(result, name)),
                "nuisance": _nuisance(result, name),
            }
            | _manners(result, name, model)
            for name, measures in planners.items()
        },
        "layers": _layers(result, model),
        "provenance": made_by,
    }


def verdict_of(measures: dict[str, Any]) -> DemandVerdict:
    """What is shown of a planner: the worst of all that is asked of it."""
    asked = (one for one in measures.values() if isinstance(one, dict) and "verdict" in one)
    return worst_of(DemandVerdict(one["verdict"]) for one in asked)


def _at_real_scale(settings: RiskSettings) -> dict[str, Any]:
    """Vehicle and range of surveillance, where it is flown in the true world."""
    if not settings.vehicle:
        return {}
    return {
        "vehicle": settings.vehicle,
        "range_m": surveillance_of(settings).range_m,
    }


def replay_command(result: RiskStudy, model: EncounterModel, planner: str, number: int) -> str:
    """The command line that flies one encounter again."""
    settings, words = result.settings, ["clearway", "risk"]
    if Path(model.source).is_file():
        words.append(model.source)
    for option, value, default in (
        ("--seed", result.seed, 0),
        ("--vehicle", settings.vehicle, ""),
        ("--surveillance", settings.surveillance, "ads-b"),
        ("--range-m", settings.range_m, None),
        ("--within-s", settings.within_s, 200.0 * settings.radius_nmi / 3.0),
        ("--reaction-s", settings.reaction_s, None),
        ("--floor-ft", settings.floor_ft, 50.0),
        ("--ceiling-ft", settings.ceiling_ft, 6000.0),
        *(() if settings.vehicle else _stretch(settings)),
    ):
        if value != default and (settings.vehicle or option != "--surveillance"):
            words += [option, f"{value:g}" if isinstance(value, float) else str(value)]
    if settings.layers:
        words += ["--layers", ",".join(str(layer + 1) for layer in settings.layers)]
    return shlex.join([*words, "--planners", planner, "--only", str(number)])


def _stretch(settings: RiskSettings) -> tuple[tuple[str, object, object], ...]:
    noise = f"{settings.position_std_m:g},{settings.velocity_std_mps:g}"
    return (
        ("--own-kt", settings.own_kt, 50.0),
        ("--noise", noise, "0,0"),
        ("--report-s", settings.report_s, 1.0),
        ("--stretch", settings.stretch, 4.0),
    )


def _manners(result: RiskStudy, planner: str, model: EncounterModel) -> dict[str, Any]:
    """Changes of mind, and the worst encounters with the commands that fly them again."""
    sides, senses = mean_reversals(result, planner)
    worst = [] if result.describe_hidden(planner) else worst_cases(result, planner)
    return {
        "side_reversals": finite(sides),
        "sense_reversals": finite(senses),
        "worst": [
            {"number": number, "replay": replay_command(result, model, planner, number)}
            for number in worst
        ],
    }


def _nuisance(result: RiskStudy, planner: str) -> dict[str, Any]:
    """Manoeuvres where straight flight keeps well clear, and detours."""
    found = compute_nuisance(result, planner)
    return {
        "of_clear": finite(found.of_clear.value),
        "of_clear_95": _interval(found.of_clear),
        "of_manoeuvres": finite(found.of_manoeuvres.value),
        "of_manoeuvres_95": _interval(found.of_manoeuvres),
        "extra_path_m": finite(found.extra_path_m),
        "extra_path_each_m": finite(found.extra_path_each_m),
    }


def _layers(result: RiskStudy, model: EncounterModel) -> list[dict[str, Any]]:
    """Ratios by the altitude layer that intruders begin in, with the share of the weight."""
    found = []
    edges = model.variables[model.index("L")].edges
    assert edges is not None, "readers refuse layers without altitudes"
    for layer, (share, part) in by_layer(result).items():
        row: dict[str, Any] = {
            "layer": layer + 1,
            "altitude_ft": [float(edges[layer]), float(edges[layer + 1])],
            "weight": share,
            "encounters": len(part.outcomes),
        }
        for planner in result.planners:
            if result.describe_hidden(planner):
                row[planner] = {
                    name: {"ratio": None, "ratio_95": [None, None]} for name in LARGEST_RATIOS
                }
                continue
            ratios = {name: compute_risk(part, planner, name).ratio for name in LARGEST_RATIOS}
            row[planner] = {
                name: {"ratio": finite(ratio.value), "ratio_95": _interval(ratio)}
                for name, ratio in ratios.items()
            }
        found.append(row)
    return found


def _measures(result: RiskStudy, planner: str, limits: RiskLimits) -> dict[str, Any]:
    """Every measure of one planner, with its interval and its cases."""
    measures: dict[str, Any] = {}
    for name in MEASURES:
        if result.describe_hidden(planner):
            measures[name] = dict(NOTHING_TOLD)
            continue
        found = compute_risk(result, planner, name)
        measures[name] = {
            "rate": finite(found.rate.value),
            "rate_95": _interval(found.rate),
            "ratio": finite(found.ratio.value),
            "ratio_95": _interval(found.ratio),
            "unresolved": finite(found.unresolved.value),
            "unresolved_95": _interval(found.unresolved),
            "induced": finite(found.induced.value),
            "induced_95": _interval(found.induced),
            "cases": list(found.cases),
            "induced_cases": list(found.induced_cases),
        }
        limit = limits.of(name)
        if limit is not None and planner != STRAIGHT:
            shown = at_most(found.ratio.low, found.ratio.high, limit)
            measures[name] |= {"limit": limit, "verdict": str(shown)}
    measures["mean_aside_m"] = mean_aside_m(result, planner)
    return measures


def _interval(estimate: Interval) -> list[float | None]:
    return [finite(estimate.low), finite(estimate.high)]


def write_encounters(result: RiskStudy, path: Path) -> None:
    """CSV: one row per encounter and planner."""
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(("number", "weight", "layer", "planner", *MEASURES, "nearest_m", "aside_m"))
        for each in result.outcomes:
            for planner in (STRAIGHT, *result.planners):
                came = each.of(planner)
                flags = (int(getattr(came, name)) for name in MEASURES)
                rows.writerow(
                    (each.number, f"{each.weight:.6g}", each.layer + 1, planner, *flags,
                     f"{came.nearest_m:.3f}", f"{came.aside_m:.3f}")
                )  # fmt: skip
