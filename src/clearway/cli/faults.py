"""`clearway faults`: what faults of sensors, reports and maps cost in safety, as curves."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import picture_options as drawn
from clearway.cli.numbers import MOST_COUNTED, MOST_WORKERS
from clearway.cli.progress import progress_bar
from clearway.cli.report import NOT_REACHED, add_sources, leave, print_json, say
from clearway.io.json_values import finite

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.studies.faults import Point
    from clearway.view.plot.style import Pictures

RUN = "Run"
OUTPUT = "Output"
FLIGHT = (
    *("fault", "variant", "level", "seed", "reached", "kept", "crashed", "nearest_m"),
    *("outcome", "escape_asked", "escape_mode"),
)
"""Columns of faults.csv."""


def faults(
    names: Annotated[
        list[str] | None, typer.Argument(help="Faults by name; default: all. --list lists them.")
    ] = None,
    list_all: Annotated[bool, typer.Option("--list", help="List the faults there are.")] = False,
    flights: Annotated[
        int,
        typer.Option(min=1, max=MOST_COUNTED, help="Worlds at each level.", rich_help_panel=RUN),
    ] = 40,
    seed: Annotated[int, typer.Option(min=0, help="Of the first world.", rich_help_panel=RUN)] = 0,
    escape: Annotated[
        str,
        typer.Option(
            help="What is known of escapes, as `[safety] escape`: strict, known or off.",
            rich_help_panel=RUN,
        ),
    ] = "strict",
    workers: Annotated[
        int | None,
        typer.Option(
            min=1, max=MOST_WORKERS, help="Processes; default: one per core.", rich_help_panel=RUN
        ),
    ] = None,
    missions: Annotated[
        bool,
        typer.Option(
            "--missions",
            help="Do not fly: write the missions of the first seed for `clearway fly`.",
            rich_help_panel=RUN,
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the picture and the table, or of the missions; default "
            "clearway-out/faults.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    docs: Annotated[
        Path | None,
        typer.Option(
            help="Put the table between the marks of a Markdown page, `<!-- faults-strict:begin "
            "-->` and `end` for `--escape strict`.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object.", rich_help_panel=OUTPUT)
    ] = False,
) -> None:
    """Fly worlds with growing faults: exit status 0 if no flight crashed or lost its margin."""
    from clearway.cli.faults_table import print_faults_table, put_table
    from clearway.io.results_folder import ResultsFolder, refuse_unwritable_file
    from clearway.studies.faults import STUDIES

    if list_all:
        _list(as_json)
        return
    pictures = drawn.pictures_of(form, dpi)
    wanted = _check_known(names or list(STUDIES))
    _refuse_other(escape)
    folder = out or Path("clearway-out") / "faults"
    if missions:
        results = ResultsFolder.check(folder, "faults", "", adds=True)
        _write_missions(wanted, seed, escape, results, as_json)
        return
    results = ResultsFolder.check(folder, "faults", "", adds=True)
    if docs is not None:
        refuse_unwritable_file(docs, "--docs")
    points = _fly_with_bar(
        wanted, range(seed, seed + flights), workers or os.cpu_count() or 1, escape
    )
    told = {"escape_asked": escape, "points": [_record(point) for point in points]}
    if as_json:
        print_json(told)
    else:
        print_faults_table(points)
    _write(points, told, results, pictures)
    if docs is not None:
        put_table(points, docs)
    say(f"wrote faults.{form}, faults.csv, faults.json to {folder}")
    if any(point.margin_kept < len(point.flights) for point in points):
        leave(NOT_REACHED)


def _check_known(names: list[str]) -> list[str]:
    from clearway.base.errors import InputError
    from clearway.base.suggest import did_you_mean
    from clearway.studies.faults import STUDIES

    problems = [
        f"{name!r} is no fault{did_you_mean(name, STUDIES)}; valid: {', '.join(STUDIES)}"
        for name in names
        if name not in STUDIES
    ]
    if problems:
        raise InputError("clearway faults", problems)
    return list(dict.fromkeys(names))


def _refuse_other(escape: str) -> None:
    from clearway.base.errors import InputError
    from clearway.base.suggest import did_you_mean
    from clearway.studies.faults import ESCAPES

    if escape not in ESCAPES:
        near = did_you_mean(escape, ESCAPES)
        raise InputError("--escape", f"{escape!r}{near}: there are {', '.join(ESCAPES)}")


def _list(as_json: bool) -> None:
    from clearway.studies.faults import STUDIES

    if as_json:
        listed = {
            name: {
                "title": study.title,
                "unit": study.unit,
                "levels": list(study.levels),
                "variants": list(study.variants),
            }
            for name, study in STUDIES.items()
        }
        print_json({"faults": listed})
        return
    for name, study in STUDIES.items():
        print(f"{name:<16} {study.title}; {', '.join(study.variants)}")


def _fly_with_bar(names: Sequence[str], seeds: range, workers: int, escape: str) -> list[Point]:
    from clearway.studies.faults import fly_studies

    with progress_bar("flights") as bar:
        return fly_studies(names, seeds, workers, bar.show, escape)


def _write_missions(
    names: Sequence[str], seed: int, escape: str, folder: ResultsFolder, as_json: bool
) -> None:
    """One mission file for each level and variant, which `clearway fly` flies."""
    from clearway.io.toml_writing import write_toml
    from clearway.studies.faults import STUDIES, case

    written = []
    with folder.write() as scratch:
        for name in names:
            study = STUDIES[name]
            for variant, make in study.variants.items():
                for level in study.levels:
                    file = make(case(study, seed, escape), level, seed)
                    words = variant.replace(" ", "-")
                    written.append(f"{name}-{level:g}-{words}-{seed}.toml")
                    write_toml(file.effective(), scratch / written[-1])
    if as_json:
        print_json({"missions": [str(folder.path / one) for one in written]})
    else:
        print("\n".join(str(folder.path / one) for one in written))


def _record(point: Point) -> dict[str, Any]:
    return {
        "fault": point.study,
        "variant": point.variant,
        "level": point.level,
        "escape_asked": point.escape_asked,
        "escape_mode": point.escape_mode,
        "flights": len(point.flights),
        "reached": point.reached,
        "kept": point.kept,
        "kept_wilson_95": list(point.interval(point.kept)),
        "not_reached": point.not_reached,
        "margin_lost": point.margin_lost,
        "crashed": point.crashed,
        "crashed_wilson_95": list(point.interval(point.crashed)),
        "margin_kept": point.margin_kept,
        "margin_kept_wilson_95": list(point.interval(point.margin_kept)),
        "nearest_m": finite(point.nearest_m),
        "not_kept": [flight.seed for flight in point.flights if not flight.kept],
        "unsafe": [flight.seed for flight in point.flights if not flight.margin_kept],
    }


def _write(
    points: Sequence[Point], told: dict[str, Any], folder: ResultsFolder, pictures: Pictures
) -> None:
    import json

    from clearway.cli.faults_table import panels_of, title_of
    from clearway.studies.figures.faults import draw_faults
    from clearway.view.plot.style import house_style

    with folder.write() as scratch:
        with house_style():
            pictures.save(draw_faults(panels_of(points), title_of(points)), scratch, "faults")
        (scratch / "faults.json").write_text(json.dumps(add_sources(told), indent=2) + "\n")
        _write_flights(points, scratch / "faults.csv")


def _write_flights(points: Sequence[Point], path: Path) -> None:
    """One line a flight."""
    import csv

    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(FLIGHT)
        for point in points:
            for flight in point.flights:
                writer.writerow(
                    (
                        point.study,
                        point.variant,
                        f"{point.level:g}",
                        flight.seed,
                        int(flight.reached),
                        int(flight.kept),
                        int(flight.crashed),
                        f"{flight.nearest_m:.4f}",
                        flight.outcome,
                        point.escape_asked,
                        flight.escape_mode,
                    )
                )
