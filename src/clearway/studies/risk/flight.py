"""One encounter flown by a planner, and how near the two came in true feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sim import OnDecision, Run, SimulationSettings, simulate
from clearway.sim.baselines import Craft, pilot_named
from clearway.sim.pilot import Steering
from clearway.studies.risk.cylinder import Cylinder
from clearway.studies.risk.encounter import ModelEncounter
from clearway.studies.risk.long_flight import fly_long
from clearway.studies.risk.settings import (
    COLLISION,
    NEAR_COLLISION,
    STRAIGHT,
    WELL_CLEAR,
    RiskSettings,
)
from clearway.traffic import Intruder
from clearway.traffic.volumes.named import SMALL_WELL_CLEAR
from clearway.vehicle.automaton import MovementAutomaton

INTRUDER = "intruder"
BODY_SHARE = 0.25
"""Body radius that the margins (6.14) and (6.15) are given, of the margin: as 0.3 of 1.2 m."""
STEP_S = 0.05
LEFT_M = 1.0
"""Nearer than this to its place in straight flight, an ownship has not manoeuvred."""
VIEW = (100.0, 15, 65.0, 9)
"""Half of the grid's azimuth in degrees, its columns; half of its elevation, its rows. Reports come
from all around, and a plan that soon leaves the grid is checked against too little of the
future."""


@dataclass(frozen=True, slots=True)
class Separation:
    """How near ownship and intruder came in one encounter."""

    collision: bool
    near_collision: bool
    """Within 500 ft and 100 ft at once."""
    lost_well_clear: bool
    """Within 2000 ft and 250 ft at once."""
    margin_lost: bool
    """Within the ball that planners keep, in the stretched world."""
    nearest_m: float
    """In the true world."""
    aside_m: float
    """Farthest from straight flight, in the true world: what avoiding cost."""
    side_reversals: int = 0
    """How often the side of passing was changed, at real scale."""
    sense_reversals: int = 0
    """How often climbing became sinking, or the other way round."""
    manoeuvred: bool = False
    """Whether the ownship was ever more than LEFT_M from where straight flight has it."""
    extra_path_m: float = 0.0
    """Path flown, and from its end to that of straight flight, less the latter's."""


@lru_cache(maxsize=4)
def craft_of(settings: RiskSettings) -> Craft:
    """The ownship in the stretched world."""
    turn_deg = settings.turn_deg_per_s * settings.movement_s
    automaton = MovementAutomaton.plane(
        settings.own_mps,
        turn_deg,
        duration_s=settings.movement_s,
        pitch_limit_deg=settings.pitch_limit_deg,
    )
    range_m = settings.range_movements * settings.own_mps * settings.movement_s
    azimuth_deg, columns, elevation_deg, rows = VIEW
    grid = AvoidanceGrid.uniform(
        range_m,
        settings.range_movements,
        azimuth_deg=azimuth_deg,
        columns=columns,
        elevation_deg=elevation_deg,
        rows=rows,
    )
    library = ReachLibrary.load_or_build(automaton, grid)
    planner = Planner.of(
        library,
        AvoidanceSettings(
            safety_margin_m=settings.spare * settings.margin_m, transponder_address="ownship"
        ),
    )
    return Craft(planner, BODY_SHARE * settings.margin_m, automaton.turning_radius_m)


class EncounterTraffic:
    """The intruder of an encounter in the stretched world, as simulations ask for traffic."""

    def __init__(self, encounter: ModelEncounter, settings: RiskSettings) -> None:
        self.tracks: dict[str, list[tuple[float, FloatArray]]] = {INTRUDER: []}
        self._encounter, self._settings = encounter, settings
        self._upwards = np.array([1.0, 1.0, settings.stretch])
        self._rng = np.random.default_rng([encounter.number, 71])
        self._next_report_s = 0.0

    def step(self, own: State) -> None:
        """Move on to the time of the own true state."""
        position, _ = self._encounter.at(own.time_s)
        self.tracks[INTRUDER].append((own.time_s, position * self._upwards))

    def reports(self, time_s: float) -> list[Intruder]:
        """What the intruder reports at a time."""
        if time_s < self._next_report_s - 1e-9:
            return []
        settings = self._settings
        self._next_report_s = time_s + settings.report_s
        position, velocity = self._encounter.at(time_s)
        noise = self._rng.normal(0.0, 1.0, (2, 3))
        return [
            Intruder(
                position * self._upwards + settings.position_std_m * noise[0],
                velocity * self._upwards + settings.velocity_std_mps * noise[1],
                name=INTRUDER,
                time_s=time_s,
                position_std_m=settings.position_std_m,
                velocity_std_mps=settings.velocity_std_mps,
            )
        ]

    def bodies(self, time_s: float) -> list[Obstacle]:
        """None: it is reported only."""
        del time_s
        return []

    def radii_m(self) -> dict[str, float]:
        """The margin is kept from its centre."""
        return {INTRUDER: 0.0}


