"""Which reports are not reports of another aircraft: our own, doubled, stale, impossible."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.traffic.tracking.tracks import Report, Track

LEFT_OUT = ("ownship", "duplicate", "stale", "impossible")
"""Why a report may be left out."""


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """How reports become tracks."""

    acceleration_std_mps2: float = 0.3
    """How much intruders are taken to manoeuvre."""
    gate: float = 5.0
    """Standard deviations within which a report may belong to a track."""
    confirm_reports: int = 2
    """Reports that make a track without an address believed; with an address one is enough."""
    tentative_s: float = 2.5
    """How long a track that is not yet believed lives without a report."""
    coast_s: float = 10.0
    """How long a believed track lives without a report."""
    stale_s: float = 5.0
    """Older reports are left out."""
    fastest_mps: float = 350.0
    """Nothing that we meet is faster."""
    hardest_mps2: float = 30.0
    """Nothing that we meet turns harder: a report further off its track is impossible."""
    unknown_velocity_std_mps: float = 20.0
    """Of a track's first report if that has no velocity."""
    ownship_m: float = 3.0
    """A report this close to the ownship with its velocity is the ownship's own echo."""


@dataclass(frozen=True, slots=True, eq=False)
class Ownship:
    """Who we are, so as not to take ourselves for traffic; world frame, at the time of the call."""

    position_m: FloatArray
    velocity_mps: FloatArray
    address: str = ""


def flaw_of_report(
    report: Report, time_s: float, ownship: Ownship | None, settings: TrackerSettings
) -> str | None:
    """Why a report cannot be used, whatever the tracks are (a word of LEFT_OUT); None if it can."""
    if _is_nonsense(report, settings) or report.time_s > time_s:
        return "impossible"
    if report.time_s < time_s - settings.stale_s:
        return "stale"
    if ownship is not None and _is_ownship(report, time_s, ownship, settings):
        return "ownship"
    return None


def flaw_of_sequel(track: Track, report: Report, settings: TrackerSettings) -> str | None:
    """Why a report of a track's own address cannot follow on it; None if it can."""
    elapsed = report.time_s - track.time_s
    if elapsed <= 0.0:
        return "duplicate" if elapsed == 0.0 else "stale"
    there = track.at(report.time_s, settings.acceleration_std_mps2)
    off = float(np.linalg.norm(report.position_m - there.mean[:3]))
    known = settings.gate * (there.position_std_m + report.position_std_m)
    if off > known + 0.5 * settings.hardest_mps2 * elapsed**2:
        return "impossible"
    return None


def _is_nonsense(report: Report, settings: TrackerSettings) -> bool:
    stds = (report.position_std_m, report.velocity_std_mps)
    numbers = [*report.measured, *report.spread_rad, report.radius_m, *stds]
    # Larger than any position on Earth; NaN and infinity fail here too.
    if not (np.isfinite(report.time_s) and np.all(np.abs(numbers) <= 1e9)):
        return True
    speed = 0.0 if report.velocity_mps is None else float(np.linalg.norm(report.velocity_mps))
    spread_fits = np.all((report.spread_rad >= 0.0) & (report.spread_rad < np.pi / 2))
    return bool(
        speed > settings.fastest_mps or min(stds) <= 0.0 or report.radius_m < 0.0 or not spread_fits
    )


def _is_ownship(report: Report, time_s: float, ownship: Ownship, settings: TrackerSettings) -> bool:
    """By address; or in our place with our velocity, which no intruder on its way to us has."""
    if ownship.address and report.address:
        return report.address.lower() == ownship.address.lower()
    if report.velocity_mps is None:
        return False
    velocity = np.asarray(ownship.velocity_mps, dtype=np.float64)
    then = np.asarray(ownship.position_m) - velocity * (time_s - report.time_s)
    near = np.linalg.norm(report.position_m - then) <= settings.ownship_m
    alike = np.linalg.norm(report.velocity_mps - velocity) <= 5.0 * report.velocity_std_mps
    return bool(near and alike)
