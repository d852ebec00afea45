"""`clearway campaign`: families of cases x planners x seeds, on all cores or on a cluster."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli.numbers import MOST_WORKERS
from clearway.cli.progress import Beside, progress_bar
from clearway.cli.report import NOT_REACHED, NOT_SHOWN, leave, print_json, say

if TYPE_CHECKING:
    from clearway.studies.campaigns.engines import Engine
    from clearway.studies.campaigns.file import Campaign
    from clearway.studies.campaigns.row import FlightRow
    from clearway.studies.campaigns.run import CampaignProgress

ENGINES = ("processes", "dask")
RUN = "Run"
OUTPUT = "Output"


def campaign(
    file: Annotated[
        str | None,
        typer.Argument(help="A campaign by name ({campaigns}) or a campaign file (TOML)."),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=MOST_WORKERS,
            help="Processes side by side; default: one per core.",
            rich_help_panel=RUN,
        ),
    ] = None,
    engine: Annotated[
        str, typer.Option(help="processes of this machine, or dask.", rich_help_panel=RUN)
    ] = "processes",
    scheduler: Annotated[
        str | None,
        typer.Option(help="Address of a dask scheduler, tcp://host:8786.", rich_help_panel=RUN),
    ] = None,
    only: Annotated[
        str,
        typer.Option(
            help="Fly only flights with such a key, family/planner/seed; * stands for anything.",
            rich_help_panel=RUN,
        ),
    ] = "*",
    replay: Annotated[
        str | None,
        typer.Option(
            help="Fly this flight again, with pictures, and check that it ends in the same way.",
            rich_help_panel=RUN,
        ),
    ] = None,
    list_families: Annotated[
        bool, typer.Option("--families", help="List the families of cases.", rich_help_panel=RUN)
    ] = False,
    summary: Annotated[
        Path | None,
        typer.Option(help="Print the table of a results file again.", rich_help_panel=OUTPUT),
    ] = None,
    docs: Annotated[
        list[Path] | None,
        typer.Option(
            help="Put the tables between the marks of a Markdown page.", rich_help_panel=OUTPUT
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the results, where a campaign goes on; default "
            "clearway-out/campaign-<name>.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object.", rich_help_panel=OUTPUT)
    ] = False,
) -> None:
    """Fly families of cases with several planners, or resume a campaign.

    Exit status 0 if its first planner was safe throughout, 1 if not, 3 if families were skipped
    because their data are missing.
    """
    if list_families:
        _list(as_json)
        return
    if summary is not None:
        _print_again(summary, docs or [], as_json)
        return
    from clearway.base.errors import InputError
    from clearway.io.results_folder import ResultsFolder, refuse_unwritable_file
    from clearway.studies.campaigns.file import read_campaign
    from clearway.studies.campaigns.run import JOURNAL, RESULTS_FILE

    if file is None:
        raise InputError("campaign", "a name or a file is needed, or --summary or --families")
    asked = read_campaign(file)
    folder = out or Path("clearway-out") / f"campaign-{asked.file.name}"
    ResultsFolder.check(folder, "campaign", asked.file.name, own=(RESULTS_FILE, JOURNAL))
    for page in docs or []:
        refuse_unwritable_file(page, "--docs")
    if replay is not None:
        from clearway.cli.campaign_replay import replay_flight

        replay_flight(asked, replay, folder, as_json)
        return
    with ExitStack() as unwritten:
        flown = _fly_with_bar(unwritten, asked, folder, _engine(engine, scheduler, workers), only)
        for label, why in flown.skipped.items():
            say(f"skipped {label}: {why}")
        # Before the results are put in their place, which a full disk may refuse.
        more = {"flown_now": flown.flown_now, "results": str(folder / RESULTS_FILE)}
        _print(flown.rows, flown.settings, flown.absent, as_json, more)
    say(f"{flown.flown_now} flights flown, {len(flown.rows)} in {folder / RESULTS_FILE}")
    _put(docs or [], flown.rows, flown.settings, flown.absent)
    first = asked.file.planners[0]
    if any(not row.safe for row in flown.rows if row.planner == first):
        leave(NOT_REACHED)
    if flown.skipped:
        leave(NOT_SHOWN)


def _list(as_json: bool) -> None:
    from clearway.studies.campaigns.families import CAMPAIGN_FAMILIES

    if as_json:
        families = [
            {
                "name": name,
                "about": family.about,
                "parameters": list(family.parameters.model_fields),
            }
            for name, family in CAMPAIGN_FAMILIES.items()
        ]
        print_json({"families": families})
        return
    for name, family in CAMPAIGN_FAMILIES.items():
        print(f"{name:<12}{family.about}")
        for parameter in family.parameters.model_fields:
            print(f"{'':<14}{parameter}")


def _engine(name: str, scheduler: str | None, workers: int | None) -> Engine:
    from clearway.base.errors import InputError
    from clearway.base.suggest import did_you_mean
    from clearway.studies.campaigns.engines import make_process_engine, on_cluster

    if name not in ENGINES:
        near = did_you_mean(name, ENGINES)
        raise InputError("--engine", f"{name!r}{near}: there are {', '.join(ENGINES)}")
    if name == "processes":
        if scheduler is not None:
            raise InputError("--scheduler", "is for --engine dask")
        return make_process_engine(workers or os.cpu_count() or 1)
    if scheduler is None:
        raise InputError("--engine dask", "needs --scheduler with the address of one")
    if workers is not None:
        raise InputError("--workers", "a cluster has its own workers")
    return on_cluster(scheduler)


def _fly_with_bar(
    unwritten: ExitStack, asked: Campaign, folder: Path, engine: Engine, only: str
) -> CampaignProgress:
    """All flights, with a progress bar on standard error that counts what was flown before.

    unwritten: its end writes them.
    """
    from clearway.studies.campaigns.run import campaign_flown

    beside: tuple[Beside, ...] = ("count", "elapsed", "remaining", "status")
    with progress_bar(asked.file.name, beside=beside, status="getting ready") as bar:

        def watch(row: FlightRow | None, done: int, total: int) -> None:
            bar.show(done, total, f"{row.key}: {row.outcome}" if row else "")
            if row is None and done:
                say(f"{done} of {total} flights were flown before")

        return unwritten.enter_context(campaign_flown(asked, folder, engine, only, watch))


def _print_again(results: Path, docs: list[Path], as_json: bool) -> None:
    """The table of a results file: on standard output, and in pages."""
    import json

    from clearway.base.errors import InputError
    from clearway.studies.campaigns.results import read_results

    rows, settings = read_results(results)
    if docs and "campaign" not in settings:
        raise InputError(str(results), "does not name its campaign, which the pages need")
    skipped = json.loads(settings.get("skipped", "{}"))
    _print(rows, settings, skipped, as_json, {"results": str(results)})
    _put(docs, rows, settings, skipped)


def _print(
    rows: Sequence[FlightRow],
    settings: dict[str, str],
    skipped: dict[str, str],
    as_json: bool,
    more: dict[str, Any],
) -> None:
    from clearway.cli.campaign_table import print_campaign, summarize_campaign

    if as_json:
        print_json({**summarize_campaign(rows, settings, skipped), **more})
    else:
        print_campaign(rows, settings, skipped)


def _put(
    pages: Sequence[Path],
    rows: Sequence[FlightRow],
    settings: dict[str, str],
    skipped: dict[str, str],
) -> None:
    from clearway.studies.campaigns.pages import write_pages

    for page in pages:
        say(f"{page}: {', '.join(write_pages(page, rows, settings, skipped))} written")
