"""What commands that fly share: the run as one MCAP file in its folder."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.cli.report import say

if TYPE_CHECKING:
    from clearway.missions.mission_file import MissionFile
    from clearway.missions.setup import FlightSetup
    from clearway.sensors import Scan
    from clearway.sim import Run
    from clearway.sim.pilot import Steering


def record_run(
    run: Run[Steering],
    setup: FlightSetup,
    file: MissionFile,
    folder: Path,
    scans: Iterable[Scan] = (),
) -> None:
    """Write `run.mcap`; without the extra that it takes, a line says so."""
    from clearway.base.errors import MissingExtraError
    from clearway.io.toml_writing import dump_toml
    from clearway.view.replay.reading import RUN_FILE
    from clearway.view.replay.writing import write_mcap

    try:
        write_mcap(run, setup, dump_toml(file.effective()), folder / RUN_FILE, scans)
    except MissingExtraError as error:
        say(str(error))
