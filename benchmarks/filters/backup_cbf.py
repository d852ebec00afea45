"""Backup control barrier function: the acceleration nearest to the wish that keeps a stop safe.

After Gurriet, Mote, Singletary, Nilsson, Feron and Ames, "A scalable safety critical control
framework for nonlinear systems" (2020), and Chen, Jankovic, Santillo and Ames, "Backup control
barrier functions" (2021), written anew. Each place on the flow of the back-up policy gives one
linear constraint on the acceleration, by the flow's sensitivity to the own velocity. Where the
constraints contradict each other, the back-up policy acts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from benchmarks.filters.protocol import (
    Command,
    Copter,
    Looker,
    Own,
    Surroundings,
    accelerate,
    check_wish,
    pass_on,
)
from benchmarks.filters.qp import acceleration_limits, nearest_kept
from benchmarks.filters.shielding import brake
from clearway.base.frames import FloatArray
from clearway.mavlink.simulated_vehicle import STIFFNESS_PER_S

FLOW_STEP_S = 0.1
AFTER_S = 0.5
"""The flow ends so long after the fastest copter stands."""
SOFT_MPS = 0.3
"""Below this speed the back-up policy brakes more gently: its flow has a derivative everywhere."""
INSIDE = 1.0 - 1e-9
"""By rounding."""
DIFFERENCE_MPS = 0.05
"""Of the own velocity, by which the sensitivity is measured."""


class BackupCbfTuning(NamedTuple):
    """Of the barrier."""

    spare_m: float = 0.2
    """Kept beside the margin, for what the model does not know."""
    rate_per_s: float = 2.0
    """How fast the barrier may fall, of its value."""


TUNED = BackupCbfTuning()


class BackupCbf(Looker):
    """The filter of one flight."""

    def __init__(self, copter: Copter, tuning: BackupCbfTuning = TUNED) -> None:
        self.copter, self.tuning = copter, tuning
        self._limits = acceleration_limits(copter.acceleration_mps2)

    def command(self, own: Own, wish_mps: FloatArray, known: Surroundings) -> Command:
        """Return the wish where it keeps the barrier, else the nearest acceleration that does."""
        wish, most = check_wish(wish_mps), self.copter.acceleration_mps2
        wished = wished_acceleration(own, wish, most)
        rows, least = self._constraints(own, known)
        limits, lowest = self._limits
        found = nearest_kept(wished, np.vstack([rows, limits]), np.append(least, lowest))
        if found is None:
            return brake(own, most)
        if found is wished:
            return pass_on(wish)
        return accelerate(own, found)

    def _constraints(self, own: Own, known: Surroundings) -> tuple[FloatArray, FloatArray]:
        """Rows [n, 3] and least values [n] of rows . acceleration."""
        places, by_velocity = self._flow(own)
        middles, radii = known.nearest(places)
        off = places - middles
        away = np.linalg.norm(off, axis=1)
        normal = off / np.maximum(away, 1e-9)[:, None]
        barrier = away - radii - self.copter.margin_m - self.tuning.spare_m
        rows = np.einsum("ni,nij->nj", normal, by_velocity)
        return rows, -self.tuning.rate_per_s * barrier - normal @ own.velocity_mps

    def _flow(self, own: Own) -> tuple[FloatArray, FloatArray]:
        """Places [n, 3] of the back-up flow, and their derivative [n, 3, 3] by the velocity."""
        most = self.copter.acceleration_mps2
        steps = int(np.ceil((self.copter.speed_mps / most + AFTER_S) / FLOW_STEP_S))
        velocity = own.velocity_mps + np.vstack([np.zeros(3), DIFFERENCE_MPS * np.eye(3)])
        place = np.tile(own.position_m, (4, 1))
        flown = np.empty((steps, 4, 3))
        for n in range(steps):
            size = np.sqrt((velocity**2).sum(axis=1, keepdims=True) + SOFT_MPS**2)
            after = velocity * (1.0 - np.minimum(1.0, most * FLOW_STEP_S / size))
            place = place + 0.5 * FLOW_STEP_S * (velocity + after)
            velocity = after
            flown[n] = place
        by_velocity = (flown[:, 1:] - flown[:, :1]) / DIFFERENCE_MPS
        return flown[:, 0], np.transpose(by_velocity, (0, 2, 1))


def wished_acceleration(own: Own, wish_mps: FloatArray, most_mps2: float) -> FloatArray:
    """Return the acceleration [3] by which the autopilot follows a wished velocity."""
    asked = STIFFNESS_PER_S * (wish_mps - own.velocity_mps)
    # The limit of the search is a polygon about this circle.
    most = INSIDE * most_mps2
    limited: FloatArray = asked * min(1.0, most / max(float(np.linalg.norm(asked)), 1e-9))
    return limited
