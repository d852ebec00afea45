"""What goes wrong with sensors and reports: injected in simulation, and known to no one there.

Each fault is a lie or a silence. A blind sector returns nothing, and so claims that all is free; a
dead sensor sends no more scans; a biased one shifts its ranges; the own position scatters
more than it states; reports of traffic get lost, or jump to another place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.state import State
from clearway.sensors import Scan
from clearway.traffic import Intruder


@dataclass(frozen=True, slots=True)
class Faults:
    """What is wrong in a flight; the defaults are nothing.

    Raises ClearwayError for shares outside [0, 1] and numbers that are not finite.
    """

    range_bias_m: float = 0.0
    """Added to every range: above 0, things seem farther than they are."""
    blind_from_rad: float = 0.0
    blind_to_rad: float = 0.0
    """Azimuths, sensor frame, left positive, between which no beam returns."""
    dead_from_s: float = np.inf
    """From then on no scan comes."""
    report_loss: float = 0.0
    """Share of reports of traffic that get lost."""
    spoofed: float = 0.0
    """Share of reports that jump."""
    spoof_m: float = 0.0
    """How far they jump, in a random direction."""
    own_position_sigma_m: float = 0.0
    """Standard deviation of the own position, per axis, that its estimates do not state."""
    late_from_s: float = np.inf
    """A decision due from then on comes late, once."""
    late_s: float = 0.0
    """By how much."""

    def __post_init__(self) -> None:
        for name in ("report_loss", "spoofed"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ClearwayError(f"{name}: {getattr(self, name)} is not within [0, 1]")
        for name in ("late_s", "own_position_sigma_m"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise ClearwayError(f"{name}: {getattr(self, name)} is no number >= 0")
        for name in ("range_bias_m", "blind_from_rad", "blind_to_rad", "spoof_m"):
            if not np.isfinite(getattr(self, name)):
                raise ClearwayError(f"{name}: {getattr(self, name)} is not a finite number")
        if self.blind_from_rad > self.blind_to_rad:
            raise ClearwayError("blind_from_rad: must not be left of blind_to_rad")

    def silent_at(self, time_s: float) -> bool:
        """Whether no decision comes at a time."""
        return self.late_from_s <= time_s < self.late_from_s + self.late_s

    def scan(self, scan: Scan, time_s: float) -> Scan | None:
        """What comes of a scan that would arrive at a time; None if none does."""
        if time_s >= self.dead_from_s:
            return None
        points = scan.points_m
        if self.blind_to_rad > self.blind_from_rad:
            azimuth = np.arctan2(points[:, 1], points[:, 0])
            points = points[(azimuth < self.blind_from_rad) | (azimuth > self.blind_to_rad)]
        if self.range_bias_m and len(points):
            ranges = np.linalg.norm(points, axis=1)
            seen = ranges + self.range_bias_m > 0.0
            stretch = 1.0 + self.range_bias_m / np.maximum(ranges[seen], 1e-9)
            points = points[seen] * stretch[:, None]
        return scan if points is scan.points_m else replace(scan, points_m=points)

    def own_state(self, state: State, rng: np.random.Generator) -> State:
        """What comes of an own state estimate."""
        if not self.own_position_sigma_m:
            return state
        error = rng.normal(0.0, self.own_position_sigma_m, 3)
        return replace(state, position_m=state.position_m + error)

    def report(self, report: Intruder, rng: np.random.Generator) -> Intruder | None:
        """What comes of a report; the same draws whether or not it gets lost."""
        lost, spoofed, *direction = rng.random(2).tolist() + rng.normal(size=3).tolist()
        if lost < self.report_loss:
            return None
        if spoofed >= self.spoofed or not self.spoof_m:
            return report
        jump = self.spoof_m * np.array(direction) / np.linalg.norm(direction)
        return replace(report, position_m=report.position_m + jump)


NO_FAULTS = Faults()
