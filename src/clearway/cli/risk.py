"""`clearway risk`: encounters of an encounter model with and without avoidance, weighed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from clearway.cli import picture_options as drawn
from clearway.cli.given import refuse_given
from clearway.cli.numbers import MOST_COUNTED, MOST_WORKERS, number_pair
from clearway.cli.progress import progress_bar
from clearway.cli.report import leave_by, print_json, say
from clearway.cli.risk_files import draw_curves, results_folder, write_study
from clearway.cli.risk_given import choose_layers, choose_risk_planners, read_encounters_model
from clearway.cli.risk_models import ModelWatch, fly_models
from clearway.cli.risk_table import print_risk

if TYPE_CHECKING:
    from clearway.io.results_folder import ResultsFolder
    from clearway.studies.encounter_model import EncounterModel
    from clearway.studies.risk.settings import RiskSettings
    from clearway.studies.risk.study import RiskStudy
    from clearway.view.plot.style import Pictures

KIND = "Kind of encounter"
SCALE = "Real scale"
RUN = "Run"
OUTPUT = "Output"
STRETCHED_ALONE = ("own_kt", "noise", "report_s", "stretch")
REAL_ALONE = ("range_m", "reaction_s", "floor_ft", "ceiling_ft", "within_s", "models")
MODELS_ALONE = ("docs",)
"""Options of one of both worlds, see docs/risk.md: the other would fly without a word of them."""


def risk(
    context: typer.Context,
    model: Annotated[
        Path | None,
        typer.Argument(
            help="Encounter model in the text format of MIT Lincoln Laboratory; default: made up."
        ),
    ] = None,
    models: Annotated[
        Path | None,
        typer.Option(
            help="Folder of encounter models: fly each of them, instead of one MODEL; --journal is "
            "a folder then.",
            rich_help_panel=KIND,
        ),
    ] = None,
    docs: Annotated[
        list[Path] | None,
        typer.Option(
            help="With --models: put the tables between the marks of a Markdown page.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    curves: Annotated[
        list[Path] | None,
        typer.Option(
            help="Fly nothing: draw the results of earlier studies at real scale (risk.json) into "
            "--out; may be repeated.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    planners: Annotated[
        str,
        typer.Option(help="Names with commas between, of {planners}.", rich_help_panel=RUN),
    ] = "clearway",
    count: Annotated[
        int,
        typer.Option(min=1, max=MOST_COUNTED, help="Number of encounters.", rich_help_panel=RUN),
    ] = 500,
    first: Annotated[
        int, typer.Option(min=0, help="Number of the first one.", rich_help_panel=RUN)
    ] = 0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all of them.", rich_help_panel=RUN)] = 0,
    only: Annotated[
        int | None,
        typer.Option(min=0, help="Fly this one alone, draw and explain it.", rich_help_panel=RUN),
    ] = None,
    workers: Annotated[
        int,
        typer.Option(min=1, max=MOST_WORKERS, help="Processes side by side.", rich_help_panel=RUN),
    ] = 2,
    own_kt: Annotated[
        float, typer.Option(help="Speed of the ownship in knots.", rich_help_panel=KIND)
    ] = 50.0,
    noise: Annotated[
        str,
        typer.Option(
            help="Noise of reports, metres,m/s; in height it is divided by --stretch.",
            rich_help_panel=KIND,
        ),
    ] = "0,0",
    report_s: Annotated[
        float, typer.Option(help="Seconds between reports.", rich_help_panel=KIND)
    ] = 1.0,
    stretch: Annotated[
        float, typer.Option(help="Factor on heights when it decides.", rich_help_panel=KIND)
    ] = 4.0,
    vehicle: Annotated[
        str | None,
        typer.Option(
            help="Fly at real scale with this airframe: {vehicles}.", rich_help_panel=SCALE
        ),
    ] = None,
    surveillance: Annotated[
        str | None,
        typer.Option(help="How intruders are known: {surveillances}.", rich_help_panel=SCALE),
    ] = None,
    range_m: Annotated[
        float | None,
        typer.Option(
            help="How far intruders are heard, in metres; default: by --surveillance.",
            rich_help_panel=SCALE,
        ),
    ] = None,
    reaction_s: Annotated[
        float | None,
        typer.Option(help="Seconds from a decision to the controls.", rich_help_panel=SCALE),
    ] = None,
    floor_ft: Annotated[
        float, typer.Option(help="Least height above ground, in feet.", rich_help_panel=SCALE)
    ] = 50.0,
    ceiling_ft: Annotated[
        float, typer.Option(help="Greatest height, in feet.", rich_help_panel=SCALE)
    ] = 6000.0,
    within_s: Annotated[
        float | None,
        typer.Option(
            help="Time that aircraft have to come near, in seconds; default 200 for 3 nmi, with "
            "--models until the ownship has met what stands still.",
            rich_help_panel=SCALE,
        ),
    ] = None,
    limits: Annotated[
        str,
        typer.Option(
            help="Largest ratios allowed: near mid-air collision,loss of well clear.",
            rich_help_panel=OUTPUT,
        ),
    ] = "0.18,0.40",
    journal: Annotated[
        Path | None,
        typer.Option(
            help="File that keeps outcomes as they come, so that an interrupted study goes on.",
            rich_help_panel=RUN,
        ),
    ] = None,
    layers: Annotated[
        str,
        typer.Option(help="Altitude layers of the model, from 1, as in 2,3.", rich_help_panel=KIND),
    ] = "",
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object.", rich_help_panel=OUTPUT)
    ] = False,
    form: drawn.Form = drawn.FORM,
    dpi: drawn.Dpi = drawn.DPI,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for encounters.csv and risk.json, or with --only for the picture.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
) -> None:
    """Compute risk ratios by an encounter model, and check them against ASTM F3442 or your limits.

    The upper ends of the 95 % intervals count. Exit status 0: the first planner is within the
    limits; 1: it is not; 3: too few encounters to tell.
    """
    from clearway.studies.risk.fit import fit_height
    from clearway.studies.risk.ratios import LARGEST_LIMIT, RiskLimits
    from clearway.studies.risk.settings import RiskSettings
    from clearway.studies.risk.summary import summary, verdict_of

    if curves:
        draw_curves(curves, out, drawn.pictures_of(form, dpi))
        return
    position_std, velocity_std = number_pair("--noise", noise, "15,1")
    asked = RiskLimits(*number_pair("--limits", limits, "0.18,0.40", LARGEST_LIMIT))
    if vehicle is not None or surveillance is not None:
        refuse_given(
            context,
            STRETCHED_ALONE,
            "is of the stretched world: leave out --vehicle and --surveillance",
        )
        settings = RiskSettings.real_scale(
            vehicle or "wing",
            surveillance or "ads-b",
            range_m,
            reaction_s=reaction_s,
            floor_ft=floor_ft,
            ceiling_ft=ceiling_ft,
            surveillance_seed=seed,
            **({} if within_s is None else {"within_s": within_s}),
            layers=choose_layers(layers),
        )
    else:
        refuse_given(context, REAL_ALONE, "is for --vehicle or --surveillance")
        settings = RiskSettings(
            own_kt=own_kt,
            stretch=stretch,
            report_s=report_s,
            position_std_m=position_std,
            velocity_std_mps=velocity_std,
            layers=choose_layers(layers),
        )
    names = choose_risk_planners(planners, settings)
    if models is not None:
        refuse_given(context, ("model", "only"), "is of one model: leave out --models")
        if within_s is None:
            settings = replace(settings, within_s=settings.crossing_s)
        numbers = range(first, first + count)
        watch = ModelWatch(docs or [], journal, results_folder(out, models, None), as_json)
        fly_models(models, names, numbers, settings, seed, workers, asked, watch)
        return
    refuse_given(context, MODELS_ALONE, "is for --models")
    network = read_encounters_model(model, settings)
    settings = fit_height(settings, network) if settings.vehicle else settings
    folder, pictures = results_folder(out, model, only), drawn.pictures_of(form, dpi)
    if only is not None:
        _fly_one(network, only, names, settings, seed, folder, as_json, pictures)
        return
    numbers = range(first, first + count)
    result = _fly_with_bar(network, names, numbers, settings, seed, workers, journal)
    told = summary(result, network, asked)
    if as_json:
        print_json(told)
    else:
        print_risk(result, told)
    if folder is not None:
        write_study(result, told, folder)
    leave_by([verdict_of(told["planners"][names[0]])])


def _fly_with_bar(
    model: EncounterModel,
    planners: Sequence[str],
    numbers: Sequence[int],
    settings: RiskSettings,
    seed: int,
    workers: int,
    journal: Path | None,
) -> RiskStudy:
    """Fly the study with a progress bar on standard error."""
    from clearway.studies.risk.study import study

    with progress_bar("encounters", len(numbers)) as bar:
        return study(model, planners, numbers, settings, seed, workers, bar.advance, journal)


def _fly_one(
    model: EncounterModel,
    number: int,
    planners: Sequence[str],
    settings: RiskSettings,
    seed: int,
    folder: ResultsFolder | None,
    as_json: bool,
    pictures: Pictures,
) -> None:
    """Fly one encounter with every planner; draw it, and say what was decided when."""
    from clearway.studies.risk.replay import replay_encounter

    told = replay_encounter(model, number, planners, settings, seed)
    if as_json:
        print_json(told.as_dict())
    else:
        for line in told.lines():
            print(line)
    if folder is not None:
        from clearway.studies.figures.risk import draw_encounter
        from clearway.view.plot.style import house_style

        with folder.write() as scratch, house_style():
            name = pictures.save(draw_encounter(told.tracks), scratch, f"encounter-{number}")
        say(f"wrote {name} to {folder.path}")
