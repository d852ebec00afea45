"""What `clearway risk` was given: layers, planners and a model, checked."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from clearway.cli.given import split_names
from clearway.cli.report import say

if TYPE_CHECKING:
    from clearway.studies.encounter_model import EncounterModel
    from clearway.studies.risk.settings import RiskSettings


def choose_layers(text: str) -> tuple[int, ...]:
    """Return layers from 0 of `--layers`; raises InputError."""
    from clearway.base.errors import InputError

    try:
        numbers = tuple(int(part) for part in text.split(",") if part.strip())
    except ValueError:
        numbers = (0,)
    if any(number < 1 for number in numbers):
        raise InputError("--layers", f"numbers from 1 are needed, as in 2,3; got {text!r}")
    return tuple(number - 1 for number in numbers)


def choose_risk_planners(names: str, settings: RiskSettings) -> list[str]:
    """Return the planners asked for, each once; raises ClearwayError."""
    from clearway.sim.baselines import check_planner_name
    from clearway.studies.risk.long_choice import long_planner

    wanted = split_names(names)
    if settings.vehicle:
        for name in wanted:
            long_planner(name)
        return list(dict.fromkeys(wanted))
    chosen = [check_planner_name(name) for name in wanted]
    return list(dict.fromkeys(chosen))


def read_encounters_model(path: Path | None, settings: RiskSettings) -> EncounterModel:
    """Return the model of a file, or one with made-up numbers; raises InputError."""
    from clearway.io.public_data import find_public_data
    from clearway.studies.encounter_model import make_up_model, read_encounter_model
    from clearway.studies.risk.fit import is_slow

    if path is None:
        say("no model given: the numbers of this one are made up, not measured")
    network = make_up_model() if path is None else read_encounter_model(find_public_data(path))
    check_layers(network, settings)
    if settings.vehicle and is_slow(network) and settings.within_s < settings.crossing_s:
        say(
            f"note: many aircraft of this model are too slow to come near within "
            f"{settings.within_s:g} s: set --within-s {settings.crossing_s:g}"
        )
    return network


def check_layers(model: EncounterModel, settings: RiskSettings) -> None:
    """Raise InputError unless the model has all layers that were chosen."""
    from clearway.base.errors import InputError

    bins = model.variables[model.index("L")].bins
    if any(layer >= bins for layer in settings.layers):
        raise InputError("--layers", f"the model has layers 1 to {bins}")
