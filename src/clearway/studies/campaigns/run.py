"""A campaign from its file to results.parquet, in as many sittings as it takes."""

from __future__ import annotations

import fnmatch
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from clearway.base.errors import InputError
from clearway.base.provenance import provenance
from clearway.base.suggest import did_you_mean
from clearway.base.version import __version__
from clearway.studies.campaigns.engines import Engine
from clearway.studies.campaigns.families import AbsentDataError
from clearway.studies.campaigns.file import Campaign
from clearway.studies.campaigns.journal import check_settings, open_journal
from clearway.studies.campaigns.results import need_parquet, read_results, write_results
from clearway.studies.campaigns.row import FlightRow
from clearway.studies.campaigns.task import Task, case_of, tasks_of

RESULTS_FILE = "results.parquet"
JOURNAL = "journal.jsonl"
Watch = Callable[[FlightRow | None, int, int], None]
"""Called with each row, how many are done and how many there are; first without a row."""


@dataclass(frozen=True, slots=True)
class CampaignProgress:
    """What has been flown of a campaign, now and before."""

    rows: tuple[FlightRow, ...]
    """In the order of the campaign's tasks."""
    flown_now: int
    skipped: dict[str, str]
    """Why, by label, of what was asked for."""
    absent: dict[str, str]
    """Why, by label, of all families whose data are not there."""
    settings: dict[str, str]
    """What all rows have in common."""


def run_campaign(
    campaign: Campaign, folder: Path, engine: Engine, only: str = "*", watch: Watch | None = None
) -> CampaignProgress:
    """Fly what is not yet flown, and write results.parquet into the folder, as `campaign_flown`."""
    with campaign_flown(campaign, folder, engine, only, watch) as flown:
        return flown


@contextmanager
def campaign_flown(
    campaign: Campaign, folder: Path, engine: Engine, only: str = "*", watch: Watch | None = None
) -> Iterator[CampaignProgress]:
    """Fly what is not yet flown; results.parquet is written when the block ends without an error.

    Until then a journal in the folder has every flight, and the same call goes on from there.

    only: pattern of keys, to fly some of it. Flights of earlier sittings stay.
    Raises InputError where the folder holds flights of other settings or cannot be written, or no
    key fits the pattern; ClearwayError where workers are lost.
    """
    need_parquet()
    tasks = tasks_of(campaign)
    skipped = absent(tasks)
    wanted = [task for task in choose_tasks(tasks, only) if task.label not in skipped]
    settings = {"campaign": campaign.file.name, "version": __version__}
    results = folder / RESULTS_FILE
    with open_journal(folder / JOURNAL, settings, FlightRow) as journal:
        rows = _before(results, settings) | {row.key: row for row in journal.rows}
        _check_cases(str(folder), rows.values(), tasks)
        left = [task for task in wanted if task.key not in rows]
        if watch is not None:
            watch(None, len(wanted) - len(left), len(wanted))
        for number, row in enumerate(engine(left) if left else (), start=1):
            journal.append(row)
            rows[row.key] = row
            if watch is not None:
                watch(row, len(wanted) - len(left) + number, len(wanted))
        ordered = tuple(by_family(rows.values(), tasks))
        asked_for = {task.label for task in choose_tasks(tasks, only)}
        told = {label: why for label, why in skipped.items() if label in asked_for}
        yield CampaignProgress(ordered, len(left), told, skipped, settings)
        write_results(
            results,
            ordered,
            {**settings, "skipped": json.dumps(skipped), "provenance": json.dumps(provenance())},
        )
        (folder / JOURNAL).unlink()


def choose_tasks(tasks: Sequence[Task], only: str) -> list[Task]:
    """Tasks whose key fits a pattern; raises InputError where none does."""
    found = [task for task in tasks if fnmatch.fnmatchcase(task.key, only)]
    if not found:
        label, labels = only.split("/", 1)[0], dict.fromkeys(task.label for task in tasks)
        near = "" if label in labels else did_you_mean(label, labels)
        examples = ", ".join(task.key for task in tasks[:3])
        what = f"no flight {only!r}{near}; there are {len(tasks)}: {examples}, ..."
        raise InputError("campaign", what)
    return found


def by_family(rows: Iterable[FlightRow], tasks: Sequence[Task]) -> list[FlightRow]:
    """In the order of tables: families and planners as in the campaign, then seeds.

    Flights that the campaign no longer asks for come last in theirs.
    """
    rows = list(rows)
    labels = dict.fromkeys([*(task.label for task in tasks), *(row.label for row in rows)])
    planners = dict.fromkeys([*(task.planner for task in tasks), *(row.planner for row in rows)])
    places = [{name: at for at, name in enumerate(names)} for names in (labels, planners)]
    return sorted(rows, key=lambda row: (places[0][row.label], places[1][row.planner], row.seed))


def absent(tasks: Sequence[Task]) -> dict[str, str]:
    """Labels of families whose data are not there, each with what is missing."""
    reasons = {}
    for task in {task.label: task for task in reversed(tasks)}.values():
        try:
            case_of(task)
        except AbsentDataError as error:
            reasons[task.label] = str(error)
    return dict(sorted(reasons.items()))


def _check_cases(source: str, rows: Iterable[FlightRow], tasks: Sequence[Task]) -> None:
    """Raise InputError where a family's cases are others than those flown before.

    More seeds, planners and families are no other settings: what is flown stays as it is. Of one
    family, variants of planners have settings of their own.
    """
    asked: dict[str, set[str]] = {}
    for task in tasks:
        asked.setdefault(task.label, set()).add(task.settings_id)
    own = {(task.label, task.planner): {task.settings_id} for task in tasks}
    changed = sorted(
        {
            row.label
            for row in rows
            if row.label in asked
            and row.settings_id not in own.get((row.label, row.planner), asked[row.label])
        }
    )
    if changed:
        raise InputError(
            source,
            f"holds flights of other settings of {', '.join(changed)}: give a label of its own "
            "to what is new, choose another --out, or remove it",
        )


def _before(results: Path, settings: dict[str, str]) -> dict[str, FlightRow]:
    """Rows of earlier sittings by key."""
    if not results.exists():
        return {}
    rows, found = read_results(results)
    check_settings(str(results), found, settings)
    return {row.key: row for row in rows}
