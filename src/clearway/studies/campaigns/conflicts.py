"""Conflicts with traffic by kind: intruders on collision courses with straight flight.

At the scale of the paper: the ownship flies 1 m/s along x from the origin, intruders have a body of
0.6 m, and are reported at a distance that parameters give. No sensor sees them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from pydantic import Field

from clearway.base.frames import FloatArray
from clearway.io.toml import Section
from clearway.missions.mission_file import MissionFile
from clearway.missions.mission_sections import MissionSection, SimulationSection
from clearway.missions.traffic_sections import FlyingIntruderSection, TrafficSection
from clearway.studies.encounters.encounter import EncounterSettings, random_encounter
from clearway.studies.encounters.flights import RADIUS_M

AFTERWARDS_S = 15.0
"""Of straight flight from the last collision to the waypoint."""
SLOWEST_CLOSING_MPS = 0.2
SPREAD_DEG = (11.25, 7.5)
"""Stated by intruders that deviate: pi/16 by pi/24."""


class ConflictParameters(Section):
    """Of all kinds of conflict."""

    detected_at_m: float = Field(default=10.0, gt=0.0)
    """Distance at which an intruder is first reported."""
    deviates: bool = False
    """Intruders fly anywhere inside a spread of 11.25 x 7.5 degrees, with a report each second."""
    position_noise_m: float = Field(default=0.0, ge=0.0)
    """Standard deviation of reported positions; with noise, reports pass a tracker."""
    velocity_noise_mps: float = Field(default=0.0, ge=0.0)


Course = Callable[[np.random.Generator], FloatArray]
"""Velocity [3] of an intruder, the ownship's being (1, 0, 0)."""


def random(rng: np.random.Generator) -> FloatArray:
    """A random collision course, as in `clearway encounters`: head on, or caught up with."""
    encounter = random_encounter(int(rng.integers(2**31)), EncounterSettings())
    return np.array(encounter.velocity_mps)


def head_on(rng: np.random.Generator) -> FloatArray:
    """Head on, within 10 degrees, at 0.5 to 1.5 of the own speed."""
    return _course(rng, (0.5, 1.5), 180.0 + rng.uniform(-10.0, 10.0), rng.uniform(-5.0, 5.0))


def overtaking(rng: np.random.Generator) -> FloatArray:
    """Overtaking a slower one: courses within 20 degrees, it flies 0.3 to 0.7 of the own speed."""
    return _course(rng, (0.3, 0.7), rng.uniform(-20.0, 20.0), rng.uniform(-5.0, 5.0))


def overtaken(rng: np.random.Generator) -> FloatArray:
    """Overtaken from behind: courses within 20 degrees, it flies 1.3 to 1.8 of the own speed."""
    return _course(rng, (1.3, 1.8), rng.uniform(-20.0, 20.0), rng.uniform(-5.0, 5.0))


def converging(rng: np.random.Generator) -> FloatArray:
    """Converging: courses 45 to 135 degrees apart, at 0.7 to 1.3 of the own speed."""
    side = 1.0 if rng.random() < 0.5 else -1.0
    return _course(rng, (0.7, 1.3), side * rng.uniform(45.0, 135.0), rng.uniform(-5.0, 5.0))


def climbing(rng: np.random.Generator) -> FloatArray:
    """Climbing or descending through the own height at 20 to 60 degrees, on any course."""
    steep = (1.0 if rng.random() < 0.5 else -1.0) * rng.uniform(20.0, 60.0)
    return _course(rng, (0.5, 1.2), rng.uniform(-180.0, 180.0), steep)


def _course(
    rng: np.random.Generator, speeds: tuple[float, float], course_deg: float, climb_deg: float
) -> FloatArray:
    course, climb = math.radians(course_deg), math.radians(climb_deg)
    level = math.cos(climb)
    return rng.uniform(*speeds) * np.array(
        [level * math.cos(course), level * math.sin(course), math.sin(climb)]
    )


def several(rng: np.random.Generator) -> FloatArray:
    """Two to four at once, of any of the other kinds, 0 to 6 s one after the other."""
    kinds = (random, head_on, overtaking, overtaken, converging, climbing)
    return kinds[int(rng.integers(len(kinds)))](rng)


KINDS: Mapping[str, Course] = MappingProxyType(
    {
        "random": random,
        "head-on": head_on,
        "overtaking": overtaking,
        "overtaken": overtaken,
        "converging": converging,
        "climbing": climbing,
        "several": several,
    }
)
"""Kinds by name."""


def conflict(kind: str, seed: int, parameters: ConflictParameters) -> MissionFile:
    """The conflict of a seed: straight flight to the waypoint would collide with each intruder."""
    rng = np.random.default_rng([seed, 60, list(KINDS).index(kind)])
    intruders, meets_s = [], 0.0
    appears_s = 0.0
    for number in range(int(rng.integers(2, 5)) if kind == "several" else 1):
        section, after_s = _intruder(f"i{number + 1}", rng, KINDS[kind], appears_s, parameters)
        intruders.append(section)
        meets_s = max(meets_s, appears_s + after_s)
        appears_s += float(rng.integers(0, 7))
    noisy = parameters.position_noise_m > 0.0 or parameters.velocity_noise_mps > 0.0
    return MissionFile(
        mission=MissionSection(
            name=f"{kind}-{seed}", waypoints_m=((meets_s + AFTERWARDS_S, 0.0, 0.0),)
        ),
        simulation=SimulationSection(seed=seed),
        traffic=TrafficSection(
            position_sigma_m=parameters.position_noise_m,
            velocity_sigma_mps=parameters.velocity_noise_mps,
            deviates=parameters.deviates,
            tracker=noisy,
        ),
        lidar=(),
        intruder=tuple(intruders),
    )


def _intruder(
    name: str,
    rng: np.random.Generator,
    course: Course,
    appears_s: float,
    parameters: ConflictParameters,
) -> tuple[FlyingIntruderSection, float]:
    """One intruder relative to nominal flight, and the time from its appearance to collision."""
    while True:
        velocity = course(rng)
        closing = velocity - np.array([1.0, 0.0, 0.0])
        speed = float(np.linalg.norm(closing))
        if speed >= SLOWEST_CLOSING_MPS:
            break
    after_s = parameters.detected_at_m / speed
    x, y, z = (float(value) for value in -after_s * closing)
    vx, vy, vz = (float(value) for value in velocity)
    section = FlyingIntruderSection(
        name=name,
        appears_s=appears_s,
        position_m=(x, y, z),
        velocity_mps=(vx, vy, vz),
        spread_deg=SPREAD_DEG if parameters.deviates else (0.0, 0.0),
        radius_m=RADIUS_M,
    )
    return section, after_s
