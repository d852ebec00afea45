"""`clearway assess`: rate one moment, from a scene file or a scan, and draw it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from clearway.base.errors import ClearwayError, InputError
from clearway.base.units import FASTEST_MPS
from clearway.cli import picture_options as drawn
from clearway.cli.report import add_sources, print_json, print_words, say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from clearway.avoidance.scene import SceneAssessment
    from clearway.io.results_folder import ResultsFolder
    from clearway.missions.scene_reading import SceneInput
    from clearway.view.plot.style import Pictures

Outcome: TypeAlias = "tuple[dict[str, Any], str, Callable[[], Mapping[str, Figure]]]"
"""Result, the same in words, and its pictures when they are wanted."""

GRID = "Grid"
OUTPUT = "Output"
COMMAND_LINE = "command line"


def assess(
    scene: Annotated[
        Path | None, typer.Argument(help="Scene file (TOML); not needed with --scan.")
    ] = None,
    scan: Annotated[
        Path | None,
        typer.Option(
            help="Scan in the sensor's frame: {clouds}; of a recording: {recordings}, folder of a "
            "ROS 2 bag, or of numbered scans."
        ),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            help="Which scan of a recording: its number from 0, or 1.5s after the first; "
            "default: the first usable one."
        ),
    ] = None,
    topic: Annotated[
        str | None, typer.Option(help="Topic of a bag with several that have points.")
    ] = None,
    frame: Annotated[
        str | None,
        typer.Option(
            help="Axes of its points: body (x ahead, y left, z up), optical (z ahead, x right, y "
            "down: a depth camera), or auto: as a bag calls the frame (default)."
        ),
    ] = None,
    poses: Annotated[
        str | None,
        typer.Option(help="File of the vehicle's poses ({poses}), or topic of the bag."),
    ] = None,
    every: Annotated[
        bool,
        typer.Option("--all", help="Play the whole recording and list what is decided per scan."),
    ] = False,
    pattern: Annotated[
        str | None,
        typer.Option(
            "--sensor",
            "--pattern",
            help="Sensor whose beams made the scan: {patterns}; auto estimates them from the "
            "points (default).",
        ),
    ] = None,
    min_range_m: Annotated[
        float | None,
        typer.Option(
            "--min-range", min=0.0, help="Blind range in metres: nearer returns are dropped."
        ),
    ] = None,
    airframe_radius_m: Annotated[
        float | None,
        typer.Option(
            "--airframe-radius",
            min=0.0,
            help="Returns within this many metres of the body's origin are the own airframe's.",
        ),
    ] = None,
    range_m: Annotated[
        float | None, typer.Option("--range", help="Range in metres.", rich_help_panel=GRID)
    ] = None,
    layers: Annotated[
        int | None, typer.Option(help="Cells along the range.", rich_help_panel=GRID)
    ] = None,
    columns: Annotated[
        int | None, typer.Option(help="Cells from side to side.", rich_help_panel=GRID)
    ] = None,
    rows: Annotated[
        int | None, typer.Option(help="Cells from bottom to top.", rich_help_panel=GRID)
    ] = None,
    azimuth_deg: Annotated[
        str | None, typer.Option(help="Half width in degrees, or right,left.", rich_help_panel=GRID)
    ] = None,
    elevation_deg: Annotated[
        str | None,
        typer.Option(help="Half height in degrees, or bottom,top.", rich_help_panel=GRID),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(help="Reach set: {methods}."),
    ] = None,
    vehicle: Annotated[
        str | None,
        typer.Option(
            help="What flies: plane (keeps its speed), multirotor (accelerates and brakes) or "
            "inertialess (stops at once); default: inertialess for a scan of a file, else plane."
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            max=FASTEST_MPS, help="Speed of the vehicle in m/s; default: one layer a second."
        ),
    ] = None,
    rating: Annotated[str | None, typer.Option(help="How safe a cell is: {ratings}.")] = None,
    unknown: Annotated[
        float | None, typer.Option(help="How far hidden space counts as blocked, 0 to 1.")
    ] = None,
    detection: Annotated[
        str | None, typer.Option(help="How hits make a cell occupied (P_OD): {detection}.")
    ] = None,
    as_json: Annotated[
        bool,
        typer.Option("--json", help="Print one JSON object.", rich_help_panel=OUTPUT),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of result and pictures; default clearway-out/assess-<name>.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    plots: Annotated[
        bool, typer.Option("--plots/--no-plots", help="Draw pictures.", rich_help_panel=OUTPUT)
    ] = True,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
) -> None:
    """Rate one moment, or every scan of a recording: each cell, and what is reachable."""
    from clearway.io.results_folder import ResultsFolder

    overrides: dict[str, dict[str, Any]] = {
        "grid": {
            "range_m": range_m,
            "layers": layers,
            "columns": columns,
            "rows": rows,
            "azimuth_deg": _angles("--azimuth-deg", azimuth_deg),
            "elevation_deg": _angles("--elevation-deg", elevation_deg),
        },
        "scan": {
            "pattern": pattern,
            "at": _which(at),
            "topic": topic,
            "frame": frame,
            "poses": _absolute(poses),
            "min_range_m": min_range_m,
            "airframe_radius_m": airframe_radius_m,
        },
        "vehicle": {"kind": vehicle},
        "reach_set": {"method": method, "speed_mps": speed},
        "rating": {"name": rating, "unknown": unknown, "detection": detection},
    }
    from clearway.io.public_data import find_public_data

    pictures = drawn.pictures_of(form, dpi)
    if every and at is not None:
        raise InputError(COMMAND_LINE, "--at takes one scan, --all takes them all: give one")
    scan = None if scan is None else find_public_data(scan)
    read = _read(scene, scan, _keep_given(overrides))
    kind = "play" if every else "assess"
    folder = ResultsFolder.check(
        out or Path("clearway-out") / f"{kind}-{read.scene.name}",
        "assess --all" if every else "assess",
        read.scene.name,
    )
    for note in read.notes:
        say(note)
    try:
        result, words, draw = (_play if every else _assess_moment)(read)
    except ClearwayError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(str(scene or scan), str(error)) from error
    result = add_sources(result, [one for one in (scene, scan) if one is not None])
    if as_json:
        print_json(result)
    else:
        print_words(words)
    written = _write(read, result, draw if plots else None, folder, pictures)
    say(f"wrote {', '.join(written)} to {folder.path}")


def _assess_moment(read: SceneInput) -> Outcome:
    """One moment, cell by cell."""
    from clearway.avoidance.scene import assess_scene
    from clearway.cli.assess_words import describe_assessment
    from clearway.missions.scene_result import scene_result

    assessment = assess_scene(read.scene, notice=say)
    for detection in assessment.detections:
        left_out = {why: n for why, n in detection.counts.items() if n}
        if left_out and not left_out.keys() & {"kept", "outside"}:
            told = ", ".join(f"{n} {why}" for why, n in left_out.items())
            say(f"{read.scene.name}: not one return of a scan is kept, nothing seen counts: {told}")
    return scene_result(assessment), describe_assessment(assessment), lambda: _figures(assessment)


def _play(read: SceneInput) -> Outcome:
    """Every scan of a recording, and what is decided at each."""
    from clearway.missions.played_result import describe_playback, make_played_result, scan_result
    from clearway.missions.played_scene import play_scene
    from clearway.view.plot.playback import draw_playback

    playback = play_scene(read, notice=say)
    for note in playback.notes:
        if note not in read.notes:
            say(note)
    scans = [scan_result(index, played) for index, played in playback.scans]
    result = make_played_result(read.scene.name, playback, scans)
    return result, describe_playback(result), lambda: {"playback": draw_playback(result)}


def _which(at: str | None) -> int | str | None:
    """A number of a scan as a number, all else as it stands: the reader says what is valid."""
    return int(at) if at is not None and at.isdigit() else at


def _absolute(poses: str | None) -> str | None:
    """A file of the command line is where that was given, a topic is none."""
    return str(Path(poses).absolute()) if poses is not None and Path(poses).is_file() else poses


def _angles(option: str, value: str | None) -> float | list[float] | None:
    """One angle, or two with a comma; range and order are the grid's to check."""
    if value is None:
        return None
    try:
        angles = [float(part) for part in value.split(",")]
    except ValueError:
        raise InputError(
            COMMAND_LINE, f"{option}: {value!r} is no angle in degrees; valid: 45, or -30,60"
        ) from None
    return angles[0] if len(angles) == 1 else angles


