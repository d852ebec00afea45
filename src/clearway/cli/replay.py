"""`clearway replay`: a run in the browser, with a time slider, or as one page to keep."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import film_options as filmed
from clearway.cli.report import print_json, say

if TYPE_CHECKING:
    from clearway.view.replay.reading import Recording

PORT = 8137


def replay(
    run: Annotated[
        Path, typer.Argument(help="A run folder of `clearway fly`, or its run.mcap.", metavar="RUN")
    ],
    beside: Annotated[
        Path | None,
        typer.Option(
            help="Another run in the same world, of another planner or seed.", metavar="RUN"
        ),
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option(help="Write the page to this file instead of serving it."),
    ] = None,
    video: filmed.Video = None,
    fps: filmed.Fps = None,
    speed: filmed.Speed = None,
    layout: Annotated[
        Path | None,
        typer.Option(help="Write Foxglove's layout for run.mcap to this file, and no page."),
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port on 127.0.0.1; 0 takes any that is free.")
    ] = PORT,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """Show a run in 3-D in the browser: cells, reach set, plan and escape at every moment."""
    from clearway.io.foreign_errors import damage_told
    from clearway.io.results_folder import refuse_unwritable_file
    from clearway.view.replay.page import page_of
    from clearway.view.replay.reading import read_run

    film = filmed.film_asked(video, fps, speed)
    for option, file in (("--html", html), ("--layout", layout)):
        if file is not None:
            refuse_unwritable_file(file, option)
    if layout is not None and html is None:
        _lay_out(layout, as_json)
        return
    if layout is not None:
        _lay_out(layout, as_json=False)
    recording = read_run(run)
    if film is not None:
        filmed.make_film(recording, film)
        if html is None:
            if as_json:
                print_json(_describe(recording) | {"video": str(film.path)})
            return
    other = None if beside is None else read_run(beside)
    with damage_told(recording.source if other is None else f"{run} or {beside}", "run"):
        page = page_of(recording, other)
        result = _describe(recording) | {"page_bytes": len(page.encode())}
    if html is not None:
        _write(page, html)
        say(f"wrote {html}, {len(page.encode()) / 1e6:.2f} MB")
        if as_json:
            print_json(result | {"html": str(html)})
        return
    _serve(page, port, browser, result if as_json else None)


def _lay_out(path: Path, as_json: bool) -> None:
    from clearway.view.replay.foxglove_layout import foxglove_layout

    _write(foxglove_layout(), path)
    say(f"wrote {path}: in Foxglove, import it as a layout")
    if as_json:
        print_json({"layout": str(path)})


def _describe(recording: Recording) -> dict[str, Any]:
    return {
        "run": recording.source,
        "mission": recording.mission["name"],
        "time_s": recording.mission["summary"]["time_s"],
        "decisions": len(recording.decisions),
        "intruders": len(recording.mission["intruder_radius_m"]),
    }


def _write(text: str, path: Path) -> None:
    """The whole file or nothing."""
    from clearway.io.staging import stage_file

    with stage_file(path) as scratch:
        scratch.write_text(text, encoding="utf-8", newline="\n")


def _serve(page: str, port: int, browser: bool, result: dict[str, Any] | None) -> None:
    import webbrowser

    from clearway.view.replay.serving import serve_page

    def ready(address: str) -> None:
        if result is not None:
            print_json(result | {"url": address})
        say(f"{address}  (Ctrl-C ends it)")
        if browser and not webbrowser.open(address):
            say("no browser could be opened; open the address yourself")

    serve_page(page, port, ready)
