"""One simulated flight as it came out: track, decisions and measures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeGuard

import numpy as np

from clearway.base.frames import FloatArray
from clearway.live import FlightDecision
from clearway.live.mission import Mission, Mode, Progress
from clearway.sim.metrics import FlightMetrics
from clearway.sim.pilot import D, Steering


@dataclass(frozen=True, eq=False)
class LoggedDecision(Generic[D]):
    """A decision as it was taken in flight, and how long it took."""

    flight: D
    why_now: str
    elapsed_s: float
    """From the sensor's arrays in hand to the explained decision."""


@dataclass(frozen=True, eq=False)
class Run(Generic[D]):
    """One simulated flight."""

    mission: Mission
    time_s: FloatArray
    """[n] at most 0.05 s apart."""
    states: FloatArray
    """[n, 6] true states, world frame."""
    decisions: tuple[LoggedDecision[D], ...]
    movements: tuple[str, ...]
    """Movements flown: the chained buffer of (6.3)."""
    progress: Progress
    """By the true position."""
    metrics: FlightMetrics
    safety_margin_m: float
    seed: int
    intruder_tracks: dict[str, FloatArray] = field(default_factory=dict)
    """[n, 4] time and true position of each intruder, from its appearance on."""
    corrections: int = 0
    """Movements flown with corrected turn rates, since the prediction error took more than its
    share of the margin (4.2.2)."""
    counts: dict[str, int] = field(default_factory=dict)
    """Data that the system left out, by reason."""

    @property
    def reached(self) -> bool:
        return self.progress.done(self.mission)

    @property
    def crashed_s(self) -> float | None:
        """Time of the first contact: in an obstacle, which ends a flight, or an intruder's body."""
        contact = self.nearest_surface_m <= 0.0
        return float(self.time_s[np.argmax(contact)]) if contact.any() else None

    @property
    def nearest_surface_m(self) -> FloatArray:
        """[n] distance to the nearest surface at each time, of obstacles and intruders' bodies."""
        traffic = self.metrics.intruders
        if traffic is None:
            return self.metrics.obstacle_distance_m
        radius = traffic.margin_m - self.safety_margin_m
        bodies = (traffic.distance_m - radius[:, None]).min(axis=0)
        return np.asarray(np.minimum(self.metrics.obstacle_distance_m, bodies))

    @property
    def emergencies(self) -> int:
        """Decisions in which nothing kept the margin."""
        return sum(entry.flight.mode is Mode.EMERGENCY for entry in self.decisions)

    @property
    def safe(self) -> bool:
        """Reached, and never nearer than the margin."""
        return self.reached and self.metrics.margin_violations == 0


OnDecision = Callable[[LoggedDecision[D], Progress], None]


def decided_by_clearway(run: Run[Steering]) -> TypeGuard[Run]:
    """Whether the decisions of a flight carry what clearway's own do, as its pictures need."""
    return all(isinstance(entry.flight, FlightDecision) for entry in run.decisions)
