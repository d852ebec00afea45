"""Tune the rivals for traffic, fairly: on encounters that no comparison flies.

    python -m tools.tune_traffic velocity-obstacle
    python -m tools.tune_traffic mvp --count 60

Every value of the one parameter that matters is flown on the same random collision courses, heard
of at 10, 8 and 6 m; the defaults are the values that keep the distance in most of them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim import SimulationSettings, simulate
from clearway.sim.baselines import BaselinePilot, Craft, ManoeuvreRule
from clearway.sim.baselines.mvp import VoltageTuning, make_mvp
from clearway.sim.baselines.velocity_obstacle import VelocityTuning, velocity_obstacle
from clearway.sim.scripted import ScriptedIntruder, Traffic
from clearway.studies.encounters.encounter import Encounter, EncounterSettings, random_encounter
from clearway.studies.encounters.flights import (
    RADIUS_M,
    REACH_RADIUS_M,
    distance_to_keep_m,
    planner_at,
)

FIRST_SEED = 500_000
"""Comparisons count from 0, the peers from 90,000."""
DETECTED_AT_M = (10.0, 8.0, 6.0)
RULES: dict[str, tuple[tuple[float, ...], Callable[[Craft, float], ManoeuvreRule]]] = {
    "velocity-obstacle": (
        (0.0, 0.05, 0.1, 0.2, 0.3, 0.5),
        lambda craft, value: velocity_obstacle(craft, VelocityTuning(spare=value)),
    ),
    "mvp": (
        (1.05, 1.2, 1.4, 1.7, 2.0, 2.5),
        lambda craft, value: make_mvp(craft, VoltageTuning(zone=value)),
    ),
}


def main() -> None:
    """Print a line for every value."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("planner", choices=sorted(RULES))
    parser.add_argument("--count", type=int, default=30)
    options = parser.parse_args()
    values, make = RULES[options.planner]
    planner = planner_at(1.0)
    craft = Craft(planner, 0.5 * RADIUS_M, planner.automaton.turning_radius_m)
    settings = EncounterSettings()
    met = [
        random_encounter(FIRST_SEED + number, replace(settings, detected_at_m=detected_at_m))
        for detected_at_m in DETECTED_AT_M
        for number in range(options.count)
    ]
    for value in values:
        rule = make(craft, value)
        apart = np.array([_nearest(craft, rule, encounter) for encounter in met])
        kept = apart.reshape(len(DETECTED_AT_M), -1) >= distance_to_keep_m(1.0)
        each = ", ".join(
            f"{share:.2f} at {far:g} m"
            for share, far in zip(kept.mean(axis=1), DETECTED_AT_M, strict=True)
        )
        print(f"{value:5.2f}: kept {kept.mean():.3f} ({each}), nearest {apart.min():.2f} m")


def _nearest(craft: Craft, rule: ManoeuvreRule, encounter: Encounter) -> float:
    lasts_s = 1.5 * encounter.collision_s + 10.0
    mission = Mission(
        "tuning",
        State(np.zeros(3)),
        waypoints_m=np.array([[lasts_s + 30.0, 0.0, 0.0]]),
        reach_radius_m=REACH_RADIUS_M,
    )
    intruder = ScriptedIntruder(
        "intruder", 0.0, encounter.position_m, encounter.velocity_mps,
        radius_m=RADIUS_M, spawn="world",
    )  # fmt: skip
    run = simulate(
        BaselinePilot(AvoidanceSystem(craft.planner, mission), rule),
        ObstacleMap(),
        lidars=(),
        settings=SimulationSettings(time_limit_s=lasts_s),
        on_decision=None,
        traffic=Traffic([intruder], mission, craft.planner.speed_mps),
    )
    other = run.intruder_tracks["intruder"][:, 1:]
    return float(np.linalg.norm(other - run.states[:, :3], axis=1).min())


if __name__ == "__main__":
    main()
