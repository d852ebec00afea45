"""Encounters flown by the thousand: how many keep their distance, and which do not.

Every encounter is one short simulated flight without sensors or obstacles, distinguished by its
seed alone, so that results do not depend on how many processes share the work.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial

import numpy as np

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.errors import ClearwayError
from clearway.base.grid import AvoidanceGrid
from clearway.base.intervals import wilson
from clearway.base.state import State
from clearway.base.verdict import DemandVerdict, judge_at_least
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sim import Run, SimulationSettings, simulate
from clearway.sim.baselines import CLEARWAY, PLANNERS, REPORTED_TRAFFIC, Craft, pilot_named
from clearway.sim.pilot import Steering
from clearway.sim.scripted import ScriptedIntruder, Traffic, TrafficSettings
from clearway.studies.encounters.avoidable import Opponent, search_avoidance
from clearway.studies.encounters.encounter import Encounter, EncounterSettings, random_encounter
from clearway.studies.processes import run_in_processes
from clearway.traffic import TrackerSettings
from clearway.vehicle.automaton import MovementAutomaton

SPEED_MPS = 1.0
RANGE_M = 10.0
SAFETY_MARGIN_M = 0.6
RADIUS_M = 0.6
REACH_RADIUS_M = 1.5
"""The ownship of 6.5 and its intruders, at scale 1."""
BODY_RADIUS_M = 0.3
"""Of the ownship, which the margins (6.14) and (6.15) of rivals are given."""
AFTERWARDS_S = 10.0
"""Flown on after the straight flights have met, and half as long again as it took them."""
CHUNK = 25
"""Encounters that a process flies at a time."""


@dataclass(frozen=True, slots=True)
class EncounterOutcome:
    """What came of one encounter."""

    seed: int
    min_distance_m: float
    """Between centres, at equal times."""
    kept: bool
    """Never nearer than safety margin and body radius together."""
    avoidable: bool
    """Whether any sequence of movements keeps that distance from straight flight."""
    emergencies: int
    """Decisions in which nothing kept the margin."""
    aside_m: float = 0.0
    """Farthest from straight flight: what avoiding cost."""
    decision_ms: float = field(default=float("nan"), compare=False)
    """Median of its decisions."""


@dataclass(frozen=True, slots=True)
class EncounterTally:
    """What came of many encounters of one kind."""

    settings: EncounterSettings
    outcomes: tuple[EncounterOutcome, ...]
    """Ascending by seed."""
    planner: str = CLEARWAY
    """Who flew, as asked for."""

    @property
    def hidden(self) -> str:
        """What of an encounter the planner cannot know, in words; empty for nothing."""
        return PLANNERS.find(self.planner).describe_hidden([REPORTED_TRAFFIC])

    @property
    def mean_aside_m(self) -> float:
        """Farthest from straight flight, mean over all encounters."""
        return float(np.mean([outcome.aside_m for outcome in self.outcomes]))

    @property
    def decision_ms(self) -> float:
        """Median over encounters of their median."""
        return float(np.median([outcome.decision_ms for outcome in self.outcomes]))

    @property
    def avoidable(self) -> int:
        return sum(outcome.avoidable for outcome in self.outcomes)

    @property
    def kept(self) -> int:
        """Of the avoidable ones."""
        return sum(outcome.kept for outcome in self.outcomes if outcome.avoidable)

    @property
    def share(self) -> float:
        """Kept, of the avoidable ones; 1 where none is."""
        return self.kept / self.avoidable if self.avoidable else 1.0

    @property
    def interval(self) -> tuple[float, float]:
        return wilson(self.kept, self.avoidable)

    @property
    def verdict(self) -> DemandVerdict:
        """Whether it is shown that enough keep their distance."""
        return judge_at_least(*self.interval, self.required)

    @property
    def failures(self) -> tuple[EncounterOutcome, ...]:
        """Avoidable encounters that came too near."""
        return tuple(each for each in self.outcomes if each.avoidable and not each.kept)

    @property
    def min_distance_m(self) -> float:
        """Smallest distance in an avoidable encounter; inf without any."""
        return min((o.min_distance_m for o in self.outcomes if o.avoidable), default=float("inf"))

    @property
    def distance_to_keep_m(self) -> float:
        return distance_to_keep_m(self.settings.scale)

    @property
    def required(self) -> float:
        """Share that must be kept: less where reports are noisy or come late."""
        late = self.settings.detected_at_m < RANGE_M or self.settings.late_s > 0.0
        return 0.99 if self.settings.noisy or late else 0.999


@lru_cache(maxsize=2)
def planner_at(scale: float, *, tracks: bool = False) -> Planner:
    """The planner of 6.5, all its lengths and speeds multiplied alike; tracks: by a tracker."""
    library = ReachLibrary.load_or_build(
        MovementAutomaton.plane(speed_mps=SPEED_MPS * scale),
        AvoidanceGrid.uniform(RANGE_M * scale),
    )
    tracker = TrackerSettings(acceleration_std_mps2=0.3 * scale, hardest_mps2=30.0 * scale)
    return Planner.of(
        library,
        AvoidanceSettings(
            safety_margin_m=SAFETY_MARGIN_M * scale,
            tracker=tracker if tracks else None,
            transponder_address="ownship",
        ),
    )


@lru_cache(maxsize=2)
def craft_at(scale: float) -> Craft:
    """What rivals know of that vehicle."""
    planner = planner_at(scale)
    return Craft(planner, BODY_RADIUS_M * scale, planner.automaton.turning_radius_m)


def distance_to_keep_m(scale: float) -> float:
    """Safety margin and body radius of the intruder, between centres (6.16)."""
    return (SAFETY_MARGIN_M + RADIUS_M) * scale


def is_avoidable(encounter: Encounter, scale: float = 1.0) -> bool:
    """Whether some sequence of movements keeps the distance, if the intruder flies straight."""
    opponent = Opponent(encounter.position_m, encounter.velocity_mps, 0.0)
    automaton = MovementAutomaton.plane(speed_mps=encounter.own_speed_mps)
    return search_avoidance(automaton, opponent, distance_to_keep_m(scale)).avoidable


def fly_encounter(
    encounter: Encounter, settings: EncounterSettings | None = None, planner: str = CLEARWAY
) -> Run[Steering]:
    """One flight: the ownship starts towards a far waypoint, and meets the intruder at once."""
    settings = settings or EncounterSettings()
    scale = settings.scale
    lasts_s = 1.5 * encounter.collision_s + AFTERWARDS_S
    far_m = encounter.own_speed_mps * lasts_s + 3.0 * RANGE_M * scale
    mission = Mission(
        f"encounter {encounter.seed}",
        State(np.zeros(3)),
        waypoints_m=np.array([[far_m, 0.0, 0.0]]),
        reach_radius_m=REACH_RADIUS_M * scale,
    )
    system = AvoidanceSystem(planner_at(scale, tracks=settings.noisy), mission)
    return simulate(
        pilot_named(planner, system, craft_at(scale)),
        ObstacleMap(),
        lidars=(),
        settings=SimulationSettings(seed=encounter.seed, time_limit_s=lasts_s),
        traffic=_traffic(encounter, settings, mission),
    )


def _traffic(encounter: Encounter, settings: EncounterSettings, mission: Mission) -> Traffic:
    intruder = ScriptedIntruder(
        "intruder",
        appears_s=0.0,
        position_m=encounter.position_m,
        velocity_mps=encounter.velocity_mps,
        spread_rad=np.array(settings.spread_rad if settings.deviates else (0.0, 0.0)),
        radius_m=RADIUS_M * settings.scale,
        spawn="world",
    )
    behaviour = TrafficSettings(
        position_sigma_m=settings.position_noise_m * settings.scale,
        velocity_sigma_mps=settings.velocity_noise_mps * settings.scale,
        deviates=settings.deviates,
    )
    return Traffic([intruder], mission, encounter.own_speed_mps, behaviour, encounter.seed)


def judge_encounter(
    encounter: Encounter, settings: EncounterSettings, run: Run[Steering]
) -> EncounterOutcome:
    """What a flight came to."""
    traffic = run.metrics.intruders
    if traffic is None:
        raise ClearwayError(f"encounter {encounter.seed}: the intruder did not appear")
    return EncounterOutcome(
        encounter.seed,
        traffic.min_distance_m,
        traffic.violations == 0,
        is_avoidable(encounter, settings.scale),
        run.emergencies,
        float(np.hypot(run.states[:, 1], run.states[:, 2]).max()),
        1e3 * float(np.median([entry.elapsed_s for entry in run.decisions])),
    )


def _outcomes(
    settings: EncounterSettings, planner: str, seeds: Sequence[int]
) -> list[EncounterOutcome]:
    return [
        judge_encounter(encounter, settings, fly_encounter(encounter, settings, planner))
        for encounter in (random_encounter(seed, settings) for seed in seeds)
    ]


def fly_encounters(
    settings: EncounterSettings,
    seeds: Sequence[int],
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
    planner: str = CLEARWAY,
) -> EncounterTally:
    """Fly the encounters of many seeds in `workers` processes; the tally is the same for any.

    progress: called with how many more are done. planner: by name, or a user's `module:name`.
    Raises ClearwayError for a planner that is not there, or that fails in flight.
    """
    report = progress or (lambda _more: None)
    if workers < 1:
        raise ClearwayError(f"workers: must be at least 1, got {workers}")
    done: list[EncounterOutcome] = []
    chunks = [seeds[at : at + CHUNK] for at in range(0, len(seeds), CHUNK)]
    # Reach sets are built and stored once, before processes load them.
    planner_at(settings.scale)
    work = partial(_outcomes, settings, PLANNERS.locate(planner))
    for some in run_in_processes(work, chunks, workers):
        done += some
        report(len(some))
    return EncounterTally(settings, tuple(sorted(done, key=lambda each: each.seed)), planner)
