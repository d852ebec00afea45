"""What `clearway reach-set` and `clearway reach-set compare` share: grid and vehicle as options."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from clearway.base.errors import ClearwayError
from clearway.base.units import FASTEST_MPS

if TYPE_CHECKING:
    from clearway.base.grid import AvoidanceGrid
    from clearway.io.results_folder import ResultsFolder
    from clearway.vehicle.automaton import MovementAutomaton

GRID = "Grid"
VEHICLE = "Vehicle"
OUTPUT = "Output"
MOST_CELLS = 100_000
LONGEST_S = 1e3
"""A movement of a quarter of an hour."""

Layers = Annotated[int, typer.Option(help="Cells along the range.", rich_help_panel=GRID)]
RangeM = Annotated[
    float | None,
    typer.Option(
        "--range",
        help="Range of the grid in metres; default: one movement's length per layer.",
        rich_help_panel=GRID,
    ),
]
Columns = Annotated[int, typer.Option(help="Cells from side to side.", rich_help_panel=GRID)]
Rows = Annotated[int, typer.Option(help="Cells from bottom to top.", rich_help_panel=GRID)]
AzimuthDeg = Annotated[
    str, typer.Option(help="Half width in degrees, or right,left.", rich_help_panel=GRID)
]
ElevationDeg = Annotated[
    str, typer.Option(help="Half height in degrees, or bottom,top.", rich_help_panel=GRID)
]
Speed = Annotated[float, typer.Option(help="Speed in m/s.", rich_help_panel=VEHICLE)]
TurnStepDeg = Annotated[float, typer.Option(help="Turn of one movement.", rich_help_panel=VEHICLE)]
Duration = Annotated[float, typer.Option(help="Seconds of one movement.", rich_help_panel=VEHICLE)]
PitchLimitDeg = Annotated[
    str,
    typer.Option(
        help="Steepest pitch, or none (as in the paper's table 6.1).", rich_help_panel=VEHICLE
    ),
]
Movements = Annotated[
    int, typer.Option(help="9, or 5: without diagonals.", rich_help_panel=VEHICLE)
]
AsJson = Annotated[
    bool, typer.Option("--json", help="Print one JSON object.", rich_help_panel=OUTPUT)
]
Out = Annotated[
    Path | None,
    typer.Option(
        help="Folder of the pictures; default: one in clearway-out.", rich_help_panel=OUTPUT
    ),
]
Plots = Annotated[
    bool, typer.Option("--plots/--no-plots", help="Draw pictures.", rich_help_panel=OUTPUT)
]


def check_picture_folder(out: Path | None, name: str) -> ResultsFolder:
    """Where pictures go, beside those that are there; looked at before any work."""
    from clearway.io.results_folder import ResultsFolder
    from clearway.io.staging import RESULTS

    return ResultsFolder.check(out or RESULTS / name, name, "", adds=True)


def build_option_automaton(
    speed_mps: float, turn_step_deg: float, duration_s: float, pitch_limit_deg: str, movements: int
) -> MovementAutomaton:
    """The plane's automaton of command-line values; raises ClearwayError naming the option."""
    from clearway.vehicle.automaton import MovementAutomaton

    if movements not in (5, 9):
        raise ClearwayError(f"--movements: {movements} is neither 5 nor 9")
    for option, value, most, unit in (
        ("--speed", speed_mps, FASTEST_MPS, "m/s"),
        ("--duration", duration_s, LONGEST_S, "s"),
    ):
        if not 0.0 < value <= most:
            raise ClearwayError(f"{option}: {value:g} is not above 0 and at most {most:g} {unit}")
    if not (0.0 <= abs(turn_step_deg) <= 180.0):
        raise ClearwayError(f"--turn-step-deg: {turn_step_deg} is not within [-180, 180]")
    limit = None
    if pitch_limit_deg != "none":
        (limit,) = _numbers("--pitch-limit-deg", pitch_limit_deg, (1,), "or none")
        if not 0.0 <= limit < 90.0:
            raise ClearwayError(f"--pitch-limit-deg: {limit:g} is not within [0, 90)")
    return MovementAutomaton.plane(
        speed_mps,
        turn_step_deg,
        duration_s=duration_s,
        pitch_limit_deg=limit,
        diagonals=movements == 9,
    )


def grid_of(
    range_m: float | None,
    step_m: float,
    layers: int,
    azimuth_deg: str,
    columns: int,
    elevation_deg: str,
    rows: int,
) -> AvoidanceGrid:
    """The grid of command-line values, by default with layers of one movement's length.

    Raises ClearwayError naming the option.
    """
    from clearway.base.grid import AvoidanceGrid

    if max(layers, 1) * max(columns, 1) * max(rows, 1) > MOST_CELLS:
        raise ClearwayError(
            f"--layers, --columns, --rows: {layers} x {columns} x {rows} are more than "
            f"{MOST_CELLS} cells"
        )
    if range_m is None:
        range_m = max(layers, 1) * step_m
    if 0.0 < range_m < step_m:
        raise ClearwayError(
            f"--range: one movement of {step_m:g} m leads out of a grid of {range_m:g} m"
        )

    spans = {}
    for option, value in (("--azimuth-deg", azimuth_deg), ("--elevation-deg", elevation_deg)):
        numbers = _numbers(option, value, (1, 2), "or two with a comma")
        spans[option] = numbers[0] if len(numbers) == 1 else (numbers[0], numbers[1])
    return AvoidanceGrid.uniform(
        range_m,
        layers,
        azimuth_deg=spans["--azimuth-deg"],
        columns=columns,
        elevation_deg=spans["--elevation-deg"],
        rows=rows,
    )


def _numbers(option: str, value: str, counts: tuple[int, ...], others: str) -> list[float]:
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts:
        raise ClearwayError(f"{option}: {value!r} is not a number, {others}")
    return numbers
