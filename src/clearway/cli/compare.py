"""`clearway compare`: all planners on one mission, in one table."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import picture_options as drawn
from clearway.cli.given import split_names
from clearway.cli.numbers import MOST_COUNTED
from clearway.cli.progress import progress_bar
from clearway.cli.report import NOT_REACHED, folder_of_file, leave, print_json, say
from clearway.cli.tables import plain_table, print_table

AVOIDING = ("safe", "crashed", "min_distance_m", "margin_violations", "emergencies")
"""What is stated of avoiding: nothing of a planner that cannot know what there is to avoid."""

if TYPE_CHECKING:
    from collections.abc import Sequence

    from clearway.io.results_folder import ResultsFolder
    from clearway.missions.setup import FlightSetup
    from clearway.sim import Run
    from clearway.studies.comparison import ComparedFlight, PlannerStanding, SetupOf
    from clearway.view.plot.style import Pictures


def compare(
    mission: Annotated[
        str,
        typer.Argument(
            help="A mission by name, a mission file (TOML), or a family of made-up worlds "
            "(forest), in which every seed is another world."
        ),
    ],
    planners: Annotated[
        str | None,
        typer.Option(
            help="Names with commas between, of {planners}; default: all that come with clearway."
        ),
    ] = None,
    seeds: Annotated[
        int, typer.Option(min=1, max=MOST_COUNTED, help="Flights of each planner.")
    ] = 1,
    first_seed: Annotated[int, typer.Option(min=0, help="Seed of the first flight.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the results; default clearway-out/compare-<mission>."),
    ] = None,
    plots: Annotated[bool, typer.Option("--plots/--no-plots", help="Draw pictures.")] = True,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """Fly several planners: exit status 0 if the first of them was safe in every flight."""
    from clearway.io.results_folder import ResultsFolder
    from clearway.studies.comparison import sum_up_planner

    beside, pictures = folder_of_file(mission), drawn.pictures_of(form, dpi)
    names = _names(planners, beside)
    folder = ResultsFolder.check(
        out or Path("clearway-out") / f"compare-{_file_name(mission)}", "compare", mission
    )
    setup_of = _setups(mission)
    flown = _fly_with_bar(mission, setup_of, names, range(first_seed, first_seed + seeds), beside)
    standings = [sum_up_planner([each for each in flown if each.planner == name]) for name in names]
    result = _result(mission, standings, flown)
    if as_json:
        print_json(result)
    else:
        _print_table(mission, standings)
    with folder.write() as scratch:
        (scratch / "comparison.json").write_text(json.dumps(result, indent=2) + "\n")
    say(f"wrote comparison.json to {folder.path}")
    if plots:
        _draw(flown, setup_of(first_seed), folder, pictures)
    if standings[0].safe < standings[0].flights:
        leave(NOT_REACHED)


def _names(planners: str | None, beside: Path | None) -> list[str]:
    """Planners asked for, each once; raises ClearwayError for a name that does not exist."""
    from clearway.sim.baselines import PLANNERS, check_planner_name

    if planners is None:
        return list(PLANNERS)
    return list(dict.fromkeys(check_planner_name(name, beside) for name in split_names(planners)))


def _setups(mission: str) -> SetupOf:
    """The flight of a seed: another world of a family, or other noise in the same mission."""
    from functools import cache

    from clearway.missions.setup import prepare
    from clearway.missions.world_file import read_mission
    from clearway.sim.worlds import WORLD_FAMILIES

    made = mission in WORLD_FAMILIES
    file = read_mission(f"{mission}:0" if made else mission)
    say("preparing reach sets and sensors")

    @cache
    def setup(seed: int) -> FlightSetup:
        if made:
            return prepare(read_mission(f"{mission}:{seed}"), say)
        return prepare(file.with_values("simulation", seed=seed), say)

    return setup


def _fly_with_bar(
    mission: str,
    setup_of: SetupOf,
    names: Sequence[str],
    seeds: Sequence[int],
    beside: Path | None,
) -> list[ComparedFlight]:
    """All flights, with a progress bar."""
    from clearway.studies.comparison import fly_all

    first = setup_of(seeds[0])
    first.refuse_impossible()
    for doubt in first.doubts:
        say(doubt)
    if "clearway" in names:
        say(str(first.escape))
    flown: list[ComparedFlight] = []
    with progress_bar(
        mission, len(names) * len(seeds), beside=("count", "status"), status=names[0]
    ) as bar:
        for flight in fly_all(setup_of, names, seeds, beside):
            flown.append(flight)
            bar.show(len(flown), status=names[len(flown) % len(names)])
    return flown


def _result(
    mission: str, standings: Sequence[PlannerStanding], flown: Sequence[ComparedFlight]
) -> dict[str, Any]:
    """The object that `--json` prints: planners in order, each with its flights."""
    from dataclasses import asdict

    from clearway.base.provenance import provenance
    from clearway.base.version import SCHEMA_VERSION
    from clearway.io.json_values import round_number

    rows: list[dict[str, Any]] = []
    for row in standings:
        values = {
            key: round_number(value) if isinstance(value, float) else value
            for key, value in asdict(row).items()
        }
        if row.hidden:
            values |= dict.fromkeys(AVOIDING)
        runs = [flight.run for flight in flown if flight.planner == row.planner]
        rows.append({**values, "runs": [run.summary() for run in runs]})
    seeds = list(dict.fromkeys(flight.run.seed for flight in flown))
    made = provenance([mission])
    return {
        "schema_version": SCHEMA_VERSION,
        "mission": mission,
        "seeds": seeds,
        "planners": rows,
        "provenance": made,
    }


def _draw(
    flown: Sequence[ComparedFlight], setup: FlightSetup, folder: ResultsFolder, pictures: Pictures
) -> None:
    """The picture of the first seed's flights, once the results are there."""
    from clearway.studies.figures.comparison import draw_tracks
    from clearway.view.plot.style import house_style

    first = flown[0].run.seed
    runs: dict[str, Run[Any]] = {f.planner: f.run for f in flown if f.run.seed == first}
    title = f"{flown[0].run.mission.name}: all planners, seed {first}"
    with folder.taking_more().write() as scratch, house_style():
        drawn = pictures.save(draw_tracks(runs, setup.world, title), scratch, "tracks")
    say(f"wrote {drawn} to {folder.path}")


