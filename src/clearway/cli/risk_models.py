"""`clearway risk --models`: one study over every encounter model of a folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from clearway.cli.progress import progress_bar
from clearway.cli.report import add_sources, leave_by, print_json, say
from clearway.cli.risk_given import check_layers
from clearway.cli.tables import plain_table, print_table

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.studies.risk.many import ModelStudy
    from clearway.studies.risk.ratios import RiskLimits
    from clearway.studies.risk.settings import RiskSettings


class ModelWatch(NamedTuple):
    """Where the studies of many models go."""

    pages: Sequence[Path]
    journals: Path | None
    """Folder of a journal for each model."""
    folder: ResultsFolder | None
    as_json: bool


def fly_models(
    models: Path,
    planners: Sequence[str],
    numbers: Sequence[int],
    settings: RiskSettings,
    seed: int,
    workers: int,
    limits: RiskLimits,
    watch: ModelWatch,
) -> None:
    """Fly all models of a folder, print a row for each, and end with the worst verdict."""
    from clearway.base.verdict import worst_of
    from clearway.io.results_folder import refuse_unwritable_file
    from clearway.studies.risk.many import read_models, study_models, summarize_models
    from clearway.studies.risk.model_tables import write_model_tables
    from clearway.studies.risk.summary import verdict_of

    for page in watch.pages:
        refuse_unwritable_file(page, "--docs")
    networks = read_models(models)
    for network in networks:
        check_layers(network, settings)
    with progress_bar("encounters", len(networks) * len(numbers)) as bar:
        studies = study_models(
            networks, planners, numbers, settings, seed, workers=workers,
            progress=bar.advance, journals=watch.journals, limits=limits,
        )  # fmt: skip
    told = summarize_models(studies)
    if watch.as_json:
        print_json(told)
    else:
        _print(studies)
    if watch.folder is not None:
        _write(studies, watch.folder)
    for page in watch.pages:
        say(f"{page}: {', '.join(write_model_tables(page, studies))} written")
    leave_by([worst_of(verdict_of(one.summary["planners"][planners[0]]) for one in studies)])


def _print(studies: Sequence[ModelStudy]) -> None:
    from clearway.studies.risk.model_tables import model_rows, planner_rows

    kind = studies[0].summary["kind"]
    for title, rows in (
        (f"{studies[0].result.planners[0]}: {kind}, with 95 % intervals", model_rows(studies)),
        ("by planner", planner_rows(studies)),
    ):
        table = plain_table(rows[0], (), title)
        for row in rows[1:]:
            table.add_row(*row)
        print_table(table)


def _write(studies: Sequence[ModelStudy], folder: ResultsFolder) -> None:
    """Write every encounter, and one JSON file for all models."""
    import json

    from clearway.studies.risk.many import summarize_models
    from clearway.studies.risk.summary import write_encounters

    with folder.write() as scratch:
        for one in studies:
            write_encounters(one.result, scratch / f"{one.name}.csv")
        told = add_sources(summarize_models(studies))
        (scratch / "risk.json").write_text(json.dumps(told, indent=2, allow_nan=False) + "\n")
    say(f"wrote {len(studies)} tables of encounters, risk.json to {folder.path}")
