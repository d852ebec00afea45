"""`clearway assess`: rate one moment, from a scene file or a scan, and draw it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli.patience import asking_for_patience
from clearway.cli.report import print_json, say
from clearway.errors import InputError

if TYPE_CHECKING:
    from clearway.io.scene import SceneInput
    from clearway.scene import SceneAssessment

GRID, OUTPUT = "Grid", "Output"
COMMAND_LINE = "command line"


def assess(
    scene: Annotated[
        Path | None, typer.Argument(help="Scene file (TOML); not needed with --scan.")
    ] = None,
    scan: Annotated[
        Path | None,
        typer.Option(help="Point cloud in the sensor's frame: .pcd, .las, .laz, .csv, .xyz, .npy."),
    ] = None,
    pattern: Annotated[
        str | None,
        typer.Option(
            help="Sensor whose beams made the scan: vlp16, vls128, os1-128, os0-128; "
            "auto estimates them from the points (default)."
        ),
    ] = None,
    range_m: Annotated[
        float | None, typer.Option("--range", help="Range in metres.", rich_help_panel=GRID)
    ] = None,
    layers: Annotated[int | None, typer.Option(rich_help_panel=GRID)] = None,
    columns: Annotated[int | None, typer.Option(rich_help_panel=GRID)] = None,
    rows: Annotated[int | None, typer.Option(rich_help_panel=GRID)] = None,
    azimuth_deg: Annotated[
        str | None, typer.Option(help="Half width, or right,left.", rich_help_panel=GRID)
    ] = None,
    elevation_deg: Annotated[
        str | None, typer.Option(help="Half height, or bottom,top.", rich_help_panel=GRID)
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(help="Reach set: flying, primitives, combined, harmonic, chaotic or full."),
    ] = None,
    speed: Annotated[
        float | None, typer.Option(help="Vehicle in m/s; default: one layer a second.")
    ] = None,
    rating: Annotated[str | None, typer.Option(help="total, printed, visible or evidence.")] = None,
    unknown: Annotated[
        float | None, typer.Option(help="How far hidden space counts as blocked, 0 to 1.")
    ] = None,
    detection: Annotated[str | None, typer.Option(help="ratio or surface.")] = None,
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
) -> None:
    """Rate one moment: detection, visibility, map and intruders per cell, and what is reachable."""
    from clearway.io.scene_result import scene_result
    from clearway.scene import assess_scene

    overrides: dict[str, dict[str, Any]] = {
        "grid": {
            "range_m": range_m,
            "layers": layers,
            "columns": columns,
            "rows": rows,
            "azimuth_deg": _angles("--azimuth-deg", azimuth_deg),
            "elevation_deg": _angles("--elevation-deg", elevation_deg),
        },
        "scan": {"pattern": pattern},
        "reach_set": {"method": method, "speed_mps": speed},
        "rating": {"name": rating, "unknown": unknown, "detection": detection},
    }
    with asking_for_patience():
        read = _read(scene, scan, _given(overrides))
        for note in read.notes:
            say(note)
        assessment = assess_scene(read.scene, notice=say)
    result = scene_result(assessment)
    folder = out or Path("clearway-out") / f"assess-{read.scene.name}"
    written = _write(read, assessment, result, folder, plots)
    if as_json:
        print_json(result)
    else:
        print(_in_words(assessment))
    say(f"wrote {', '.join(written)} to {folder}")


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


def _given(overrides: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Only the options that were given."""
    tables = {
        table: {key: value for key, value in keys.items() if value is not None}
        for table, keys in overrides.items()
    }
    return {table: keys for table, keys in tables.items() if keys}


def _read(scene: Path | None, scan: Path | None, overrides: dict[str, Any]) -> SceneInput:
    from clearway.io.scene import read_scene, scene_of

    if scan is not None:
        overrides["scan"] = {"file": str(scan.absolute()), **overrides.get("scan", {})}
    if scene is not None:
        return read_scene(scene, overrides)
    if scan is None:
        raise InputError(COMMAND_LINE, "nothing to assess: give a scene file or --scan FILE")
    return scene_of(COMMAND_LINE, overrides, Path(), scan.stem)