def _print_table(mission: str, standings: Sequence[PlannerStanding]) -> None:
    from clearway.base.own_code import shorten_own_name
    from clearway.sim.baselines import NOT_APPLICABLE
    from clearway.sim.baselines.notes import list_shared_notes, not_known

    columns = ("reached", "safe", "crashed", "time s", "path m", "nearest m", "violations")
    table = plain_table(("planner",), (*columns, "p50 ms", "p99 ms"), mission)
    for row in standings:
        cells = {
            "reached": f"{row.reached}/{row.flights}",
            "safe": f"{row.safe}/{row.flights}",
            "crashed": f"{row.crashed}/{row.flights}",
            "time_s": _text(row.time_s, 1),
            "path_length_m": _text(row.path_length_m, 1),
            "min_distance_m": _text(row.min_distance_m, 2),
            "margin_violations": str(row.margin_violations),
            "decision_ms_p50": _text(row.decision_ms_p50, 2),
            "decision_ms_p99": _text(row.decision_ms_p99, 2),
        }
        if row.hidden:
            cells |= {name: NOT_APPLICABLE for name in AVOIDING if name in cells}
        table.add_row(shorten_own_name(row.planner), *cells.values())
    print_table(table)
    for line in not_known((row.planner, row.hidden) for row in standings):
        print(line)
    for line in list_shared_notes([row.planner for row in standings]):
        print(line)


def _text(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if abs(value) < float("inf") else "-"


def _file_name(mission: str) -> str:
    return Path(mission).stem.replace(":", "-")
