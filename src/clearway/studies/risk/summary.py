"""A risk study as one JSON object, and as a table with a row per encounter and planner."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from clearway.base.intervals import Interval
from clearway.base.provenance import provenance
from clearway.base.verdict import at_most
from clearway.io.json_values import finite
from clearway.studies.encounter_model import EncounterModel
from clearway.studies.risk.flight import STRAIGHT
from clearway.studies.risk.ratios import LIMITS, MEASURES, mean_aside_m, risk
from clearway.studies.risk.study import RiskStudy


def summary(result: RiskStudy, model: EncounterModel) -> dict[str, Any]:
    """The object that `risk --json` prints."""
    emergencies = {
        name: sum(outcome.emergencies[name] > 0 for outcome in result.outcomes)
        for name in result.planners
    }
    return {
        "model": Path(model.source).name,
        "kind": result.settings.in_words,
        "margin_m": result.settings.margin_m,
        "encounters": len(result.outcomes),
        "seed": result.seed,
        "straight": _measures(result, STRAIGHT),
        "planners": {
            name: _measures(result, name) | {"with_emergency": emergencies[name]}
            for name in result.planners
        },
        "provenance": provenance([model.source]),
    }


def _measures(result: RiskStudy, planner: str) -> dict[str, Any]:
    """Every measure of one planner, with its interval and its cases."""
    measures: dict[str, Any] = {}
    for name in MEASURES:
        found = risk(result, planner, name)
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
        if name in LIMITS and planner != STRAIGHT:
            shown = at_most(found.ratio.low, found.ratio.high, LIMITS[name])
            measures[name] |= {"limit": LIMITS[name], "verdict": str(shown)}
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
