"""A recording looked at through volumes: the alerts and bands of one aircraft, every second."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from clearway.avoidance.long_range.bands import Bands, bands
from clearway.base.errors import InputError
from clearway.io.traffic.traffic_rows import ELSEWHERE, NO_ADDRESS
from clearway.missions.judged_traffic import (
    OWN_SILENT,
    POSITIONS_TELL,
    JudgedSecond,
    OtherTracks,
    judge_at,
)
from clearway.missions.own_aircraft import find_own_aircraft
from clearway.traffic.recorded import TrafficRecording, collect_aircraft
from clearway.traffic.recorded.aircraft import Aircraft
from clearway.traffic.recorded.ghosts import ghosts_of
from clearway.traffic.recorded.placed import PlacedTrack, place_aircraft
from clearway.traffic.recorded.shared_address import split_address
from clearway.traffic.volumes import AlertLevel, Alerts, VolumeSet, alerts_after
from clearway.vehicle.performance import Performance

NEVER_PLACED = "heard, but reports no position"
ALIKE_MPS = 10.0
ALIKE_SHARE = 0.3
"""Radar tracks lag in turns: so far a velocity, or so much of it, may differ from the own one."""
OWN_GHOST = "a radar's track (TIS-B) of the own aircraft"


@dataclass(frozen=True, slots=True, eq=False)
class AlertSecond:
    """One second of the ownship."""

    time_s: float
    alerts: Alerts
    bands: Bands | None
    """Where there is an alert."""


@dataclass(frozen=True, slots=True)
class NotJudged:
    """An aircraft that may have come near, and cannot be judged for some time."""

    address: str
    """Empty for messages that name no aircraft."""
    reason: str
    seconds: int


@dataclass(frozen=True, slots=True, eq=False)
class AlertHistory:
    """What was alerted when, and what could not be judged."""

    own: str
    volumes: VolumeSet
    seconds: tuple[AlertSecond, ...]
    """Those at which the own aircraft is placed and in flight."""
    judged: tuple[str, ...]
    """Addresses of the aircraft that were judged, at all times or some."""
    not_judged: tuple[NotJudged, ...] = ()
    notes: tuple[str, ...] = ()
    """What was assumed, or found odd; to be shown."""

    def changes(self) -> list[tuple[float, str, AlertLevel]]:
        """(time, intruder, level) whenever the level of an intruder changes."""
        level: dict[str, AlertLevel] = {}
        found = []
        for second in self.seconds:
            for alert in second.alerts.alerts:
                if alert.level is not level.get(alert.name, AlertLevel.NONE):
                    found.append((second.time_s, alert.name, alert.level))
                level[alert.name] = alert.level
        return found

    def as_dict(self) -> dict[str, Any]:
        """For machines: changes of level, every second that has an alert, what was not judged."""
        return {
            "own": self.own,
            "volumes": self.volumes.name,
            "judged_s": len(self.seconds),
            "judged": list(self.judged),
            "not_judged": [
                {"address": one.address, "reason": one.reason, "seconds": one.seconds}
                for one in self.not_judged
            ],
            "notes": list(self.notes),
            "changes": [
                {"time_s": time_s, "intruder": name, "level": level.name.lower()}
                for time_s, name, level in self.changes()
            ],
            "seconds": [
                {
                    "time_s": second.time_s,
                    "alerts": [alert.as_dict() for alert in second.alerts.alerts],
                    "bands": None if second.bands is None else second.bands.as_dict(),
                }
                for second in self.seconds
                if second.alerts.level
            ],
        }


def judge_recording(
    recording: TrafficRecording, own: str | None, volumes: VolumeSet, performance: Performance
) -> AlertHistory:
    """`alert_history` of a recording, with what it holds that cannot be placed.

    own: an address or callsign; None for the one that the recording names as its own. Raises
    InputError where it is not clear which aircraft is the own one.
    """
    aircraft = collect_aircraft(recording)
    mine = find_own_aircraft(aircraft, own, recording)
    history = alert_history(aircraft, mine.address, volumes, performance)
    seconds = len(history.seconds)
    there = {one.address for one in aircraft}
    missed = [
        NotJudged(name, NEVER_PLACED, seconds) for name in recording.heard if name not in there
    ]
    if nameless := recording.left_out.get(NO_ADDRESS, 0):
        missed.append(NotJudged("", f"{nameless} messages name no aircraft", seconds))
    if double := recording.left_out.get(ELSEWHERE, 0):
        missed.append(NotJudged("", f"{double} messages: {ELSEWHERE}", seconds))
    return replace(
        history,
        not_judged=(*history.not_judged, *sorted(missed, key=lambda one: one.address)),
        notes=(*recording.notes, *history.notes),
    )


def alert_history(
    aircraft: Sequence[Aircraft], own: str, volumes: VolumeSet, performance: Performance
) -> AlertHistory:
    """Alerts of the aircraft of an address or callsign about all others, every whole second.

    Every aircraft that can be placed is judged: positions are straight between reports and for
    30 s after one, a velocity that is not reported comes from positions, a height that is not known
    counts as the own one. Several that report by one address are all judged, as "address (2)" and
    so on. What cannot be judged, though it may have come near, is in `not_judged`.
    Raises InputError for an own aircraft that is not there, or never flies.
    """
    named = find_own_aircraft(aircraft, own)
    mine, *doubtful = split_address(named)
    here = place_aircraft(mine).until(math.ceil(max(one.time_s[-1] for one in aircraft)))
    parts = [split_address(one) for one in aircraft if one is not named]
    others = doubtful + [part for several in parts for part in several]
    doubles = ghosts_of([mine, *(one for one in others if one.source == "tisb")])
    there = [place_aircraft(one, here.second) for one in others]
    ghosts = [one.address for one in there if one.address in doubles and _fly_alike(here, one)]
    there = [one for one in there if one.address not in ghosts]
    tracks = OtherTracks.of(here, there)
    now, seconds = Alerts(), []
    judged: set[str] = set()
    missed: Counter[tuple[str, str]] = Counter()
    assumed: Counter[tuple[str, str]] = Counter()
    if not here.is_believed:
        assumed[mine.address, POSITIONS_TELL] = len(here.second)
    for at in range(len(here.second)):
        seen = judge_at(tracks, at, volumes)
        missed.update(seen.not_judged.items())
        if seen.own_doubt:
            continue
        time_s = float(here.second[at])
        assumed.update(seen.assumed)
        judged.update(seen.covered)
        now, shown = _alert_on(now, volumes, performance, seen, time_s)
        seconds.append(AlertSecond(time_s, now, shown))
    if not seconds:
        why = judge_at(tracks, 0, volumes).own_doubt if len(here.second) else OWN_SILENT
        raise InputError(
            f"own aircraft {mine.address!r}",
            f"nothing can be judged at any second: {why}; type --own and another address",
        )
    missed.update({(ghost, OWN_GHOST): len(seconds) for ghost in ghosts})
    return AlertHistory(
        mine.address,
        volumes,
        tuple(seconds),
        tuple(sorted(judged)),
        tuple(NotJudged(name, why, n) for (name, why), n in sorted(missed.items())),
        tuple(f"{name}: {what} ({n} s)" for (name, what), n in sorted(assumed.items())),
    )


def _fly_alike(own: PlacedTrack, other: PlacedTrack) -> bool:
    """Whether two fly at one velocity, as a radar's track of the own aircraft does, and no other
    that passes close by."""
    _, here, there = np.intersect1d(own.second, other.second, return_indices=True)
    apart_mps = np.linalg.norm(other.level_mps[there] - own.level_mps[here], axis=1)
    speed_mps = np.linalg.norm(own.level_mps[here], axis=1)
    known = ~np.isnan(apart_mps)
    alike_mps = np.maximum(ALIKE_MPS, ALIKE_SHARE * speed_mps[known])
    return bool(np.mean(apart_mps[known] <= alike_mps) > 0.5) if known.any() else False


def _alert_on(
    before: Alerts, volumes: VolumeSet, performance: Performance, seen: JudgedSecond, time_s: float
) -> tuple[Alerts, Bands | None]:
    """Alerts of one second after those before it, and bands where there is one."""
    origin, own_mps, others = np.zeros(3), seen.own_mps, seen.judged
    now = alerts_after(before, volumes, origin, own_mps, others, time_s)
    if not now.level:
        return now, None
    shown = bands(volumes, performance, origin, own_mps, others, time_s)
    if shown.saturated:
        now = alerts_after(before, volumes, origin, own_mps, others, time_s, saturated=True)
    return now, shown
