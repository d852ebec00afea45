"""The tracker: reports in, tracks out; what is not a report of another aircraft is left out.

Each call takes the reports since the last one: screening, prediction, assignment by address and
by least total surprise within a gate, update, birth, and the end of tracks that are long unheard.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from types import MappingProxyType

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.traffic.intruder import Intruder
from clearway.traffic.tracking.screening import (
    LEFT_OUT,
    Ownship,
    TrackerSettings,
    flaw_of_report,
    flaw_of_sequel,
)
from clearway.traffic.tracking.sequels import MOST_NAMESAKES, can_follow
from clearway.traffic.tracking.tracks import Report, Track, begin_heard_track


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """All tracks, and what has been counted since the start."""

    time_s: float = -math.inf
    """Time of the last call."""
    tracks: tuple[Track, ...] = ()
    """Each at the time of its last report."""
    born: int = 0
    """Tracks ever begun."""
    ended: int = 0
    """Believed tracks that ended because nothing was reported of them."""
    left_out: Mapping[str, int] = field(
        default_factory=lambda: MappingProxyType(dict.fromkeys(LEFT_OUT, 0))
    )
    """Reports left out, by the reasons of LEFT_OUT."""
    settings: TrackerSettings = field(default_factory=TrackerSettings)
    doubted: Mapping[str, Report] = field(default_factory=lambda: MappingProxyType({}))
    """Of each address the last report that none of its tracks can have sent."""

    def list_reported(self) -> list[Intruder]:
        """Believed tracks as intruders, each at the time of its last report."""
        return [track.intruder() for track in self.tracks if _is_believed(track, self.settings)]

    def intruders(self) -> list[Intruder]:
        """Believed tracks as intruders, world frame, predicted to the time of the last call."""
        noise = self.settings.acceleration_std_mps2
        return [
            track.at(self.time_s, noise).intruder()
            for track in self.tracks
            if _is_believed(track, self.settings)
        ]


def track_reports(
    tracks: Tracks, reports: Sequence[Report], time_s: float, ownship: Ownship | None = None
) -> Tracks:
    """Tracks at `time_s` after the reports that came since the last call, in any order.

    Reports of the ownship, doubled, stale and impossible ones are left out and counted. Raises
    ClearwayError if time runs backwards.
    """
    if not time_s >= tracks.time_s:
        raise ClearwayError(f"tracker: time runs backwards, from {tracks.time_s} to {time_s} s")
    settings = tracks.settings
    counts = Counter(tracks.left_out)
    good = []
    for report in reports:
        reason = flaw_of_report(report, time_s, ownship, settings)
        if reason:
            counts[reason] += 1
        else:
            good.append(report)
    now = tracks
    for _, group in groupby(sorted(good, key=_report_time), key=_report_time):
        now = _take(now, list(group), counts)
    gone = [track for track in now.tracks if not _is_alive(track, time_s, settings)]
    return replace(
        now,
        time_s=time_s,
        tracks=tuple(track for track in now.tracks if track not in gone),
        ended=now.ended + sum(_is_believed(track, settings) for track in gone),
        left_out=MappingProxyType(dict(counts)),
    )


def _report_time(report: Report) -> float:
    return report.time_s


def _is_believed(track: Track, settings: TrackerSettings) -> bool:
    return bool(track.address) or track.reports >= settings.confirm_reports


def _is_alive(track: Track, time_s: float, settings: TrackerSettings) -> bool:
    longest = settings.coast_s if _is_believed(track, settings) else settings.tentative_s
    return time_s - track.time_s <= longest


def _take(now: Tracks, reports: list[Report], counts: Counter[str]) -> Tracks:
    """Tracks after reports of one moment; `counts` grows by those that are left out."""
    settings, began, doubted = now.settings, now.born, dict(now.doubted)
    tracks = list(now.tracks)
    strangers = []
    for report in reports:
        flaws = {
            n: flaw_of_sequel(track, report, settings)
            for n, track in enumerate(tracks)
            if _same_address(track, report)
        }
        mine = next((n for n, flaw in flaws.items() if flaw is None), None)
        if not flaws:
            strangers.append(report)
        elif mine is not None:
            tracks[mine] = _follow(tracks[mine], report, settings)
        elif _is_namesake(doubted, report, flaws.values()):
            began += 1
            again = begin_heard_track(began, report, settings.unknown_velocity_std_mps)
            tracks.append(replace(again, namesake=len(flaws) + 1))
        else:
            counts[next(flaw for flaw in flaws.values() if flaw)] += 1
    for report, mine in _assign(tracks, strangers, settings):
        if mine is not None:
            tracks[mine] = _follow(tracks[mine], report, settings)
        elif any(_fits(track, report, settings) for track in tracks):
            counts["duplicate"] += 1
        else:
            began += 1
            tracks.append(begin_heard_track(began, report, settings.unknown_velocity_std_mps))
    return replace(now, tracks=tuple(tracks), born=began, doubted=MappingProxyType(doubted))


def _same_address(track: Track, report: Report) -> bool:
    return bool(report.address) and track.address.lower() == report.address.lower()


def _is_namesake(doubted: dict[str, Report], report: Report, flaws: Collection[str | None]) -> bool:
    """Whether this is the second report of another aircraft with an address; it is remembered."""
    if set(flaws) != {"impossible"}:
        return False
    before = doubted.get(report.address.lower())
    doubted[report.address.lower()] = report
    if before is None or before.time_s >= report.time_s or len(flaws) >= MOST_NAMESAKES:
        return False
    return can_follow(_as_intruder(before), _as_intruder(report))


def _as_intruder(report: Report) -> Intruder:
    return begin_heard_track(0, report, 0.0).intruder()


def _fits(track: Track, report: Report, settings: TrackerSettings) -> bool:
    there = track.at(report.time_s, settings.acceleration_std_mps2)
    return there.surprise(report) <= settings.gate**2


def _follow(track: Track, report: Report, settings: TrackerSettings) -> Track:
    """The track after its next report; one that it did not expect at all starts it anew."""
    there = track.at(report.time_s, settings.acceleration_std_mps2)
    if there.surprise(report) <= settings.gate**2:
        return there.update(report)
    fresh = begin_heard_track(track.identity, report, settings.unknown_velocity_std_mps)
    return replace(fresh, reports=track.reports + 1, namesake=track.namesake)


def _assign(
    tracks: Sequence[Track], reports: Sequence[Report], settings: TrackerSettings
) -> list[tuple[Report, int | None]]:
    """Reports with the track of each, or None, at the least total surprise within the gate."""
    from scipy.optimize import linear_sum_assignment

    if not reports:
        return []
    gate2 = settings.gate**2
    never = 1e6 * gate2
    cost = np.full((len(reports), len(tracks) + len(reports)), never)
    for r, report in enumerate(reports):
        # To stay without a track costs as much as the least likely one.
        cost[r, len(tracks) + r] = gate2
        for t, track in enumerate(tracks):
            others = bool(track.address) and bool(report.address)
            if others or track.time_s >= report.time_s:
                continue
            there = track.at(report.time_s, settings.acceleration_std_mps2)
            cost[r, t] = min(never, there.surprise(report))
    rows, columns = linear_sum_assignment(cost)
    return [
        (reports[r], int(t) if t < len(tracks) else None)
        for r, t in zip(rows, columns, strict=True)
    ]
