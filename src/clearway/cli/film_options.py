"""The options of commands that make films, and what they do with them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from clearway.cli.progress import progress_bar
from clearway.cli.report import say

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.view.film.writing import FilmAsked
    from clearway.view.replay.reading import Recording

PANEL = "Film"
OF_VEHICLE = "the vehicle's speed is vehicle.speed_mps of the mission"
Video = Annotated[
    Path | None,
    typer.Option(help="Film of the flight, .mp4 (by ffmpeg) or .gif.", rich_help_panel=PANEL),
]
Fps = Annotated[
    int | None,
    typer.Option(help="Frames per second; default: 15, or 10 for a GIF.", rich_help_panel=PANEL),
]
Speed = Annotated[
    float | None,
    typer.Option(
        help="Seconds of flight per second of film; default: so that it lasts 20 s, but never "
        "slower than flown.",
        rich_help_panel=PANEL,
    ),
]


def film_asked(video: Path | None, fps: int | None, speed: float | None) -> FilmAsked | None:
    """The film that is wanted, looked at before any work; raises ClearwayError."""
    from clearway.base.errors import InputError
    from clearway.io.results_folder import refuse_unwritable_file
    from clearway.view.film.writing import FilmAsked

    if video is None:
        if fps is not None or speed is not None:
            if fps is not None:
                raise InputError("--fps", "is for --video FILE")
            raise InputError("--speed", f"is for --video FILE; {OF_VEHICLE}")
        return None
    refuse_unwritable_file(video, "--video")
    return FilmAsked.check(video, fps, speed)


def make_film(recording: Recording, asked: FilmAsked, results: ResultsFolder | None = None) -> None:
    """Draw it with a progress bar, and say where it is.

    results: the folder of the run, whose list has the film where it lies there too.
    """
    from clearway.io.staging import stage_folder
    from clearway.view.film.writing import write_film

    parent = asked.path.absolute().parent
    if results is not None and results.path.absolute() == parent:
        into = results.taking_more().write()
    else:
        into = stage_folder(parent)
    with into as scratch, progress_bar(asked.path.name, beside=("count", "remaining")) as bar:
        speed = write_film(recording, asked, scratch, bar.show)
    if asked.speed is not None and speed > asked.speed:
        say(f"{asked.path}: {speed:.3g} times as fast as flown, more than asked for: its frames "
            f"would have been over {asked.kind.most}")  # fmt: skip
    size = asked.path.stat().st_size / 1e6
    say(f"wrote {asked.path}, {size:.1f} MB, {speed:.3g} times as fast as flown")
