"""`clearway why`: why a recorded flight went wrong, and what clearway would have flown."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import picture_options as drawn
from clearway.cli.report import NOT_SHOWN, add_sources, leave, print_json, print_words, say

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.studies.why.explain import Explained
    from clearway.view.plot.style import Pictures


def why(
    log: Annotated[
        Path,
        typer.Argument(
            help="Log of a flight: run folder or run.mcap, bag of ROS 1 or 2, MCAP, ULog (.ulg), "
            "DataFlash (.bin).",
            metavar="LOG",
        ),
    ],
    mission: Annotated[
        Path | None,
        typer.Option(
            help="Mission with the vehicle, sensors, margin and map; default: the run's own, else "
            "an assumed multirotor."
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Folder of picture and result; default: none is written.")
    ] = None,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
) -> None:
    """Explain why a flight crashed: what was visible when, and what clearway would have flown."""
    from clearway.io.results_folder import ResultsFolder
    from clearway.studies.why.explain import explain_flight
    from clearway.studies.why.words import explain_as_json, explain_in_words, leaves_open

    pictures = drawn.pictures_of(form, dpi)
    folder = None if out is None else ResultsFolder.check(out, "why", log.stem)
    explained = explain_flight(log, mission, say)
    for note in (*explained.flight.notes, *explained.judge.notes):
        say(note)
    result = add_sources(explain_as_json(explained), [log] if mission is None else [log, mission])
    if as_json:
        print_json(result)
    else:
        print_words(explain_in_words(explained))
    if folder is not None:
        _write(explained, result, folder, pictures)
    if leaves_open(explained.answer):
        leave(NOT_SHOWN)


def _write(
    explained: Explained, result: dict[str, Any], folder: ResultsFolder, pictures: Pictures
) -> None:
    """The result and the picture; both or nothing."""
    import json

    from clearway.studies.figures.why import draw_why
    from clearway.view.plot.style import house_style

    with folder.write() as scratch:
        (scratch / "why.json").write_text(json.dumps(result, allow_nan=False) + "\n")
        with house_style():
            pictures.save(draw_why(explained), scratch, "why")
        written = sorted(path.name for path in scratch.iterdir())
    say(f"wrote {', '.join(written)} to {folder.path}")
