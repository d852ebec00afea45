"""Level encounters at the scale of the paper: a straight intruder on a true collision course."""

from __future__ import annotations

import math

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.studies.encounters.encounter import SLOWEST_CLOSING, SPEEDS, Encounter, closing_speed
from clearway.studies.encounters.flights import AFTERWARDS_S

FIRST_SEED = 90_000
"""Nothing here was tuned on these."""


def level_encounter(seed: int, detected_at_m: float) -> Encounter:
    """As `random_encounter` draws them, but both aircraft fly at one height."""
    rng = np.random.default_rng([seed, 80])
    for _ in range(1000):
        ratio = float(rng.uniform(*SPEEDS))
        azimuth = float(rng.uniform(-0.5, 0.5) * math.pi)
        closing = closing_speed(math.cos(azimuth), ratio, bool(rng.random() < 0.5))
        if closing is not None and closing >= SLOWEST_CLOSING:
            sight = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
            velocity = np.array([1.0, 0.0, 0.0]) - closing * sight
            return Encounter(seed, detected_at_m * sight, velocity, 1.0)
    raise ClearwayError("level encounters: no course found")


def lasts_s(encounter: Encounter) -> float:
    """How long it is flown, by everybody."""
    return 1.5 * encounter.collision_s + AFTERWARDS_S


def courses(count: int, detected_at_m: float) -> list[Encounter]:
    """The encounters of one distance of detection."""
    return [level_encounter(FIRST_SEED + number, detected_at_m) for number in range(count)]
