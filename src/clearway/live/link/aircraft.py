"""Aircraft that a link tells of: one stamp for one position, velocities, our own echo left out."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.live.link.own_motion import OwnMotion
from clearway.live.link.stamps import ReportTimes
from clearway.traffic import Intruder, Ownship, Report, TrackerSettings
from clearway.traffic.tracking.screening import flaw_of_report
from clearway.traffic.tracking.sequels import MOST_NAMESAKES, farthest_m

MOST_AIRCRAFT = 64
"""Told to decisions at a time; no more are taken until some are gone."""
LEAST_STEP_S = 0.5
"""Between two positions that make a velocity."""
BOUND_SIGMAS = 3.0
"""Deviations that a bound stands for: decisions keep clear of as many."""
STANDS_MPS = 0.1
"""What is slower may well be where it was: the same place then is news."""

NO_VELOCITY = "traffic: no velocity yet"
OWN_ECHO = "traffic: own echo"
TOO_MANY = f"traffic: more than {MOST_AIRCRAFT} aircraft"
FAR = "traffic: too far to meet"
STALE = "traffic: stale"
IMPOSSIBLE = "traffic: impossible"
REPEATED = "traffic: an old position again"


@dataclass(frozen=True, slots=True)
class TrafficTerms:
    """How reports are taken."""

    own_address: int | None = None
    """Our transponder's; without it our own echo is known by its place and velocity."""
    position_std_m: float = 0.0
    velocity_std_mps: float = 0.0
    extra_radius_m: float = 0.0
    """Kept beyond the margin and the intruder's half span."""
    reach_m: float = math.inf
    """Range of the grid."""
    horizon_s: float = math.inf
    """Time to fly through the grid."""
    oldest_s: float = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class AircraftReport:
    """What is told of one aircraft, world frame."""

    address: int
    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray | None
    """[3] None where it is not told."""
    half_span_m: float
    age_s: float
    """As told: how long ago the position was, when it came."""
    as_told: tuple[int, ...] = ()
    """The position in the link's own numbers: the same again is no news."""


class AircraftHeard:
    """Aircraft reported lately; gives an Intruder for each report that can be used."""

    def __init__(self, terms: TrafficTerms, counts: Counter[str]) -> None:
        self._terms, self._counts = terms, counts
        self._heard: dict[int, tuple[float, tuple[int, ...]]] = {}
        self._times: dict[int, ReportTimes] = {}
        self._anchors: dict[int, list[tuple[float, FloatArray]]] = {}
        """Times and places from which velocities are told, of each aircraft of an address."""

    def take(self, report: AircraftReport, now_s: float, own: OwnMotion) -> Intruder | None:
        """The report as an intruder, at the time that its position was true."""
        if report.address == self._terms.own_address:
            return self._left_out(OWN_ECHO)
        self._forget(now_s)
        if report.age_s > self._terms.oldest_s:
            return self._left_out(STALE)
        before = self._heard.get(report.address)
        told_s = now_s - report.age_s
        if before is not None and before[1] == report.as_told != ():
            speed = report.velocity_mps
            if speed is None or float(np.linalg.norm(speed)) >= STANDS_MPS:
                return self._left_out(REPEATED)
        if before is None and len(self._heard) >= MOST_AIRCRAFT:
            return self._left_out(TOO_MANY)
        return self._follow(report, told_s, now_s, own)

    def _follow(
        self, report: AircraftReport, told_s: float, now_s: float, own: OwnMotion
    ) -> Intruder | None:
        address, velocity = report.address, report.velocity_mps
        if velocity is None:
            self._heard[address] = (told_s, report.as_told)
            velocity = self._derive_velocity(report, told_s)
            if velocity is None:
                return self._left_out(NO_VELOCITY)
        times = self._times.setdefault(address, ReportTimes())
        time_s, unsure_s = times.take(told_s, report.position_m, velocity)
        intruder = self._intruder(report, velocity, time_s, unsure_s)
        flaw = self._flaw(intruder, now_s, own)
        if flaw is not None:
            return self._left_out(flaw)
        self._heard[address] = (told_s, report.as_told)
        return intruder

    def _derive_velocity(self, report: AircraftReport, told_s: float) -> FloatArray | None:
        """The velocity [3] by which an aircraft of this address came here; None if unknown yet."""
        anchors = self._anchors.setdefault(report.address, [])
        for number, (at_s, place) in enumerate(anchors):
            elapsed = told_s - at_s
            way = report.position_m - place
            if float(np.linalg.norm(way)) > farthest_m(elapsed):
                continue
            if elapsed < LEAST_STEP_S:
                return None
            anchors[number] = (told_s, report.position_m)
            return np.asarray(way / elapsed)
        anchors.append((told_s, report.position_m))
        del anchors[:-MOST_NAMESAKES]
        return None

    def _intruder(
        self, report: AircraftReport, velocity: FloatArray, time_s: float, unsure_s: float
    ) -> Intruder:
        terms, name = self._terms, f"{report.address:06x}"
        along_m = unsure_s * float(np.linalg.norm(velocity)) / BOUND_SIGMAS
        return Intruder(
            report.position_m,
            velocity,
            radius_m=report.half_span_m + terms.extra_radius_m,
            name=name,
            time_s=time_s,
            position_std_m=math.hypot(terms.position_std_m, along_m),
            velocity_std_mps=terms.velocity_std_mps,
            address=name,
        )

    def _flaw(self, intruder: Intruder, now_s: float, own: OwnMotion) -> str | None:
        terms = self._terms
        address = "" if terms.own_address is None else f"{terms.own_address:06x}"
        ownship = Ownship(own.position_m, own.velocity_mps, address)
        tracker = TrackerSettings(stale_s=terms.oldest_s)
        flaw = flaw_of_report(Report.of(intruder), now_s, ownship, tracker)
        if flaw is not None:
            return {"ownship": OWN_ECHO, "stale": STALE}.get(flaw, IMPOSSIBLE)
        closing = intruder.speed_mps + float(np.linalg.norm(own.velocity_mps))
        near = terms.reach_m + intruder.radius_m
        near += closing * (terms.horizon_s + now_s - intruder.time_s)
        apart = float(np.linalg.norm(intruder.position_m - own.position_m))
        return FAR if apart > near else None

    def _forget(self, now_s: float) -> None:
        oldest = now_s - self._terms.oldest_s
        self._heard = {key: told for key, told in self._heard.items() if told[0] >= oldest}
        self._times = {key: times for key, times in self._times.items() if key in self._heard}
        self._anchors = {key: one for key, one in self._anchors.items() if key in self._heard}

    def _left_out(self, reason: str) -> Intruder | None:
        self._counts[reason] += 1
        return None