def fly_model_encounter(
    encounter: ModelEncounter,
    planner: str,
    settings: RiskSettings,
    on_decision: OnDecision[Steering] | None = None,
) -> Run[Steering]:
    """The encounter flown in the stretched world; `true_path_m` undoes the stretching."""
    craft = craft_of(settings)
    far_m = settings.own_mps * (settings.within_s + settings.afterwards_s) + 1e4
    reach_m = 0.4 * craft.planner.automaton.turning_radius_m
    mission = Mission(
        f"encounter {encounter.number}",
        State(np.zeros(3)),
        waypoints_m=np.array([[far_m, 0.0, 0.0]]),
        reach_radius_m=reach_m,
    )
    system = AvoidanceSystem(craft.planner, mission)
    return simulate(
        pilot_named(planner, system, craft),
        ObstacleMap(),
        lidars=(),
        settings=SimulationSettings(
            seed=encounter.number, step_s=STEP_S, time_limit_s=encounter.lasts_s
        ),
        on_decision=on_decision,
        traffic=EncounterTraffic(encounter, settings),
    )


def true_path_m(run: Run[Steering], settings: RiskSettings) -> FloatArray:
    """[n, 3] positions flown, in the true world."""
    path: FloatArray = run.states[:, :3] / np.array([1.0, 1.0, settings.stretch])
    return path


class DecisionEffort(NamedTuple):
    """Of the decisions of one flight."""

    emergencies: int = 0
    """In which nothing kept the margin."""
    median_ms: float | None = None
    """What one took to compute; None without any."""


def separation_of(
    encounter: ModelEncounter, planner: str, settings: RiskSettings
) -> tuple[Separation, DecisionEffort]:
    """How near it came with a planner, and what its decisions were like."""
    if settings.vehicle and planner != STRAIGHT:
        flown = fly_long(encounter, planner, settings)
        came = separation(flown.own_m, flown.other_m, settings)
        return replace(
            came,
            side_reversals=flown.side_reversals,
            sense_reversals=flown.sense_reversals,
            **_detour(flown.time_s, flown.own_m, settings),
        ), DecisionEffort(0, _median_ms(flown.decision_s))
    if planner == STRAIGHT:
        time_s = np.arange(0.0, encounter.lasts_s + 0.5 * STEP_S, STEP_S)
        own = np.zeros((len(time_s), 3))
        own[:, 0] = settings.own_mps * time_s
        return separation(own, encounter.at_all(time_s), settings), DecisionEffort()
    run = fly_model_encounter(encounter, planner, settings)
    own = true_path_m(run, settings)
    took_ms = _median_ms([entry.elapsed_s for entry in run.decisions])
    effort = DecisionEffort(run.emergencies, took_ms)
    came = separation(own, encounter.at_all(run.time_s), settings)
    return replace(came, **_detour(run.time_s, own, settings)), effort


def _detour(time_s: FloatArray, own_m: FloatArray, settings: RiskSettings) -> dict[str, Any]:
    """Return whether a path [n, 3] leaves straight flight, and how much longer it is."""
    straight = own_m[0] + settings.own_mps * time_s[:, None] * np.array([1.0, 0.0, 0.0])
    flown_m = float(np.linalg.norm(np.diff(own_m, axis=0), axis=1).sum())
    left_m = float(np.linalg.norm(straight[-1] - own_m[-1]))
    off_m = np.linalg.norm(own_m - straight, axis=1)
    return {
        "manoeuvred": bool(off_m.max() > LEFT_M),
        "extra_path_m": max(0.0, flown_m + left_m - settings.own_mps * float(time_s[-1])),
    }


def _median_ms(elapsed_s: Sequence[float]) -> float | None:
    return 1e3 * float(np.median(elapsed_s)) if elapsed_s else None


def separation(own_m: FloatArray, other_m: FloatArray, settings: RiskSettings) -> Separation:
    """Of two true paths [n, 3] at the same times."""
    off = other_m - own_m
    level, height = np.hypot(off[:, 0], off[:, 1]), np.abs(off[:, 2])

    def within(cylinder: Cylinder) -> bool:
        return bool(np.any((level < cylinder.radius_m) & (height < cylinder.half_height_m)))

    return Separation(
        collision=within(COLLISION),
        near_collision=within(NEAR_COLLISION),
        lost_well_clear=within(WELL_CLEAR),
        margin_lost=_margin_lost(level, height, settings),
        nearest_m=float(np.hypot(level, height).min()),
        aside_m=float(np.hypot(own_m[:, 1], own_m[:, 2]).max()),
    )


def _margin_lost(level: FloatArray, height: FloatArray, settings: RiskSettings) -> bool:
    """Whether what planners keep was lost: the ball, at real scale well clear with buffer."""
    if settings.vehicle:
        kept = SMALL_WELL_CLEAR.kept
        return bool(np.any((level < kept.radius_m) & (height < kept.half_height_m)))
    return bool(np.hypot(level, settings.stretch * height).min() < settings.margin_m)
