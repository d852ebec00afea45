"""`clearway alerts`: a recording looked at through volumes, as one of its aircraft would."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from clearway.cli import picture_options as drawn
from clearway.cli.report import add_sources, print_json, print_words, say

MOST_LINES = 20
"""Of what is not judged."""

if TYPE_CHECKING:
    from clearway.missions.alert_history import AlertHistory
    from clearway.traffic.recorded.report import Clock


def alerts(
    file: Annotated[Path, typer.Argument(help="Recording: {traffic}; gzip too.")],
    own: Annotated[
        str | None,
        typer.Option(
            help="Address or callsign of the own aircraft; default: the one that the recording "
            "names as its own."
        ),
    ] = None,
    volumes: Annotated[
        str,
        typer.Option(help="{volumes}, or a .toml file with tables [\\[volume]]."),
    ] = "f3442",
    vehicle: Annotated[
        str, typer.Option(help="Its performance, which the bands need: {vehicles}.")
    ] = "wing",
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object, with the bands of every second.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Folder for alerts.json and the picture.")
    ] = None,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
) -> None:
    """Give alerts about other aircraft, and bands of heading, climb and speed, each second.

    Aircraft that could not be judged are counted and named, with the reason.
    """
    from clearway.io.traffic.traffic import read_traffic
    from clearway.missions.alert_history import judge_recording
    from clearway.missions.volume_section import volumes_named
    from clearway.vehicle.performance import PERFORMANCES

    pictures, folder = drawn.pictures_of(form, dpi), None
    if out is not None:
        from clearway.io.results_folder import ResultsFolder

        folder = ResultsFolder.check(out, "alerts", file.name)
    kept, able = volumes_named(volumes), PERFORMANCES.find(vehicle)
    recording = read_traffic(file)
    history = judge_recording(recording, own, kept, able)
    told = add_sources(history.as_dict() | {"vehicle": vehicle}, [file])
    if as_json:
        print_json(told)
    else:
        print_words("\n".join(_lines(history, recording.clock)))
    if folder is not None:
        from clearway.view.plot.alerts import draw_alerts
        from clearway.view.plot.style import house_style

        with folder.write() as scratch:
            (scratch / "alerts.json").write_text(json.dumps(told, allow_nan=False) + "\n")
            with house_style():
                picture = pictures.save(draw_alerts(history), scratch, "alerts")
        say(f"wrote alerts.json, {picture} to {out}")


def _lines(history: AlertHistory, clock: Clock) -> list[str]:
    """The text: changes of level by the recording's clock, what was not judged, and notes."""
    changes, missed = history.changes(), history.not_judged
    count, seconds = len(history.judged), len(history.seconds)
    judged = f"{count} other aircraft judged in {seconds} s"
    if changes:
        lines = [f"{history.volumes.about}: {judged}"]
    elif missed:
        lines = [f"{history.volumes.name}: nothing to alert on among {judged}"]
    else:
        lines = [f"{history.volumes.name}: no alert in {seconds} s, {count} other aircraft judged"]
    for time_s, name, level in changes:
        when = f"{time_s:10.0f} s"
        if clock == "utc":
            when = f"{datetime.fromtimestamp(time_s, UTC):%Y-%m-%d %H:%M:%SZ}"
        lines.append(f"{when}  {level.name.lower():10}  {name}")
    if missed:
        lines.append(f"not judged ({len(missed)}): each may have been near without an alert above")
    for one in missed[:MOST_LINES]:
        lines.append(f"{one.seconds:10d} s  {one.address or '(no address)'}: {one.reason}")
    if len(missed) > MOST_LINES:
        lines.append(f"{'':12}... and {len(missed) - MOST_LINES} more; --json lists all")
    return lines + [f"note: {note}" for note in history.notes]
