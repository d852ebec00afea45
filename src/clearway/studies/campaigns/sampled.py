"""Encounters drawn from an encounter model, as `clearway risk` draws them, as cases of a campaign.

Ownship and intruder fly in the stretched world of the risk study. The intruder's body is a ball
about the cylinder of a collision; with the margin it is one about that of a near mid-air collision.
Cases count alike here; the risk study weighs them, and asks for well clear besides.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from clearway.missions.mission_file import MissionFile
from clearway.missions.mission_sections import (
    MissionSection,
    SafetySection,
    SimulationSection,
    VehicleSection,
)
from clearway.missions.mission_traffic import RecordedAir
from clearway.missions.sections import GridSection
from clearway.missions.setup import FlightSetup
from clearway.studies.encounter_model import EncounterModel, make_up_model, read_encounter_model
from clearway.studies.risk.cylinder import Cylinder
from clearway.studies.risk.encounter import STEPS_PER_S, ModelEncounter, sample_encounter
from clearway.studies.risk.flight import VIEW
from clearway.studies.risk.settings import COLLISION, NEAR_COLLISION, RiskSettings
from clearway.traffic.recorded.playing import PlayedTrack

SETTINGS = RiskSettings()
BODY_SHARE = 0.25
"""Body radius that the margins (6.14) and (6.15) are given, of the margin."""


def _ball_m(cylinder: Cylinder) -> float:
    """Radius of the ball about a cylinder in the stretched world."""
    return float(np.hypot(cylinder.radius_m, SETTINGS.stretch * cylinder.half_height_m))


RADIUS_M = _ball_m(COLLISION)
MARGIN_M = _ball_m(NEAR_COLLISION) - RADIUS_M


@lru_cache(maxsize=2)
def model_of(path: Path | None) -> EncounterModel:
    """The model of a file, or the made-up one. Errors as of `read_encounter_model`."""
    return make_up_model() if path is None else read_encounter_model(path)


def sample_mission(seed: int, model: Path | None) -> MissionFile:
    """The ownship's flight: straight on until the encounter is over."""
    settings = SETTINGS
    far_m = settings.own_mps * _draw(seed, model).lasts_s
    movement_m = settings.own_mps * settings.movement_s
    turn_deg = settings.turn_deg_per_s * settings.movement_s
    azimuth_deg, columns, elevation_deg, rows = VIEW
    return MissionFile(
        mission=MissionSection(
            name=f"sampled-{seed}",
            waypoints_m=((far_m, 0.0, 0.0),),
            reach_radius_m=1.5 * movement_m,
        ),
        vehicle=VehicleSection(
            speed_mps=settings.own_mps,
            turn_step_deg=turn_deg,
            movement_s=settings.movement_s,
            pitch_limit_deg=settings.pitch_limit_deg,
            body_radius_m=BODY_SHARE * MARGIN_M,
        ),
        grid=GridSection(
            range_m=settings.range_movements * movement_m,
            layers=settings.range_movements,
            azimuth_deg=azimuth_deg,
            columns=columns,
            elevation_deg=elevation_deg,
            rows=rows,
        ),
        safety=SafetySection(margin_m=MARGIN_M),
        simulation=SimulationSection(seed=seed),
        lidar=(),
    )


def with_intruder(setup: FlightSetup, seed: int, model: Path | None) -> FlightSetup:
    """The flight with the intruder on its sampled track, reported every second."""
    encounter = _draw(seed, model)
    upwards = np.array([1.0, 1.0, SETTINGS.stretch])
    told = slice(None, None, STEPS_PER_S)
    track = PlayedTrack(
        "intruder",
        encounter.time_s[told],
        encounter.position_m[told] * upwards,
        encounter.velocity_mps[told] * upwards,
        np.zeros(len(encounter.time_s[told])),
        radius_m=RADIUS_M,
    )
    return replace(setup, recorded=RecordedAir((track,), np.inf, ()))


@lru_cache(maxsize=4)
def _draw(seed: int, model: Path | None) -> ModelEncounter:
    return sample_encounter(model_of(model), seed, SETTINGS)
