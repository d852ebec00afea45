"""What a flight leaves: its logs at once, then its pictures, whose end costs no log."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import TYPE_CHECKING

from clearway.cli.record import record_run
from clearway.cli.report import add_sources, say

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.missions.mission_file import MissionFile
    from clearway.missions.setup import FlightSetup
    from clearway.sensors import Scan
    from clearway.sim import Run
    from clearway.sim.pilot import Steering
    from clearway.view.plot.style import Pictures


def write_flight(
    run: Run[Steering],
    setup: FlightSetup,
    file: MissionFile,
    folder: ResultsFolder,
    *,
    mcap: bool = True,
    parquet: bool = False,
    scans: Iterable[Scan] = (),
) -> None:
    """Everything that the flight leaves but pictures, all of it or nothing; says what."""
    from clearway.base.give_back import give_back
    from clearway.io.toml_writing import write_toml
    from clearway.missions.run_files import write_decisions, write_intruders, write_track
    from clearway.missions.run_tables import write_tables

    give_back()
    with folder.write() as scratch:
        write_toml(file.effective(), scratch / "mission.toml")
        write_track(run, scratch / "track.csv")
        if run.intruder_tracks:
            write_intruders(run, scratch / "intruders.csv")
        write_decisions(run, scratch / "decisions.jsonl")
        summary = add_sources(run.summary())
        (scratch / "summary.json").write_text(json.dumps(summary, indent=2) + "\n")
        if parquet:
            write_tables(run, scratch)
        if mcap:
            record_run(run, setup, file, scratch, scans)
        written = sorted(path.name for path in scratch.iterdir())
    say(f"wrote {', '.join(written)} to {folder.path}")


def draw_pictures(
    run: Run[Steering],
    setup: FlightSetup,
    file: MissionFile,
    folder: ResultsFolder,
    pictures: Pictures,
) -> None:
    """The pictures, beside what the flight left before; all of them or none."""
    from clearway.base.give_back import give_back
    from clearway.sim import is_clearway_run
    from clearway.studies.figures.flight_set import flight_figures, track_figures
    from clearway.view.plot.flight_curves import Margins
    from clearway.view.plot.style import house_style

    body = file.vehicle.body_radius_m
    turning = file.safety.conservative_turning_radius_m or setup.planner.automaton.turning_radius_m
    margins = Margins(run.safety_margin_m, 6.0 * body, 2.0 * turning + 2.0 * body)
    give_back()
    with folder.taking_more().write() as scratch, house_style():
        if is_clearway_run(run):
            figures = flight_figures(run, margins, setup.world, setup.kept_out)
        else:
            figures = track_figures(run, setup.world, margins)
        drawn = [pictures.save(figure, scratch, name) for name, figure in figures]
    say(f"wrote {', '.join(sorted(drawn))} to {folder.path}")
