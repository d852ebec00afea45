"""`clearway pursuit`: encounters with an intruder that wants to hit, and which can be avoided."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import picture_options as drawn
from clearway.cli.report import print_json, say

if TYPE_CHECKING:
    from clearway.studies.encounters.pursuit import WinMap


def pursuit(
    detected_at: Annotated[float, typer.Option(help="Distance of detection in metres.")] = 6.0,
    accelerations: Annotated[
        str,
        typer.Option(
            help="Of the intruder, in m/s2; 0: it flies straight on. An own turn takes 0.26."
        ),
    ] = "0,0.05,0.1,0.26",
    keep: Annotated[float, typer.Option(help="Distance to keep in metres.")] = 1.2,
    bearing_step_deg: Annotated[float, typer.Option(min=1.0, help="Step between bearings.")] = 5.0,
    out: Annotated[Path, typer.Option(help="Folder of the picture.")] = Path(
        "clearway-out/pursuit"
    ),
    plots: Annotated[bool, typer.Option("--plots/--no-plots", help="Draw the picture.")] = True,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Map which collision courses can be avoided against an intruder that wants to hit (def. 3)."""
    import numpy as np

    from clearway.studies.encounters.pursuit import win_map

    bearings_deg = np.arange(0.0, 90.0, bearing_step_deg)
    speeds = np.round(np.arange(0.5, 0.96, 0.05), 2).tolist()
    bearings = np.radians(bearings_deg).tolist()
    pictures, folder = drawn.pictures_of(form, dpi), None
    if plots:
        from clearway.io.results_folder import ResultsFolder

        folder = ResultsFolder.check(out, "pursuit", "")
    result = win_map(detected_at, _bounds(accelerations), bearings, speeds, keep)
    if as_json:
        print_json(_as_json(result, bearings_deg.tolist()))
    else:
        _print(result)
    if folder is not None:
        from clearway.studies.figures.pursuit import draw_win_map
        from clearway.view.plot.style import house_style

        with folder.write() as scratch, house_style():
            file = pictures.save(draw_win_map(result), scratch, "win-map")
        say(f"wrote {file} to {out}")


def _as_json(result: WinMap, bearings_deg: list[float]) -> dict[str, Any]:
    return {
        "detected_at_m": result.detected_at_m,
        "keep_m": result.keep_m,
        "bearings_deg": bearings_deg,
        "speeds": result.speeds.tolist(),
        "exists": result.exists.tolist(),
        "accelerations_mps2": result.accelerations_mps2.tolist(),
        "won": result.won.tolist(),
        "share": result.share.tolist(),
    }


def _print(result: WinMap) -> None:
    count = int(result.exists.sum())
    distances = f"detected at {result.detected_at_m:g} m, {result.keep_m:g} m to keep"
    print(f"{count} collision courses {distances}")
    for bound, share in zip(result.accelerations_mps2, result.share, strict=True):
        kind = "flies straight on" if bound == 0.0 else f"at most {bound:g} m/s2"
        print(f"{kind:20s} {100.0 * share:5.1f} % won for good")


def _bounds(text: str) -> list[float]:
    from clearway.base.errors import InputError

    try:
        bounds = [float(part) for part in text.split(",")]
    except ValueError:
        bounds = [math.nan]
    if not all(0.0 <= bound < math.inf for bound in bounds):
        problem = f"numbers >= 0 with commas between are needed, as in 0,0.1; got {text!r}"
        raise InputError("--accelerations", problem)
    return bounds
