"""Encounters with an intruder that wants to hit, (3.6), def. 3: which can be avoided at all.

The intruder knows the ownship's plan, keeps at most its speed, and accelerates by no more than a
bound in any direction. Its reach set at each time lies within two balls: a t^2 / 2 about its
straight way, and v t about where it was seen. An encounter counts as won where some sequence of
movements, followed by straight flight, keeps its distance from the common part of both for good:
that is sound, since the true reach set is smaller. Where none is found nothing is claimed, for the
search follows few long sequences, and a plan may be changed when the intruder shows its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from clearway.base.checks import collect_problems, number_problem
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.studies.encounters.avoidable import Opponent, search_avoidance
from clearway.studies.encounters.encounter import closing_speed
from clearway.vehicle.automaton import MovementAutomaton

LENGTHS_M = (0.1, 100.0)
MOST_MPS2 = 1e3
"""Of a vehicle that flies 1 m/s: flights over larger lengths take as much longer to look at."""
CHOSEN_MOVEMENTS = 4
MOST_MOVEMENTS = 14
"""The first movements are chosen freely, the last of them is held for as many as these in all."""


@dataclass(frozen=True, eq=False)
class WinMap:
    """Won or not, by bound of acceleration, bearing and speed."""

    detected_at_m: float
    keep_m: float
    accelerations_mps2: FloatArray
    """[accelerations] 0 flies straight on."""
    bearings_rad: FloatArray
    """[bearings] of the intruder when it is detected, to either side."""
    speeds: FloatArray
    """[speeds] as shares of the ownship's."""
    exists: BoolArray
    """[bearings, speeds] whether a collision course exists."""
    won: BoolArray
    """[accelerations, bearings, speeds]"""

    @property
    def share(self) -> FloatArray:
        """[accelerations] won, of the encounters that exist."""
        count = max(1, int(self.exists.sum()))
        shares: FloatArray = (self.won & self.exists).sum(axis=(1, 2)) / count
        return shares


def win_map(
    detected_at_m: float,
    accelerations_mps2: Sequence[float],
    bearings_rad: Sequence[float],
    speeds: Sequence[float],
    keep_m: float,
    automaton: MovementAutomaton | None = None,
    progress: Callable[[], None] | None = None,
) -> WinMap:
    """Search the encounters of a map: level, on the faster of the collision courses.

    Raises InputError for numbers that cannot be, and for intruders as fast as the ownship, which
    cannot be outrun. progress: called after each encounter.
    """
    _check(detected_at_m, accelerations_mps2, speeds, keep_m)
    automaton = automaton or MovementAutomaton.plane()
    own_mps = max(movement.speed_mps for movement in automaton.movements)
    exists = np.zeros((len(bearings_rad), len(speeds)), dtype=np.bool_)
    won = np.zeros((len(accelerations_mps2), *exists.shape), dtype=np.bool_)
    for b, bearing in enumerate(bearings_rad):
        sight = np.array([math.cos(bearing), math.sin(bearing), 0.0])
        for s, speed in enumerate(speeds):
            closing = closing_speed(float(sight[0]), speed, approaching=True)
            if closing is not None and closing > 0.0:
                exists[b, s] = True
                velocity = own_mps * (np.array([1.0, 0.0, 0.0]) - closing * sight)
                for a, bound in enumerate(accelerations_mps2):
                    opponent = Opponent(detected_at_m * sight, velocity, float(bound))
                    verdict = search_avoidance(
                        automaton, opponent, keep_m, MOST_MOVEMENTS, CHOSEN_MOVEMENTS
                    )
                    won[a, b, s] = verdict.for_good
            if progress is not None:
                progress()
    return WinMap(
        detected_at_m,
        keep_m,
        np.array(accelerations_mps2, dtype=np.float64),
        np.array(bearings_rad, dtype=np.float64),
        np.array(speeds, dtype=np.float64),
        exists,
        won,
    )


def _check(
    detected_at_m: float,
    accelerations_mps2: Sequence[float],
    speeds: Sequence[float],
    keep_m: float,
) -> None:
    given = (
        ("detected_at_m", detected_at_m, *LENGTHS_M),
        ("keep_m", keep_m, *LENGTHS_M),
        *(("accelerations", value, 0.0, MOST_MPS2) for value in accelerations_mps2),
    )
    problems = collect_problems(number_problem(*one) for one in given)
    problems += [
        f"speeds: must be shares within (0, 1), got {value}"
        for value in speeds
        if not 0.0 < value < 1.0
    ]
    if problems:
        raise InputError("win map", problems)
