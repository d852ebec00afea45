"""Reports of intruders: made into tracks, or believed each as it comes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol

import numpy as np

from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.state import State
from clearway.traffic import (
    Intruder,
    Manoeuvres,
    Ownship,
    Report,
    TrackerSettings,
    Tracks,
    track_reports,
)
from clearway.traffic.tracking.sequels import (
    AGREED,
    LOOKED_BACK_S,
    MOST_NAMESAKES,
    can_follow,
    can_have_flown,
    can_turn_to,
)

LATE = "intruder: late report"
MOST_UNASKED = 4096
"""Reports that wait for a question; more than these come only where nobody asks."""


class Reports(Protocol):
    """What is known of intruders that report themselves."""

    def take(self, report: Intruder) -> str | None:
        """Keep a report, or say why it cannot be used."""
        ...

    def intruders(self, own: State, now_s: float, /) -> tuple[list[Intruder], Mapping[str, int]]:
        """Who is there at a moment, and what was left out since the last call, by reason."""
        ...


def reports_for(settings: AvoidanceSettings, speed_mps: float) -> Reports:
    """Tracks where there are settings for them, else the latest reports; nothing heard yet.

    speed_mps: the own one. A tracker has its own limit of age.
    """
    address = settings.transponder_address
    if settings.tracker is None:
        return LatestReports(settings.intruder_s, address)
    return TrackedReports(settings.tracker, speed_mps, address)


class LatestReports:
    """The latest report of each intruder, save own, repeated, late and stale ones.

    A report that no aircraft can have sent after the one before is doubted: the aircraft is taken
    to fly on from there. A second report that can follow on the doubted one makes another aircraft
    of that name. A velocity that no aircraft can have turned to is replaced by the one before,
    until `AGREED` in a row fit each other; one that the way flown does not fit, by that way's.
    """

    def __init__(self, stale_s: float, address: str) -> None:
        self._stale_s = stale_s
        self._address = address
        self._latest: dict[str, Intruder] = {}
        self._namesakes: dict[str, list[str]] = {}
        """Of each name that is reported, those that its aircraft are followed by."""
        self._doubted: dict[str, Intruder] = {}
        """The last report of a name that no aircraft of that name can have sent."""
        self._odd: dict[str, tuple[Intruder, int]] = {}
        """The last velocity that an aircraft cannot have turned to, and how many agree with it."""
        self._back: dict[str, list[Intruder]] = {}
        """Reports that lie `LOOKED_BACK_S` apart."""
        self._manoeuvres = Manoeuvres()
        self._anonymous = self._stale = 0
        self._room = MOST_UNASKED

    def take(self, report: Intruder) -> str | None:
        if self._address and self._address in (report.address, report.name):
            return "intruder: ownship"
        # Reports of nobody in particular cannot replace each other: each counts until it is stale.
        self._anonymous += 1
        told = report.address or report.name or f"anonymous {self._anonymous}"
        if len(self._latest) >= self._room:
            self._forget_stale(report.time_s)
            self._room = max(MOST_UNASKED, 2 * len(self._latest))
        name, flaw = self._aircraft_of(told, report)
        if flaw is not None:
            return flaw
        known = self._latest.get(name)
        if known is not None and report.time_s < known.time_s:
            return LATE
        if known is not None and _same_report(report, known):
            return "intruder: duplicate"
        believed = report if known is None else self._with_velocity(name, known, report)
        shown_as = (report.name or told) + name[len(told) :]
        self._latest[name] = (
            believed if shown_as == believed.name else replace(believed, name=shown_as)
        )
        if believed is not report:
            return "intruder: implausible velocity"
        self._manoeuvres.take(name, report)
        return None

    def _aircraft_of(self, name: str, report: Intruder) -> tuple[str, str | None]:
        """The aircraft of a name that can have sent a report; else why none can."""
        theirs = [one for one in self._namesakes.get(name, ()) if one in self._latest]
        self._namesakes[name] = theirs
        if not theirs:
            theirs.append(name)
            return name, None
        for one in theirs:
            if can_follow(self._latest[one], report):
                return one, None
        doubted, self._doubted[name] = self._doubted.get(name), report
        again = (
            doubted is not None
            and doubted.time_s < report.time_s
            and can_follow(doubted, report)
            and len(theirs) < MOST_NAMESAKES
        )
        if not again:
            return name, "intruder: implausible jump"
        del self._doubted[name]
        numbers = (f"{name} ({number})" for number in range(2, MOST_NAMESAKES + 2))
        theirs.append(next(one for one in (name, *numbers) if one not in theirs))
        return theirs[-1], None

    def _with_velocity(self, name: str, known: Intruder, report: Intruder) -> Intruder:
        """The report, with the velocity before it, or by its way, where its own makes no sense."""
        back = self._look_back(name, known, report)
        if back is not None and not can_have_flown(back, report):
            way = report.position_m - back.position_m
            return replace(report, velocity_mps=way / (report.time_s - back.time_s))
        if can_turn_to(known, known.velocity_mps, report):
            self._odd.pop(name, None)
            return report
        odd, agreed = self._odd.get(name, (None, 1))
        agreed = agreed + 1 if odd is not None and can_turn_to(odd, odd.velocity_mps, report) else 1
        if agreed >= AGREED:
            del self._odd[name]
            self._manoeuvres.forget(name)  # No aircraft turns like that: what was told was wrong.
            return report
        self._odd[name] = (report, agreed)
        return replace(report, velocity_mps=known.velocity_mps)

    def _look_back(self, name: str, known: Intruder, report: Intruder) -> Intruder | None:
        """The newest report kept that is old enough; None if there is none."""
        kept = self._back.setdefault(name, [known])
        while len(kept) > 1 and report.time_s - kept[1].time_s >= LOOKED_BACK_S:
            del kept[0]
        if report.time_s - kept[-1].time_s >= LOOKED_BACK_S / 3.0:
            kept.append(report)
        return kept[0] if report.time_s - kept[0].time_s >= LOOKED_BACK_S else None

    def intruders(self, _own: State, now_s: float, /) -> tuple[list[Intruder], Mapping[str, int]]:
        if not self._latest and not self._stale:
            return [], {}
        self._forget_stale(now_s)
        left_out = {"intruder: stale": self._stale} if self._stale else {}
        self._stale = 0
        shown = [self._manoeuvres.with_manoeuvre(name, each) for name, each in self._latest.items()]
        return shown, left_out

    def _forget_stale(self, now_s: float) -> None:
        stale = [
            name for name, report in self._latest.items() if now_s - report.time_s > self._stale_s
        ]
        for name in stale:
            del self._latest[name]
            self._odd.pop(name, None)
            self._back.pop(name, None)
            self._manoeuvres.forget(name)
        if stale:
            self._namesakes = {
                told: names
                for told, names in self._namesakes.items()
                if any(name in self._latest for name in names)
            }
            self._doubted = {
                told: one for told, one in self._doubted.items() if told in self._namesakes
            }
        self._stale += len(stale)


class TrackedReports:
    """Reports as `intruders.tracker` makes tracks of them; speed and address tell own echoes."""

    def __init__(self, settings: TrackerSettings, speed_mps: float, address: str) -> None:
        self._speed_mps = speed_mps
        self._address = address
        self._tracks = Tracks(settings=settings)
        self._heard: list[Report] = []
        self._unasked = 0
        self._manoeuvres = Manoeuvres()

    def take(self, report: Intruder) -> str | None:
        self._heard.append(Report.of(report))
        # Where nobody asks, they would wait for ever.
        if len(self._heard) > MOST_UNASKED:
            self._heard.pop(0)
            self._unasked += 1
        return None

    def intruders(self, own: State, now_s: float, /) -> tuple[list[Intruder], Mapping[str, int]]:
        velocity = self._speed_mps * own.world_from_body[:, 0]
        ownship = Ownship(own.position_m, velocity, self._address)
        before = Counter(self._tracks.left_out)
        self._tracks = track_reports(self._tracks, self._heard, now_s, ownship)
        self._heard.clear()
        left_out = Counter(self._tracks.left_out) - before
        counts = Counter({f"report: {reason}": count for reason, count in left_out.items()})
        if self._unasked:
            counts["report: too many before a question"] += self._unasked
            self._unasked = 0
        return self._show_tracks(), counts

    def _show_tracks(self) -> list[Intruder]:
        """Tracks with the manoeuvres that they have shown from report to report."""
        tracks = {track.name: track for track in self._tracks.list_reported()}
        for name, track in tracks.items():
            self._manoeuvres.take(name, track)
        self._manoeuvres.keep(tracks)
        return [
            self._manoeuvres.with_manoeuvre(each.name, each) for each in self._tracks.intruders()
        ]


def _same_report(one: Intruder, other: Intruder) -> bool:
    """Whether two reports of one intruder say the same of the same moment."""
    return one.time_s == other.time_s and bool(
        np.array_equal(one.position_m, other.position_m)
        and np.array_equal(one.velocity_mps, other.velocity_mps)
    )
