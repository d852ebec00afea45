"""Risk ratio against detour: `python -m tools.equal_detour MODEL --count 200 --out FOLDER`.

Planners avoid more or less: clearway by what detours cost beside risk, its rivals by the zone that
they keep. All variants fly the same encounters; each planner is a curve.
"""

from __future__ import annotations

import argparse
import json
from functools import partial
from pathlib import Path
from typing import Any

from clearway.avoidance.long_range.resolve import RiskPrices
from clearway.studies.encounter_model import read_encounter_model
from clearway.studies.figures.risk_curves import draw_detour_curves
from clearway.studies.risk.encounter import sample_encounter
from clearway.studies.risk.flight import separation, separation_of
from clearway.studies.risk.long_flight import fly_long
from clearway.studies.risk.long_planners import (
    LongPlanner,
    LongTuning,
    avoid_velocity_obstacles,
    by_resolver,
    make_modified_voltage,
)
from clearway.studies.risk.outcome import RiskOutcome
from clearway.studies.risk.ratios import LARGEST_RATIOS, compute_risk, mean_aside_m
from clearway.studies.risk.settings import STRAIGHT, RiskSettings
from clearway.studies.risk.study import RiskStudy

DETOURS = (4.0, 1.0, 0.25)
"""What detours cost clearway, as times of what they cost by default."""
ZONES = (0.7, 1.1, 1.8, 3.0)
"""Of the outermost volume with its buffer, that rivals keep."""


def variants() -> dict[str, dict[str, LongPlanner]]:
    """By planner, its variants, from little detour to much."""
    usual = RiskPrices()
    dearer = [
        RiskPrices(turn=usual.turn * by, slow=usual.slow * by, climb=usual.climb * by,
                   off_height=usual.off_height * by)
        for by in DETOURS
    ]  # fmt: skip
    return {
        "clearway": {
            f"detours x {by:g}": partial(by_resolver, prices=prices)
            for by, prices in zip(DETOURS, dearer, strict=True)
        },
        "mvp": {
            f"zone {zone:g}": partial(make_modified_voltage, tuning=LongTuning(zone, 60.0))
            for zone in ZONES
        },
        "velocity-obstacle": {
            f"zone {zone:g}": partial(avoid_velocity_obstacles, tuning=LongTuning(zone, 60.0))
            for zone in ZONES
        },
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("--vehicle", default="copter")
    parser.add_argument("--range-m", type=float, default=4000.0)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=101)
    parser.add_argument("--out", type=Path, default=Path())
    given = parser.parse_args()
    model = read_encounter_model(given.model)
    settings = RiskSettings.real_scale(given.vehicle, range_m=given.range_m)
    of = variants()
    flying = {f"{name}, {kind}": one for name, kinds in of.items() for kind, one in kinds.items()}
    outcomes = []
    for number in range(given.count):
        encounter = sample_encounter(model, number, settings, given.seed)
        flown = {}
        for label, planner in flying.items():
            flight = fly_long(encounter, planner, settings)
            flown[label] = separation(flight.own_m, flight.other_m, settings)
        straight = separation_of(encounter, STRAIGHT, settings)[0]
        none = dict.fromkeys(flying, 0)
        outcomes.append(
            RiskOutcome(number, encounter.weight, encounter.layer, straight, flown, none)
        )
    result = RiskStudy(settings, tuple(flying), given.seed, tuple(outcomes))
    curves: dict[str, list[dict[str, Any]]] = {name: [] for name in of}
    for name, kinds in of.items():
        for kind in kinds:
            label = f"{name}, {kind}"
            row: dict[str, Any] = {"kind": kind, "aside_m": mean_aside_m(result, label)}
            for measure in LARGEST_RATIOS:
                ratio = compute_risk(result, label, measure).ratio
                row[measure] = list(ratio)
            curves[name].append(row)
            print(f"{label}: {row['aside_m']:.0f} m aside; " + "; ".join(
                "{} {:.3f} ({:.3f} to {:.3f})".format(measure, *row[measure])
                for measure in LARGEST_RATIOS
            ))  # fmt: skip
    given.out.mkdir(parents=True, exist_ok=True)
    told = {"kind": settings.in_words, "encounters": given.count, "curves": curves}
    (given.out / "detour-curves.json").write_text(json.dumps(told, indent=1), encoding="utf-8")
    draw_detour_curves(told).savefig(given.out / "risk-detour.png", dpi=110)


if __name__ == "__main__":
    main()