def _keep_given(overrides: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Only the options that were given."""
    tables = {
        table: {key: value for key, value in keys.items() if value is not None}
        for table, keys in overrides.items()
    }
    return {table: keys for table, keys in tables.items() if keys}


def _read(scene: Path | None, scan: Path | None, overrides: dict[str, Any]) -> SceneInput:
    from clearway.missions.scene_reading import read_scene, scene_of

    if scan is not None:
        overrides["scan"] = {"file": str(scan.absolute()), **overrides.get("scan", {})}
    if scene is not None:
        return read_scene(scene, overrides)
    if scan is None:
        raise InputError(COMMAND_LINE, "nothing to assess: give a scene file or --scan FILE")
    return scene_of(COMMAND_LINE, overrides, Path(), scan.stem)


def _write(
    read: SceneInput,
    result: dict[str, Any],
    draw: Callable[[], Mapping[str, Figure]] | None,
    folder: ResultsFolder,
    pictures: Pictures,
) -> list[str]:
    """The effective scene, the result and the pictures; all of it or nothing."""
    import json

    from clearway.io.toml_writing import write_toml

    with folder.write() as scratch:
        write_toml(read.tables, scratch / "scene.toml")
        (scratch / "result.json").write_text(json.dumps(result, allow_nan=False) + "\n")
        if draw is not None:
            from clearway.view.plot.style import house_style

            with house_style():
                for name, figure in draw().items():
                    pictures.save(figure, scratch, name)
        return sorted(path.name for path in scratch.iterdir())


def _figures(assessment: SceneAssessment) -> Mapping[str, Figure]:
    import numpy as np

    from clearway.view.plot.assessment import assessment_figures

    points = [np.zeros((0, 3)), *(d.points_m for d in assessment.detections)]
    return assessment_figures(
        assessment.cells,
        assessment.reach,
        assessment.reach_set,
        np.concatenate(points),
        assessment.scene.name,
    )
