"""Reports of intruders: made into tracks, or believed each as it comes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol

import numpy as np

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


def reports_for(
    tracker: TrackerSettings | None, stale_s: float, speed_mps: float, address: str
) -> Reports:
    """Tracks where there are settings for them, else the latest reports; nothing heard yet.

    stale_s: how long the latest reports are believed; the tracker has its own limit. speed_mps and
    address: the own ones.
    """
    if tracker is None:
        return LatestReports(stale_s, address)
    return TrackedReports(tracker, speed_mps, address)


class LatestReports:
    """The latest report of each intruder, save own, repeated, late and stale ones."""

    def __init__(self, stale_s: float, address: str) -> None:
        self._stale_s = stale_s
        self._address = address
        self._latest: dict[str, Intruder] = {}
        self._manoeuvres = Manoeuvres()
        self._anonymous = self._stale = 0
        self._room = MOST_UNASKED

    def take(self, report: Intruder) -> str | None:
        if self._address and self._address in (report.address, report.name):
            return "intruder: ownship"
        # Reports of nobody in particular cannot replace each other: each counts until it is stale.
        self._anonymous += 1
        name = report.address or report.name or f"anonymous {self._anonymous}"
        if len(self._latest) >= self._room:
            self._forget_stale(report.time_s)
            self._room = max(MOST_UNASKED, 2 * len(self._latest))
        known = self._latest.get(name)
        if known is not None and report.time_s < known.time_s:
            return "intruder: late report"
        if known is not None and _same_report(report, known):
            return "intruder: duplicate"
        self._latest[name] = report if report.name else replace(report, name=name)
        self._manoeuvres.take(name, report)
        return None

    def intruders(self, _own: State, now_s: float, /) -> tuple[list[Intruder], Mapping[str, int]]:
        if not self._latest and not self._stale:
            return [], {}
        self._forget_stale(now_s)
        left_out = {"intruder: stale": self._stale} if self._stale else {}
        self._stale = 0
        shown = [self._manoeuvres.shown_by(name, each) for name, each in self._latest.items()]
        return shown, left_out

    def _forget_stale(self, now_s: float) -> None:
        stale = [
            name for name, report in self._latest.items() if now_s - report.time_s > self._stale_s
        ]
        for name in stale:
            del self._latest[name]
            self._manoeuvres.forget(name)
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
        return self._shown(), counts

    def _shown(self) -> list[Intruder]:
        """Tracks with the manoeuvres that they have shown from report to report."""
        tracks = {track.name: track for track in self._tracks.reported()}
        for name, track in tracks.items():
            self._manoeuvres.take(name, track)
        self._manoeuvres.keep(tracks)
        return [self._manoeuvres.shown_by(each.name, each) for each in self._tracks.intruders()]


def _same_report(one: Intruder, other: Intruder) -> bool:
    """Whether two reports of one intruder say the same of the same moment."""
    return one.time_s == other.time_s and bool(
        np.array_equal(one.position_m, other.position_m)
        and np.array_equal(one.velocity_mps, other.velocity_mps)
    )
