"""`clearway encounters`: random encounters with intruders, and how many keep their distance."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clearway.base.own_code import shorten_own_name
from clearway.base.verdict import DemandVerdict
from clearway.cli.given import split_names
from clearway.cli.numbers import MOST_COUNTED, MOST_WORKERS, number_pair
from clearway.cli.progress import progress_bar
from clearway.cli.report import (
    NOT_REACHED,
    leave,
    leave_by,
    print_json,
    say,
)
from clearway.cli.tables import plain_table, print_table
from clearway.io.json_values import finite

if TYPE_CHECKING:
    from clearway.studies.encounters.encounter import EncounterSettings
    from clearway.studies.encounters.flights import EncounterOutcome, EncounterTally

KIND = "Kind of encounter"
RUN = "Run"
OUTPUT = "Output"
FAILURES_SHOWN = 12
CSV_COLUMNS = (
    "kind", "seed", "min_distance_m", "kept", "avoidable", "emergencies", "planner", "aside_m",
)  # fmt: skip
AVOIDING = ("kept", "share", "wilson_95", "verdict", "min_distance_m", "with_emergency", "failures")
"""What is stated of avoiding: nothing of a planner that cannot know what there is to avoid."""


def encounters(
    detected_at: Annotated[
        float,
        typer.Option(help="Distance of detection in metres at scale 1.", rich_help_panel=KIND),
    ] = 10.0,
    deviates: Annotated[
        bool,
        typer.Option(
            "--deviates",
            help="Intruders fly anywhere inside their spread, with a report each second.",
            rich_help_panel=KIND,
        ),
    ] = False,
    noise: Annotated[
        str,
        typer.Option(
            help="Noise of reports, metres,m/s at scale 1 (0.3,0.1); a tracker then smooths them.",
            rich_help_panel=KIND,
        ),
    ] = "0,0",
    late: Annotated[
        float,
        typer.Option(
            help="Seconds of straight flight from the detection to the first decision.",
            rich_help_panel=KIND,
        ),
    ] = 0.0,
    miss: Annotated[
        float,
        typer.Option(
            help="Straight flight passes within this many metres at scale 1.", rich_help_panel=KIND
        ),
    ] = 0.0,
    scale: Annotated[
        float, typer.Option(help="Factor on lengths and speeds.", rich_help_panel=KIND)
    ] = 1.0,
    every_kind: Annotated[
        bool,
        typer.Option(
            "--every-kind",
            help="Fly every kind that has a target of its own.",
            rich_help_panel=KIND,
        ),
    ] = False,
    planners: Annotated[
        str,
        typer.Option(help="Names with commas between, of {planners}.", rich_help_panel=RUN),
    ] = "clearway",
    count: Annotated[
        int,
        typer.Option(min=1, max=MOST_COUNTED, help="Number of encounters.", rich_help_panel=RUN),
    ] = 1000,
    seed: Annotated[
        int, typer.Option(min=0, help="Seed of the first one.", rich_help_panel=RUN)
    ] = 0,
    only: Annotated[
        int | None,
        typer.Option(
            min=0, help="Fly this seed alone and print its decisions.", rich_help_panel=RUN
        ),
    ] = None,
    workers: Annotated[
        int,
        typer.Option(min=1, max=MOST_WORKERS, help="Processes side by side.", rich_help_panel=RUN),
    ] = 2,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object.", rich_help_panel=OUTPUT)
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="CSV file (not a folder) with a row for every encounter.", rich_help_panel=OUTPUT
        ),
    ] = None,
) -> None:
    """Fly random collision courses, and check the share that keeps its distance against a target.

    The lower end of the 95 % interval counts. Exit status 0: the target is met; 1: it is missed;
    3: too few encounters to tell. 99.9 % takes some 3,900 encounters without a failure. Of several
    planners the first counts.
    """
    from clearway.studies.encounters.encounter import EncounterSettings

    position_noise, velocity_noise = number_pair("--noise", noise, "0.3,0.1")
    settings = EncounterSettings(
        detected_at_m=detected_at,
        deviates=deviates,
        position_noise_m=position_noise,
        velocity_noise_mps=velocity_noise,
        late_s=late,
        miss_m=miss,
        scale=scale,
    )
    names = _planners(planners)
    if out is not None:
        from clearway.io.results_folder import refuse_unwritable_file

        refuse_unwritable_file(out, "--out")
    if only is not None:
        _fly_one(only, settings, names, as_json)
        return
    kinds = _every_kind() if every_kind else [settings]
    seeds = range(seed, seed + count)
    tallies = [
        fly_encounters_with_bar(kind, seeds, workers, name) for kind in kinds for name in names
    ]
    if as_json:
        print_json({"encounters": [_summary(tally) for tally in tallies]})
    else:
        _print_table(tallies)
    if out is not None:
        _write(tallies, out)
    leave_by(
        DemandVerdict.NOT_SHOWN if tally.hidden else tally.verdict
        for tally in tallies
        if tally.planner == names[0]
    )


def _planners(names: str) -> list[str]:
    """Planners asked for, each once; raises ClearwayError for a name that does not exist."""
    from clearway.sim.baselines import check_planner_name

    return list(dict.fromkeys(check_planner_name(name) for name in split_names(names)))


def _every_kind() -> list[EncounterSettings]:
    from clearway.studies.encounters.encounter import STANDARD_KINDS

    return list(STANDARD_KINDS)


def fly_encounters_with_bar(
    settings: EncounterSettings, seeds: Sequence[int], workers: int, planner: str
) -> EncounterTally:
    """Fly encounters with a progress bar on standard error."""
    from clearway.studies.encounters.flights import fly_encounters

    with progress_bar(f"{planner}: {settings.in_words}", len(seeds)) as bar:
        return fly_encounters(settings, seeds, workers, bar.advance, planner)


def _summary(tally: EncounterTally) -> dict[str, Any]:
    low, high = tally.interval
    settings = tally.settings
    values = {
        "kind": settings.in_words,
        "planner": tally.planner,
        "hidden": tally.hidden,
        "detected_at_m": settings.detected_at_m,
        "deviates": settings.deviates,
        "spread_deg": [math.degrees(spread) for spread in settings.spread_rad]
        if settings.deviates
        else [0.0, 0.0],
        "position_noise_m": settings.position_noise_m,
        "velocity_noise_mps": settings.velocity_noise_mps,
        "late_s": settings.late_s,
        "miss_m": settings.miss_m,
        "scale": settings.scale,
        "encounters": len(tally.outcomes),
        "avoidable": tally.avoidable,
        "kept": tally.kept,
        "share": tally.share,
        "wilson_95": [low, high],
        "required": tally.required,
        "verdict": str(tally.verdict),
        "min_distance_m": finite(tally.min_distance_m),
        "distance_to_keep_m": tally.distance_to_keep_m,
        "with_emergency": sum(outcome.emergencies > 0 for outcome in tally.outcomes),
        "failures": [outcome.seed for outcome in tally.failures],
        "mean_aside_m": tally.mean_aside_m,
        "decision_ms": finite(tally.decision_ms),
    }
    return values | (dict.fromkeys(AVOIDING) if tally.hidden else {})


def _print_table(tallies: Sequence[EncounterTally]) -> None:
    from clearway.sim.baselines import NOT_APPLICABLE
    from clearway.sim.baselines.notes import list_shared_notes, not_known

    several = len({tally.planner for tally in tallies}) > 1
    texts = ("kind", "planner") if several else ("kind",)
    columns = ("flown", "kept of avoidable", "nearest", "target", "off path", "a decision")
    table = plain_table(texts, columns)
    for tally in tallies:
        low, high = tally.interval
        kept = (
            f"{tally.kept} of {tally.avoidable}\n{100.0 * low:.2f} to {100.0 * high:.2f} %",
            f"{tally.min_distance_m:.2f} m\nof {tally.distance_to_keep_m:g} m",
            f"{100.0 * tally.required:g} %\n{tally.verdict}",
        )
        table.add_row(
            *(tally.settings.in_words, shorten_own_name(tally.planner))[: len(texts)],
            str(len(tally.outcomes)),
            *([NOT_APPLICABLE] * len(kept) if tally.hidden else kept),
            f"{tally.mean_aside_m:.2f} m",
            f"{tally.decision_ms:.2f} ms",
        )
    print_table(table)
    print("kept: with 95 % Wilson intervals; off path: farthest from straight flight, mean;")
    print("a decision: median time")
    for line in not_known((tally.planner, tally.hidden) for tally in tallies):
        print(line)
    for line in list_shared_notes(list(dict.fromkeys(tally.planner for tally in tallies))):
        print(line)
    for tally in tallies:
        if tally.hidden:
            continue
        for outcome in tally.failures[:FAILURES_SHOWN]:
            print(f"{_kind(tally)}: {_in_words(outcome)}; see it with {_replay(tally)}")
        more = len(tally.failures) - FAILURES_SHOWN
        if more > 0:
            print(f"{_kind(tally)}: {more} more")


def _kind(tally: EncounterTally) -> str:
    """The kind of encounter, and the planner where it is not clearway."""
    by = "" if tally.planner == "clearway" else f", {tally.planner}"
    return f"{tally.settings.in_words}{by}"


def _in_words(outcome: EncounterOutcome) -> str:
    return f"seed {outcome.seed} came within {outcome.min_distance_m:.3f} m"


def _replay(tally: EncounterTally) -> str:
    """The options that fly one of these alone."""
    settings = tally.settings
    options = [f"--detected-at {settings.detected_at_m:g}"]
    if settings.late_s:
        options.append(f"--late {settings.late_s:g}")
    if settings.deviates:
        options.append("--deviates")
    if settings.noisy:
        options.append(f"--noise {settings.position_noise_m:g},{settings.velocity_noise_mps:g}")
    if settings.miss_m:
        options.append(f"--miss {settings.miss_m:g}")
    if settings.scale != 1.0:
        options.append(f"--scale {settings.scale:g}")
    if tally.planner != "clearway":
        options.append(f"--planners {tally.planner}")
    return f"{' '.join(options)} --only SEED"


def _fly_one(
    seed: int, settings: EncounterSettings, planners: Sequence[str], as_json: bool
) -> None:
    """Fly one encounter and say what was decided when."""
    from clearway.base.errors import InputError
    from clearway.studies.encounters.encounter import random_encounter
    from clearway.studies.encounters.flights import fly_encounter, judge_encounter

    if len(planners) > 1:
        raise InputError("--only", "flies one encounter: name one of --planners")
    encounter = random_encounter(seed, settings)
    run = fly_encounter(encounter, settings, planners[0])
    outcome = judge_encounter(encounter, settings, run)
    if as_json:
        print_json(
            {
                "seed": seed,
                "kind": settings.in_words,
                "planner": planners[0],
                "position_m": encounter.position_m.tolist(),
                "velocity_mps": encounter.velocity_mps.tolist(),
                "collision_s": encounter.collision_s,
                "avoidable": outcome.avoidable,
                "kept": outcome.kept,
                "min_distance_m": outcome.min_distance_m,
                "decisions": [
                    {"time_s": entry.flight.time_s, "explanation": entry.flight.explanation}
                    for entry in run.decisions
                ],
            }
        )
    else:
        place = ", ".join(f"{value:.2f}" for value in encounter.position_m)
        velocity = ", ".join(f"{value:.2f}" for value in encounter.velocity_mps)
        print(f"intruder at [{place}] m flying [{velocity}] m/s")
        print(f"straight flight meets it after {encounter.collision_s:.2f} s")
        for entry in run.decisions:
            print(f"{entry.flight.time_s:6.1f} s  {entry.flight.explanation}")
        said = "kept its distance" if outcome.kept else "came too near"
        hope = "avoidable" if outcome.avoidable else "not avoidable by any sequence of movements"
        print(f"{said}: nearest {outcome.min_distance_m:.3f} m; {hope}")
    if outcome.avoidable and not outcome.kept:
        leave(NOT_REACHED)


def _write(tallies: Sequence[EncounterTally], path: Path) -> None:
    """One row per encounter."""
    from clearway.io.staging import stage_file

    with stage_file(path) as scratch, scratch.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(CSV_COLUMNS)
        for tally in tallies:
            for each in tally.outcomes:
                rows.writerow(
                    (
                        tally.settings.in_words,
                        each.seed,
                        f"{each.min_distance_m:.6f}",
                        int(each.kept),
                        int(each.avoidable),
                        each.emergencies,
                        tally.planner,
                        f"{each.aside_m:.6f}",
                    )
                )
    say(f"wrote {path}")
