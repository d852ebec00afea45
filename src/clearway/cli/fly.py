"""`clearway fly`: a mission from start to end in a simulated world, with its pictures and logs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.cli import film_options as filmed
from clearway.cli import picture_options as drawn
from clearway.cli.flight_files import draw_pictures, write_flight
from clearway.cli.progress import progress_bar
from clearway.cli.report import NOT_REACHED, folder_of_file, leave, print_json, print_words, say

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from clearway.live.mission import Progress as MissionProgress
    from clearway.missions.mission_file import MissionFile
    from clearway.missions.setup import FlightSetup
    from clearway.sim import LoggedDecision, Run
    from clearway.sim.kept_scans import TakesScans
    from clearway.sim.metrics import IntruderDistances
    from clearway.sim.pilot import Steering


def fly(
    mission: Annotated[
        str,
        typer.Argument(
            help="A mission by name ({missions}), a mission file (TOML), a flight plan ({plans}), "
            "or a made-up world and its seed (forest:3)."
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for logs and pictures, of this mission alone; default "
            "clearway-out/<mission>."
        ),
    ] = None,
    spawn: Annotated[
        str | None,
        typer.Option(
            help="What intruders' places are relative to: nominal (flight), ownship or world."
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of noise and drop-outs.")] = None,
    rating: Annotated[
        str | None, typer.Option(help="How safe a cell is: {ratings}; default: the mission's.")
    ] = None,
    rule: Annotated[
        list[str] | None,
        typer.Option(help="A rule of your own, module:name; may be repeated."),
    ] = None,
    verify: Annotated[
        str | None,
        typer.Option(
            help="evidence: check candidates against all that was seen; none: trust ratings."
        ),
    ] = None,
    planner: Annotated[str, typer.Option(help="Planner that decides: {planners}.")] = "clearway",
    plots: Annotated[bool, typer.Option("--plots/--no-plots", help="Draw pictures.")] = True,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
    video: filmed.Video = None,
    fps: filmed.Fps = None,
    speed: filmed.Speed = None,
    mcap: Annotated[
        bool, typer.Option("--mcap/--no-mcap", help="Write run.mcap, for `replay` and Foxglove.")
    ] = True,
    raw_scans: Annotated[
        bool, typer.Option("--scans", help="Keep every raw scan in run.mcap: large.")
    ] = False,
    parquet: Annotated[
        bool, typer.Option("--parquet", help="Write the log as Parquet tables too.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object on standard output.")
    ] = False,
) -> None:
    """Fly a mission in simulation: exit status 0 if reached without violation, 1 if not."""
    from clearway.io.results_folder import ResultsFolder
    from clearway.io.staging import name_results_folder
    from clearway.missions.run_tables import check_tables
    from clearway.missions.setup import prepare
    from clearway.sim.baselines import check_planner_name
    from clearway.sim.kept_scans import ScanFile

    beside, pictures = folder_of_file(mission), drawn.pictures_of(form, dpi)
    film = filmed.film_asked(video, fps, speed)
    check_planner_name(planner, beside)
    if parquet:
        check_tables()
    file = _override(_read(mission), seed, rating, rule or [], verify, spawn, beside)
    folder = ResultsFolder.check(
        out or name_results_folder(file.mission.name), "fly", file.mission.name
    )
    say("preparing reach sets and sensors")
    setup = prepare(file, say)
    notes = (*setup.notes, *setup.doubts)
    for note in notes:
        say(note)
    setup.refuse_impossible()
    if planner == "clearway":
        say(str(setup.escape))
    scans = ScanFile() if raw_scans and mcap else None
    run = fly_with_bar(setup, planner, beside, scans)
    if as_json:
        print_json(run.summary() | {"notes": list(notes), "chosen": file.left_out})
    else:
        print_words(_in_words(run))
    write_flight(run, setup, file, folder, mcap=mcap, parquet=parquet, scans=scans or ())
    if plots:
        draw_pictures(run, setup, file, folder, pictures)
    if film is not None:
        from clearway.view.replay.in_memory import recording_of

        filmed.make_film(recording_of(run, setup), film, folder)
    if not run.safe:
        leave(NOT_REACHED)


def _read(mission: str) -> MissionFile:
    from clearway.missions.world_file import read_mission

    return read_mission(mission, say)


def _override(
    file: MissionFile,
    seed: int | None,
    rating: str | None,
    rules: list[str],
    verify: str | None,
    spawn: str | None,
    beside: Path | None,
) -> MissionFile:
    """The mission with what the command line overrides, checked like a file."""
    from clearway.io.toml import parse_model
    from clearway.missions.mission_file import MissionFile

    tables = file.effective()
    for table, key in (name.split(".") for name in file.left_out):
        del tables[table][key]
    if seed is not None:
        tables["simulation"]["seed"] = seed
    if rating is not None:
        tables["rating"]["name"] = rating
    tables["rules"]["own"] = [*tables["rules"].get("own", ()), *rules]
    if verify is not None:
        tables["verify"]["method"] = verify
    if spawn is not None:
        tables["traffic"]["spawn"] = spawn
    return parse_model("command line", tables, MissionFile, beside)


def fly_with_bar(
    setup: FlightSetup,
    planner: str,
    folder: Path | None = None,
    scans: TakesScans | None = None,
) -> Run[Steering]:
    """Fly with a progress bar: the share of the straight way that is behind."""
    total, wrong = setup.mission.straight_length_m, set[str]()
    with progress_bar(setup.mission.name, total, beside=("status", "elapsed")) as bar:

        def show(entry: LoggedDecision[Steering], progress: MissionProgress) -> None:
            flight = entry.flight
            goals = len(setup.mission.goals_m)
            status = f"{flight.time_s:.0f} s, goal {progress.goal + 1} of {goals}, {flight.mode}"
            bar.show(_measure_flown_length(setup, entry), status=status)
            if flight.mode == "emergency":
                bar.print_above(f"{flight.time_s:.1f} s: {flight.explanation}", "red")
            elif flight.mode in ("escape", "hold", "narrow"):
                change = mode_change(flight)
                if change:
                    bar.print_above(f"{flight.time_s:.1f} s: {change}", "magenta")
            alarms = alarms_in_words(flight)
            for kind in alarms.keys() - wrong:
                bar.print_above(f"{flight.time_s:.1f} s: ALARM: {alarms[kind]}", "red")
            wrong.clear()
            wrong.update(alarms)

        return setup.fly_with(planner, show, folder, scans)


def mode_change(flight: Steering) -> str:
    """The change of mode that a decision made, in words; empty where it made none."""
    from clearway.live import FlightDecision

    return flight.mode_state.transition if isinstance(flight, FlightDecision) else ""


def alarms_in_words(flight: Steering) -> dict[str, str]:
    """What is wrong at a decision, by kind."""
    from clearway.live import FlightDecision

    alarms = flight.alarms if isinstance(flight, FlightDecision) else ()
    return {str(alarm.kind): alarm.why for alarm in alarms}


def _measure_flown_length(setup: FlightSetup, entry: LoggedDecision[Steering]) -> float:
    """Straight length up to the present goal, less what is left to it."""
    import numpy as np

    mission = setup.mission
    corners = np.concatenate([mission.start.position_m[None], mission.goals_m])
    legs = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    goal = min(entry.flight.goal, len(legs) - 1)
    left = np.linalg.norm(corners[goal + 1] - entry.flight.state.position_m)
    return float(max(0.0, legs[: goal + 1].sum() - left))


def _in_words(run: Run[Steering]) -> str:
    metrics = run.metrics
    goals = len(run.mission.waypoints_m)
    times = run.decision_ms
    lines = [
        f"mission            {run.mission.name}, planner {run.planner}",
        f"reached            {'yes' if run.reached else 'NO'}, "
        f"{run.progress.waypoints_reached(run.mission)} of {goals} waypoints",
        f"time               {metrics.time_s:.2f} s",
        f"path               {metrics.path_length_m:.2f} m",
        f"nearest obstacle   {_metres(metrics.min_obstacle_distance_m)}, "
        f"margin {run.safety_margin_m:.2f} m, violations {metrics.margin_violations}",
        f"decisions          {len(run.decisions)}, emergencies {run.emergencies}, "
        f"p50 {times['p50']:.2f} ms, p99 {times['p99']:.2f} ms, max {times['max']:.2f} ms",
        f"off straight legs  {metrics.tracking_m.mean():.2f} m on average, "
        f"{metrics.tracking_m.max():.2f} m at most",
    ]
    if run.ways_out is not None:
        lines.insert(-1, f"escapes            {_ways_out_in_words(run)}")
    if metrics.intruders is not None:
        traffic = metrics.intruders
        lines.append(
            f"nearest intruder   {traffic.min_distance_m:.3f} m ({traffic.closest_name}), "
            f"margin {traffic.margin_m.min():.2f} m, violations {traffic.violations}"
        )
    if metrics.straight is not None:
        lines.append(f"straight flight    {_straight_in_words(metrics.straight)}")
    if run.crashed_s is not None:
        lines.insert(2, f"CRASHED            at {run.crashed_s:.2f} s")
    elif not run.reached:
        lines.insert(2, f"why not            {run.summary()['reason']}")
    lines += _alarms_in_words(run.summary()["alarms"])
    if run.counts:
        told = ", ".join(f"{why} ({n})" for why, n in run.counts.items())
        lines.append(f"data left out      {told}")
    return "\n".join(lines)


def _alarms_in_words(alarms: Sequence[Mapping[str, Any]]) -> list[str]:
    """A line for each kind of alarm: when first and why, and how often again."""
    lines = []
    for kind in dict.fromkeys(alarm["kind"] for alarm in alarms):
        first, *later = [alarm for alarm in alarms if alarm["kind"] == kind]
        again = f"; again {len(later)} times, last at {later[-1]['time_s']:.1f} s" if later else ""
        lines.append(f"ALARM              at {first['time_s']:.1f} s: {first['why']}{again}")
    return lines


def _ways_out_in_words(run: Run[Steering]) -> str:
    """Which escapes were held, from when on, and how often there was none."""
    summary = run.summary()
    plan, begins, without = (
        run.ways_out,
        summary["way_out_from_s"],
        summary["decisions_without_escape"],
    )
    assert plan is not None
    flown = f"{plan.flown}" if plan.flown == plan.asked else f"{plan.asked} asked, {plan.flown}"
    if plan.flown == "off":
        return flown
    if begins is None:
        return f"{flown}; none was ever held"
    said = f"{flown}; held from {begins:.1f} s on, {without} decisions after that without one"
    spans = " and ".join(f"{begin:.1f} to {end:.1f} s" for begin, end in summary["no_guarantee_s"])
    return f"{said}; no guarantee held from {spans}" if spans else said


def _straight_in_words(straight: IntruderDistances) -> str:
    """What straight flight would have come to, beside which the flight is to be seen."""
    nearest = straight.min_distance_m
    if not nearest < float("inf"):
        return "would meet no intruder"
    found = f"{nearest:.3f} m ({straight.closest_name}), violations {straight.violations}"
    return f"nearest intruder {found}{'' if straight.violations else ': no conflict'}"


def _metres(distance: float) -> str:
    return f"{distance:.3f} m" if distance < float("inf") else "none"
