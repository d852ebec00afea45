"""What `clearway risk` leaves in its folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clearway.cli.report import add_sources, say

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.studies.risk.study import RiskStudy
    from clearway.view.plot.style import Pictures


def results_folder(out: Path | None, model: Path | None, only: int | None) -> ResultsFolder | None:
    """Where results go, looked at before anything is flown; nowhere unless asked for."""
    from clearway.io.results_folder import ResultsFolder

    if out is None:
        return None
    of = "made-up numbers" if model is None else model.name
    if only is not None:
        return ResultsFolder.check(out, "risk --only", of, adds=True)
    return ResultsFolder.check(out, "risk", of)


def write_study(result: RiskStudy, told: dict[str, Any], folder: ResultsFolder) -> None:
    """Every encounter, and what they come to."""
    import json

    from clearway.studies.risk.summary import write_encounters

    with folder.write() as scratch:
        write_encounters(result, scratch / "encounters.csv")
        (scratch / "risk.json").write_text(
            json.dumps(add_sources(told), indent=2, allow_nan=False) + "\n"
        )
    say(f"wrote encounters.csv, risk.json to {folder.path}")


def draw_curves(files: Sequence[Path], out: Path | None, pictures: Pictures) -> None:
    """Earlier studies in one picture; raises InputError where there is no folder for it."""
    from clearway.base.errors import InputError
    from clearway.io.staging import stage_folder
    from clearway.studies.figures.risk_curves import draw_risk_curves, read_study
    from clearway.view.plot.style import house_style

    if out is None:
        raise InputError("--curves", "needs --out, a folder for the picture")
    studies = [read_study(file) for file in files]
    with stage_folder(out) as scratch, house_style():
        name = pictures.save(draw_risk_curves(studies), scratch, "risk-curves")
    say(f"wrote {name} to {out}")
