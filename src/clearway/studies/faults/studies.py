"""The faults that are studied: what each does to a mission at a level, and against what."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from clearway.avoidance.plan.held_escape import Escape
from clearway.missions.mission_file import MissionFile
from clearway.missions.mission_sections import SafetySection
from clearway.missions.place_sections import WorldObstacleSection
from clearway.missions.world_file import mission_of
from clearway.sim.worlds import ball_world
from clearway.studies.campaigns.conflicts import ConflictParameters, conflict

BLIND_AT_DEG = 0.0
"""Middle of the blind sector: straight ahead."""
BALLS = 150
"""In every world: dense enough that straight flight never gets through."""
PHANTOM_RADIUS_M = 1.5
CORRIDOR_M = (10.0, 50.0, 8.0)
"""Phantoms stand between these along the leg, and as far to both sides and up and down."""
NEVER_S = 600.0
"""Later than any flight of a study ends: their time is up after 420 s."""
ESCAPES = (Escape.STRICT.value, Escape.KNOWN.value, Escape.OFF.value)
"""Escapes that can be asked for: `mapped` would be strict, since no map is declared complete."""
ESCAPE: str = SafetySection().escape
"""That of a mission file that says nothing."""
Variant = Callable[[MissionFile, float, int], MissionFile]
"""(mission, level, seed) -> the mission with the fault at that level."""


@dataclass(frozen=True, slots=True)
class FaultStudy:
    """One fault at growing levels."""

    title: str
    unit: str
    levels: tuple[float, ...]
    variants: Mapping[str, Variant]
    """What is flown at each level, by what the vehicle has against the fault."""
    traffic: bool = False
    """Conflicts with one intruder; worlds of balls otherwise."""


def _simulation(key: str) -> Variant:
    return lambda file, level, _: file.with_values("simulation", **{key: level})


def _faults(**keys: Callable[[float], object]) -> Variant:
    return lambda file, level, _: file.with_values(
        "faults", **{key: value(level) for key, value in keys.items()}
    )


def _wind(file: MissionFile, level: float, seed: int) -> MissionFile:
    bearing = np.random.default_rng([seed, 60]).uniform(-np.pi, np.pi)
    wind = (level * float(np.cos(bearing)), level * float(np.sin(bearing)), 0.0)
    return file.with_values("simulation", wind_mps=wind)


def _dropout(file: MissionFile, level: float, _: int) -> MissionFile:
    lidar = tuple(one.model_copy(update={"dropout": level}) for one in file.lidar)
    return file.model_copy(update={"lidar": lidar})


def _chart(variant: Variant) -> Variant:
    """The same with a map that shows everything."""

    def with_map(file: MissionFile, level: float, seed: int) -> MissionFile:
        known = tuple(one.model_copy(update={"known": "both"}) for one in file.obstacle)
        return variant(file.model_copy(update={"obstacle": known}), level, seed)

    return with_map


def _missing(file: MissionFile, level: float, seed: int) -> MissionFile:
    """A share of what is there is not on the map."""
    lost = np.random.default_rng([seed, 61]).random(len(file.obstacle)) < level
    known = tuple(
        one.model_copy(update={"known": "world" if gone else "both"})
        for one, gone in zip(file.obstacle, lost, strict=True)
    )
    return file.model_copy(update={"obstacle": known})


def _blind(variant: Variant) -> Variant:
    """The same without any scan: the map alone."""
    return lambda file, level, seed: variant(file, level, seed).with_values(
        "faults", dead_from_s=0.0
    )


def _phantoms(file: MissionFile, level: float, seed: int) -> MissionFile:
    """The map shows things on the way that are not there (2.2, third case)."""
    rng = np.random.default_rng([seed, 62])
    near, far, aside = CORRIDOR_M
    places = rng.uniform([near, -aside, -aside], [far, aside, aside], (int(level), 3))
    phantoms = tuple(
        WorldObstacleSection(
            shape="ball",
            position_m=(float(x), float(y), float(z)),
            radius_m=PHANTOM_RADIUS_M,
            known="map",
            name=f"phantom-{number}",
        )
        for number, (x, y, z) in enumerate(places)
    )
    return file.model_copy(update={"obstacle": file.obstacle + phantoms})


def _track(variant: Variant) -> Variant:
    return lambda file, level, seed: variant(file, level, seed).with_values("traffic", tracker=True)


def _sector(level: float) -> tuple[float, float]:
    return BLIND_AT_DEG - 0.5 * level, BLIND_AT_DEG + 0.5 * level


BLIND = _faults(blind_deg=_sector)
DEAD = _faults(dead_from_s=lambda level: level)
BIAS = _faults(range_bias_m=lambda level: level)
LOSS = _faults(report_loss=lambda level: level)
SPOOF = _faults(spoofed=lambda _: 0.2, spoof_m=lambda level: level)
LIDAR = "LiDAR alone"
WITH_MAP = "LiDAR and map"
MAP_ALONE = "map alone"
REPORTS = "reports as they come"
TRACKER = "tracker"


def _without_and_with_map(variant: Variant) -> Mapping[str, Variant]:
    return {LIDAR: variant, WITH_MAP: _chart(variant)}


def _without_and_with_tracker(variant: Variant) -> Mapping[str, Variant]:
    return {REPORTS: variant, TRACKER: _track(variant)}


STUDIES: Mapping[str, FaultStudy] = MappingProxyType(
    {
        "gusts": FaultStudy(
            "Gusts: bound of the state noise w (3.20)",
            "m/s",
            (0.0, 0.25, 0.5, 1.0, 2.0, 4.0),
            {LIDAR: _simulation("state_noise_mps")},
        ),
        "wind": FaultStudy(
            "Steady wind, from anywhere, unknown to the vehicle",
            "m/s",
            (0.0, 0.05, 0.1, 0.2, 0.3, 0.4),
            _without_and_with_map(_wind),
        ),
        "actuators": FaultStudy(
            "Actuator noise: bound of the input noise v (3.20)",
            "share of full deflection",
            (0.0, 0.1, 0.2, 0.4, 0.6, 0.8),
            {LIDAR: _simulation("input_noise")},
        ),
        "drop-outs": FaultStudy(
            "Drop-outs: share of returns lost",
            "share",
            (0.0, 0.25, 0.5, 0.75, 0.9, 0.97, 0.99),
            _without_and_with_map(_dropout),
        ),
        "range-bias": FaultStudy(
            "Biased range: things seem farther than they are",
            "m",
            (-0.5, -0.25, 0.0, 0.1, 0.25, 0.5, 1.0),
            _without_and_with_map(BIAS),
        ),
        "latency": FaultStudy(
            "Latency of scans",
            "s",
            (0.0, 0.1, 0.2, 0.5, 1.0, 1.5, 2.0),
            {LIDAR: _simulation("scan_latency_s")},
        ),
        "blind-sector": FaultStudy(
            "Blind sector ahead, which claims that all is free",
            "deg",
            (0.0, 2.0, 5.0, 10.0, 20.0, 40.0),
            _without_and_with_map(BLIND),
        ),
        "dead-sensor": FaultStudy(
            f"Dead sensor from a time on ({NEVER_S:g} s: after the flight)",
            "s",
            (NEVER_S, 60.0, 40.0, 20.0, 10.0, 0.0),
            _without_and_with_map(DEAD),
        ),
        "map-missing": FaultStudy(
            "Obstacles missing from the map: share",
            "share",
            (0.0, 0.1, 0.25, 0.5, 0.75, 1.0),
            {WITH_MAP: _missing, MAP_ALONE: _blind(_missing)},
        ),
        "map-phantoms": FaultStudy(
            "False positives of the map: phantoms on the way",
            "phantoms",
            (0.0, 5.0, 10.0, 20.0, 40.0),
            {WITH_MAP: _chart(_phantoms)},
        ),
        "report-loss": FaultStudy(
            "Reports of traffic lost: share",
            "share",
            (0.0, 0.25, 0.5, 0.75, 0.9, 1.0),
            _without_and_with_tracker(LOSS),
            traffic=True,
        ),
        "spoofed-reports": FaultStudy(
            "A fifth of the reports spoofed: length of their jump",
            "m",
            (0.0, 1.0, 2.0, 5.0, 10.0, 50.0),
            _without_and_with_tracker(SPOOF),
            traffic=True,
        ),
    }
)
"""Faults by name."""


def case(study: FaultStudy, seed: int, escape: str = ESCAPE) -> MissionFile:
    """What a study flies with a seed, without its fault; escape: `[safety] escape`."""
    if study.traffic:
        deviating = ConflictParameters(detected_at_m=10.0, deviates=True)
        file = conflict("random", seed, deviating)
    else:
        file = mission_of(ball_world(seed, BALLS), seed)
    return file.with_values("safety", escape=escape)
