"""The same study over every encounter model of a folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clearway.base.errors import InputError, naming
from clearway.io.json_values import finite
from clearway.studies.encounter_model import EncounterModel, read_encounter_model
from clearway.studies.risk.fit import fit_height
from clearway.studies.risk.ratios import LARGEST_RATIOS, RiskLimits
from clearway.studies.risk.settings import RiskSettings
from clearway.studies.risk.study import RiskStudy, study
from clearway.studies.risk.summary import summary

MODEL_SUFFIX = ".txt"
JOURNAL_SUFFIX = ".jsonl"


@dataclass(frozen=True)
class ModelStudy:
    """What one model of a folder came to."""

    name: str
    model: EncounterModel
    result: RiskStudy
    summary: dict[str, Any]
    """As `clearway risk --json` prints it."""


def read_models(folder: Path) -> list[EncounterModel]:
    """Read all models of a folder by name; raises InputError without any, or for a damaged one."""
    with naming(folder, "read"):
        files = sorted(one for one in folder.iterdir() if one.suffix == MODEL_SUFFIX)
    if not files:
        raise InputError(str(folder), f"holds no encounter models (*{MODEL_SUFFIX})")
    return [read_encounter_model(one) for one in files]


def study_models(
    models: Sequence[EncounterModel],
    planners: Sequence[str],
    numbers: Sequence[int],
    settings: RiskSettings,
    seed: int = 0,
    *,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
    journals: Path | None = None,
    limits: RiskLimits | None = None,
) -> list[ModelStudy]:
    """Fly the encounters of every model.

    journals: folder of a journal for each model, from which an interrupted study goes on.
    """
    if journals is not None:
        with naming(journals, "written"):
            journals.mkdir(parents=True, exist_ok=True)
    found = []
    for model in models:
        name = Path(model.source).stem
        journal = None if journals is None else journals / f"{name}{JOURNAL_SUFFIX}"
        fitted = fit_height(settings, model)
        result = study(model, planners, numbers, fitted, seed, workers, progress, journal)
        found.append(ModelStudy(name, model, result, summary(result, model, limits)))
    return found


def summarize_models(studies: Sequence[ModelStudy]) -> dict[str, Any]:
    """Return one JSON object for all models, with the largest upper end of each ratio."""
    first = studies[0].summary
    return {
        **{key: first[key] for key in ("version", "command", "kind", "limits", "seed")},
        "largest_upper_ends": {
            planner: {name: _largest(studies, planner, name) for name in LARGEST_RATIOS}
            for planner in studies[0].result.planners
        },
        "models": {one.name: one.summary for one in studies},
    }


def _largest(studies: Sequence[ModelStudy], planner: str, measure: str) -> float | None:
    """Return the largest upper end over models; None where one has no bound."""
    ends = [one.summary["planners"][planner][measure]["ratio_95"][1] for one in studies]
    return None if any(end is None for end in ends) else finite(max(ends))
