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
from clearway.cli.report import NOT_REACHED, leave, print_json, say, sourced, table_console
from clearway.io.json_values import finite

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.studies.faults import Point
    from clearway.studies.figures.faults import Panel
    from clearway.view.plot.style import Pictures

RUN, OUTPUT = "Run", "Output"


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
            help="Put the table between the marks of a Markdown page.", rich_help_panel=OUTPUT
        ),
    ] = None,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object.", rich_help_panel=OUTPUT)
    ] = False,
) -> None:
    """Fly worlds with growing faults, and show how many flights keep their margin."""
    from clearway.io.results_folder import ResultsFolder, refuse_unwritable_file
    from clearway.studies.faults import STUDIES

    if list_all:
        _list(as_json)
        return
    pictures = drawn.pictures_of(form, dpi)
    wanted = _known(names or list(STUDIES))
    folder = out or Path("clearway-out") / "faults"
    if missions:
        results = ResultsFolder.checked(folder, "faults", "", adds=True)
        _write_missions(wanted, seed, results, as_json)
        return
    results = ResultsFolder.checked(folder, "faults", "", adds=True)
    if docs is not None:
        refuse_unwritable_file(docs, "--docs")
    points = _flown(wanted, range(seed, seed + flights), workers or os.cpu_count() or 1)
    if as_json:
        print_json({"points": [_record(point) for point in points]})
    else:
        _print_table(points)
    _write(points, results, pictures)
    if docs is not None:
        _put(points, docs)
    say(f"wrote faults.{form}, faults.csv, faults.json to {folder}")
    if any(point.kept < len(point.flights) for point in points):
        leave(NOT_REACHED)


def _known(names: list[str]) -> list[str]:
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


def _flown(names: Sequence[str], seeds: range, workers: int) -> list[Point]:
    from clearway.studies.faults import fly_studies

    with progress_bar("flights") as bar:
        return fly_studies(names, seeds, workers, bar.show)


def _write_missions(names: Sequence[str], seed: int, folder: ResultsFolder, as_json: bool) -> None:
    """One mission file for each level and variant, which `clearway fly` flies."""
    from clearway.io.toml_writing import write_toml
    from clearway.studies.faults import STUDIES, case

    written = []
    with folder.written() as scratch:
        for name in names:
            study = STUDIES[name]
            for variant, make in study.variants.items():
                for level in study.levels:
                    file = make(case(study, seed), level, seed)
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
        "flights": len(point.flights),
        "reached": point.reached,
        "kept": point.kept,
        "kept_wilson_95": list(point.interval(point.kept)),
        "crashed": point.crashed,
        "crashed_wilson_95": list(point.interval(point.crashed)),
        "nearest_m": finite(point.nearest_m),
        "not_kept": [flight.seed for flight in point.flights if not flight.kept],
    }


def _write(points: Sequence[Point], folder: ResultsFolder, pictures: Pictures) -> None:
    import csv
    import json

    from clearway.studies.figures.faults import draw_faults
    from clearway.view.plot.style import house_style

    with folder.written() as scratch:
        with house_style():
            pictures.save(draw_faults(_panels(points)), scratch, "faults")
        told = sourced({"points": [_record(point) for point in points]})
        (scratch / "faults.json").write_text(json.dumps(told, indent=2) + "\n")
        with (scratch / "faults.csv").open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(
                ("fault", "variant", "level", "seed", "reached", "kept", "crashed", "nearest_m")
            )
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
                        )
                    )


def _panels(points: Sequence[Point]) -> list[Panel]:
    from clearway.studies.faults import STUDIES
    from clearway.studies.figures.faults import Curve, Panel

    panels = []
    for name in dict.fromkeys(point.study for point in points):
        curves = []
        for variant in STUDIES[name].variants:
            mine = [p for p in points if (p.study, p.variant) == (name, variant)]
            curves.append(
                Curve(
                    variant,
                    [p.kept for p in mine],
                    [p.crashed for p in mine],
                    [len(p.flights) for p in mine],
                )
            )
        study = STUDIES[name]
        panels.append(Panel(study.title, study.unit, study.levels, curves))
    return panels


def _rows(points: Sequence[Point]) -> list[tuple[str, str, str, str]]:
    """Fault, variant, and a cell for each level: kept, and crashed where any did."""
    from clearway.studies.faults import STUDIES

    rows = []
    for name in dict.fromkeys(point.study for point in points):
        for variant in STUDIES[name].variants:
            mine = [p for p in points if (p.study, p.variant) == (name, variant)]
            cells = [
                f"{p.level:g}: {p.kept}" + (f", {p.crashed} crashed" if p.crashed else "")
                for p in mine
            ]
            rows.append((STUDIES[name].title, STUDIES[name].unit, variant, "; ".join(cells)))
    return rows


def _put(points: Sequence[Point], page: Path) -> None:
    from clearway.io.marked_page import put_between_marks

    flights = len(points[0].flights)
    lines = [f"Of {flights} flights at each level, so many reached their goal with margin:", ""]
    lines += ["| fault | unit | with | level: kept |", "| --- | --- | --- | --- |"]
    lines += [f"| {' | '.join(row)} |" for row in _rows(points)]
    put_between_marks(page, "faults", "\n".join(lines))


def _print_table(points: Sequence[Point]) -> None:
    from rich.table import Table

    console = table_console()
    flights = len(points[0].flights)
    table = Table(title=f"flights that reached their goal with margin, of {flights}")
    for column in ("fault", "unit", "with", "level: kept"):
        table.add_column(column)
    for row in _rows(points):
        table.add_row(*row)
    console.print(table)
