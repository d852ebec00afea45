"""Which losses of well clear no manoeuvre avoids: `python -m tools.foresight MODEL --count 1000`.

Encounters of a risk study are searched with the future known (`clearway.studies.risk.foresight`).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from clearway.base.intervals import bound_weighted_share
from clearway.studies.encounter_model import read_encounter_model
from clearway.studies.risk.encounter import sample_encounter
from clearway.studies.risk.flight import separation_of
from clearway.studies.risk.foresight import foreseen
from clearway.studies.risk.settings import STRAIGHT, RiskSettings


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("--vehicle", default="copter")
    parser.add_argument("--surveillance", default="ads-b")
    parser.add_argument("--range-m", type=float, default=2000.0)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=101)
    given = parser.parse_args()
    model = read_encounter_model(given.model)
    settings = RiskSettings.real_scale(given.vehicle, given.surveillance, given.range_m)
    weights, flags = [], []
    for number in range(given.count):
        encounter = sample_encounter(model, number, settings, given.seed)
        came = separation_of(encounter, STRAIGHT, settings)[0]
        if came.lost_well_clear:
            found = foreseen(encounter, settings)
            weights.append(encounter.weight)
            flags.append((not found.well_clear, came.near_collision, not found.near_collision))
    weight, (lost, near, hit) = np.array(weights), np.array(flags).T
    share = bound_weighted_share(lost, weight)
    print(f"{settings.in_words}: {len(weight)} of {given.count} lose well clear if flown straight")
    print(
        f"no manoeuvre keeps it in {share.value:.3f} ({share.low:.3f} to {share.high:.3f}) of them"
    )
    share = bound_weighted_share(hit[near], weight[near])
    print(
        f"and of {near.sum()} near collisions none avoids {share.value:.4f} "
        f"({share.low:.4f} to {share.high:.4f})"
    )


if __name__ == "__main__":
    main()
