"""Settings fitted to a model: a cylinder high enough for what falls, time enough for what creeps.

An encounter begins where an aircraft enters the cylinder, so the cylinder's height is the warning
that a falling aircraft gives. 1500 ft are 45 s at the 2000 ft/min of light aircraft. Skydivers fall
six times as fast, and get a cylinder six times as high.
"""

from __future__ import annotations

from dataclasses import replace

from clearway.base.units import FOOT_M
from clearway.studies.encounter_model import EncounterModel
from clearway.studies.encounter_model.conventions import CLIMB, SPEED
from clearway.studies.risk.settings import RiskSettings

WARNING_S = 45.0
"""Time from the cylinder's end to its middle, at the fastest climb of a model."""
SLOW_KT = 100.0
"""Models whose aircraft are all slower have many that barely close in on an ownship."""


def fit_height(settings: RiskSettings, model: EncounterModel) -> RiskSettings:
    """Return settings whose cylinder is as high as the model's fastest aircraft need."""
    fastest_mps = max(map(abs, model.span(CLIMB))) * model.climb_mps
    needed_ft = round(fastest_mps * WARNING_S / FOOT_M, 3)
    return replace(settings, half_height_ft=max(settings.half_height_ft, needed_ft))


def is_slow(model: EncounterModel) -> bool:
    """Return whether no aircraft of the model flies faster than SLOW_KT."""
    return model.drifts or model.span(SPEED)[1] < SLOW_KT