def _write(
    read: SceneInput,
    assessment: SceneAssessment,
    result: dict[str, Any],
    folder: Path,
    plots: bool,
) -> list[str]:
    """The effective scene, the result and the pictures; all of it or nothing."""
    import json

    from clearway.io.staging import staged
    from clearway.io.toml import write_toml

    with staged(folder) as scratch:
        write_toml(read.tables, scratch / "scene.toml")
        (scratch / "result.json").write_text(json.dumps(result, allow_nan=False) + "\n")
        if plots:
            _draw(assessment, scratch)
        return sorted(path.name for path in scratch.iterdir())


def _draw(assessment: SceneAssessment, folder: Path) -> None:
    import numpy as np

    from clearway.plot.assessment import draw_assessment

    points = [np.zeros((0, 3)), *(d.points_m for d in assessment.detections)]
    figures = draw_assessment(
        assessment.cells,
        assessment.reach,
        assessment.reach_set,
        np.concatenate(points),
        assessment.scene.name,
    )
    for name, figure in figures.items():
        figure.savefig(folder / f"{name}.png", dpi=110)


def _in_words(assessment: SceneAssessment) -> str:
    """A page of text; arrays are in the JSON."""
    import numpy as np

    scene, reach, reach_set = assessment.scene, assessment.reach, assessment.reach_set
    grid, evidence = scene.grid, assessment.cells.evidence
    rated = reach.node_rating[reach_set.trajectories]
    passable = int(np.count_nonzero(rated >= scene.rating.threshold))
    reachable = int(np.count_nonzero(reach.reachability >= scene.rating.threshold))
    spaces = [f"{n} {name}" for name, n in _space_counts(assessment).items()]
    azimuth, elevation = np.degrees(grid.azimuth_edges_rad), np.degrees(grid.elevation_edges_rad)
    lines = [
        ("scene", scene.name),
        (
            "grid",
            f"{grid.layers} x {grid.columns} x {grid.rows} cells to {grid.range_m:g} m, "
            f"azimuth {azimuth[0]:g} to {azimuth[-1]:g} deg, "
            f"elevation {elevation[0]:g} to {elevation[-1]:g} deg",
        ),
        *_sighting_lines(assessment),
        ("map", f"{len(scene.obstacle_map)} obstacles, {_cells(evidence.map_base > 0.0)}"),
        ("intruders", f"{len(scene.traffic)}, {_cells(evidence.intruder > 0.0)}"),
        ("space", f"cells: {', '.join(spaces)}"),
        (
            "reach set",
            f"{scene.reach.method}, {reach_set.nodes} nodes, {len(rated)} trajectories, "
            f"{scene.speed_mps:g} m/s, "
            f"start pitch {np.degrees(reach_set.start_pitch_rad):.3g} deg (nose down)",
        ),
        (
            "rating",
            f"{scene.rating.name}: {passable} of {len(rated)} trajectories and {reachable} of "
            f"{np.count_nonzero(reach.passed)} cells with one reach {scene.rating.threshold:g}",
        ),
    ]
    return "\n".join(f"{name:<12}{text}" for name, text in lines)


def _sighting_lines(assessment: SceneAssessment) -> list[tuple[str, str]]:
    if not assessment.detections:
        return [("scan", "none: everything counts as visible")]
    lines = []
    for sighting, detection in zip(assessment.scene.sightings, assessment.detections, strict=True):
        pattern, source = sighting.lidar.pattern.name, sighting.pattern_from
        beams = pattern if pattern.startswith(source) else f"{source}: {pattern}"
        counts = ", ".join(f"{n} {reason}" for reason, n in detection.counts.items() if n)
        lines += [
            ("scan", f"{len(sighting.scan.points_m)} points: {counts or 'none'}"),
            (
                "beams",
                f"{beams}; {int(detection.beams.sum())} look into the grid",
            ),
            ("detected", _cells(detection.probability > 0.0)),
        ]
    return lines


def _cells(mask: Any) -> str:
    return f"in {int(mask.sum())} of {mask.size} cells"


def _space_counts(assessment: SceneAssessment) -> dict[str, int]:
    from collections import Counter

    return dict(sorted(Counter(assessment.space.names).items()))
