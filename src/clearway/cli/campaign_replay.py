"""One flight of a campaign once more: with logs and pictures, and checked against its row."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from clearway.cli.report import NOT_REACHED, leave, print_json, say

if TYPE_CHECKING:
    from clearway.studies.campaigns.file import Campaign
    from clearway.studies.campaigns.row import FlightRow


def replay_flight(asked: Campaign, key: str, folder: Path, as_json: bool) -> None:
    """Fly the flight of a key again; exit status 1 if it does not end as its row says."""
    from dataclasses import asdict

    from clearway.cli.flight_files import draw_pictures, write_flight
    from clearway.cli.fly import fly_with_bar
    from clearway.io.results_folder import ResultsFolder
    from clearway.studies.campaigns.run import RESULTS_FILE, choose_tasks
    from clearway.studies.campaigns.summary import describe_flight
    from clearway.studies.campaigns.task import Spent, case_of, make_flight_row, tasks_of
    from clearway.view.plot.style import Pictures

    task = choose_tasks(tasks_of(asked), key)[0]
    replayed = folder / "replays" / task.key.replace("/", "-")
    results = ResultsFolder.check(replayed, "campaign --replay", task.key)
    case = case_of(task)
    case.setup.refuse_impossible()
    run = fly_with_bar(case.setup, task.flown_by)
    row = make_flight_row(task, run, Spent(0.0, 0.0))
    before = _row_before(folder / RESULTS_FILE, task.key)
    other = _differences(before, row)
    if as_json:
        flight = asdict(row)
        print_json({"flight": flight, "compared": before is not None, "differs_in": other})
    else:
        print(f"{task.key} {describe_flight(row)}")
    write_flight(run, case.setup, case.file, results)
    draw_pictures(run, case.setup, case.file, results, Pictures())
    if before is None:
        say(f"no row of this flight in {folder / RESULTS_FILE} to hold it against")
    elif other:
        say(f"it does NOT end as its row says: {', '.join(other)}")
        leave(NOT_REACHED)
    else:
        say("it ends as its row says, to the last bit")


def _row_before(results: Path, key: str) -> FlightRow | None:
    from clearway.studies.campaigns.results import read_results

    if not results.exists():
        return None
    rows, _ = read_results(results)
    return next((row for row in rows if row.key == key), None)


def _differences(before: FlightRow | None, row: FlightRow) -> list[str]:
    """Columns in which a row differs from the one before, but for times of computing."""
    from clearway.studies.campaigns.row import without_timings

    if before is None:
        return []
    old, new = without_timings(before), without_timings(row)
    return [
        f"{name} {new[name]!r} instead of {old[name]!r}" for name in new if new[name] != old[name]
    ]
