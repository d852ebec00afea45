"""One encounter of a study again: what was decided when, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.units import FOOT_M, KNOT_MPS
from clearway.studies.encounter_model import EncounterModel
from clearway.studies.figures.risk import EncounterTracks
from clearway.studies.risk.encounter import ModelEncounter, sample_encounter
from clearway.studies.risk.flight import (
    STEP_S,
    Separation,
    fly_model_encounter,
    separation,
    true_path_m,
)
from clearway.studies.risk.long_flight import fly_long
from clearway.studies.risk.long_planners import Steer
from clearway.studies.risk.settings import STRAIGHT, RiskSettings


@dataclass(frozen=True, eq=False)
class Replayed:
    """An encounter with all that was decided in it."""

    encounter: ModelEncounter
    said: Mapping[str, Sequence[tuple[float, str]]]
    """By planner: what was decided when."""
    separations: Mapping[str, Separation]
    """By planner, and of straight flight."""
    tracks: EncounterTracks

    def lines(self) -> list[str]:
        """What happened, for people."""
        encounter = self.encounter
        x, y, z = encounter.position_m[0]
        speed = float(np.linalg.norm(encounter.velocity_mps[0, :2])) / KNOT_MPS
        lines = [
            f"intruder enters at [{x:.0f}, {y:.0f}, {z:.0f}] m with {speed:.0f} kt and "
            f"{encounter.velocity_mps[0, 2] / FOOT_M * 60.0:.0f} ft/min; weight "
            f"{encounter.weight:.3g}; {encounter.lasts_s:.0f} s flown"
        ]
        for planner, told in self.said.items():
            lines.append(f"{planner}:")
            before = ""
            for time_s, words in told:
                if words != before:
                    lines.append(f"{time_s:6.1f} s  {words}")
                before = words
        lines += [f"{name}: {_in_words(came)}" for name, came in self.separations.items()]
        return lines

    def as_dict(self) -> dict[str, Any]:
        """The same for machines."""
        encounter = self.encounter
        return {
            "number": encounter.number,
            "weight": encounter.weight,
            "lasts_s": encounter.lasts_s,
            "position_m": encounter.position_m[0].tolist(),
            "velocity_mps": encounter.velocity_mps[0].tolist(),
            "outcomes": {name: asdict(came) for name, came in self.separations.items()},
            "decisions": {
                planner: [{"time_s": time_s, "explanation": words} for time_s, words in told]
                for planner, told in self.said.items()
            },
        }


def replay_encounter(
    model: EncounterModel,
    number: int,
    planners: Sequence[str],
    settings: RiskSettings,
    seed: int = 0,
) -> Replayed:
    """Draw the encounter of a number once more and fly it with every planner."""
    encounter = sample_encounter(model, number, settings, seed)
    time_s = np.arange(0.0, encounter.lasts_s + 0.5 * STEP_S, STEP_S)
    straight = np.zeros((len(time_s), 3))
    straight[:, 0] = settings.own_mps * time_s
    other = encounter.at_all(time_s)
    separations = {STRAIGHT: separation(straight, other, settings)}
    said, flown = {}, {}
    for planner in planners:
        when, own, said[planner] = _fly(encounter, planner, settings)
        beside = encounter.at_all(when)
        flown[planner] = (when, own, beside)
        separations[planner] = separation(own, beside, settings)
    title = f"encounter {number}: {settings.in_words}"
    tracks = EncounterTracks(title, time_s, other, straight, flown)
    return Replayed(encounter, said, separations, tracks)


def _fly(
    encounter: ModelEncounter, planner: str, settings: RiskSettings
) -> tuple[FloatArray, FloatArray, list[tuple[float, str]]]:
    """Times [n], true own path [n, 3], and what was stated when."""
    if settings.vehicle:
        flight = fly_long(encounter, planner, settings)
        told = [
            (time_s, steer.reason or _describe_steering(steer)) for time_s, steer in flight.steered
        ]
        return flight.time_s, flight.own_m, told
    run = fly_model_encounter(encounter, planner, settings)
    told = [(entry.flight.time_s, entry.flight.explanation) for entry in run.decisions]
    return run.time_s, true_path_m(run, settings), told


def _describe_steering(steer: Steer) -> str:
    course = float(np.degrees(steer.course_rad))
    return f"course {course:.0f} deg, {steer.speed_mps:.0f} m/s, climb {steer.climb_mps:.1f} m/s"


def _in_words(came: Separation) -> str:
    worst = "well clear"
    for flag, words in (
        (came.collision, "collision"),
        (came.near_collision, "near mid-air collision"),
        (came.lost_well_clear, "loss of well clear"),
    ):
        if flag:
            worst = words
            break
    return f"{worst}, nearest {came.nearest_m / FOOT_M:.0f} ft"
