"""One encounter of a study again: what was decided when, and what came of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from clearway.base.units import FOOT_M, KNOT_MPS
from clearway.sim import Run
from clearway.sim.pilot import Steering
from clearway.studies.encounter_model import EncounterModel
from clearway.studies.figures.risk import EncounterTracks
from clearway.studies.risk.encounter import ModelEncounter, draw_encounter
from clearway.studies.risk.flight import STEP_S, STRAIGHT, Separation, fly, separation, true_path_m
from clearway.studies.risk.settings import RiskSettings


@dataclass(frozen=True, eq=False)
class Replayed:
    """An encounter with all that was decided in it."""

    encounter: ModelEncounter
    runs: Mapping[str, Run[Steering]]
    """By planner, in the stretched world."""
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
        for planner, run in self.runs.items():
            lines.append(f"{planner}:")
            said = ""
            for entry in run.decisions:
                if entry.flight.explanation != said:
                    lines.append(f"{entry.flight.time_s:6.1f} s  {entry.flight.explanation}")
                said = entry.flight.explanation
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
                planner: [
                    {"time_s": entry.flight.time_s, "explanation": entry.flight.explanation}
                    for entry in run.decisions
                ]
                for planner, run in self.runs.items()
            },
        }


def replayed(
    model: EncounterModel,
    number: int,
    planners: Sequence[str],
    settings: RiskSettings,
    seed: int = 0,
) -> Replayed:
    """Draw the encounter of a number once more and fly it with every planner."""
    encounter = draw_encounter(model, number, settings, seed)
    time_s = np.arange(0.0, encounter.lasts_s + 0.5 * STEP_S, STEP_S)
    straight = np.zeros((len(time_s), 3))
    straight[:, 0] = settings.own_mps * time_s
    other = encounter.at_all(time_s)
    separations = {STRAIGHT: separation(straight, other, settings)}
    runs, flown = {}, {}
    for planner in planners:
        runs[planner] = run = fly(encounter, planner, settings)
        own, beside = true_path_m(run, settings), encounter.at_all(run.time_s)
        flown[planner] = (run.time_s, own, beside)
        separations[planner] = separation(own, beside, settings)
    title = f"encounter {number}: {settings.in_words}"
    tracks = EncounterTracks(title, time_s, other, straight, flown)
    return Replayed(encounter, runs, separations, tracks)


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
