"""Other aircraft of a recording as seen from the own one at a second: who can be judged, and who
not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.traffic import Intruder
from clearway.traffic.recorded.aircraft import FASTEST_RECORDED_MPS
from clearway.traffic.recorded.geodesy import axes_at
from clearway.traffic.recorded.placed import COAST_S, PlacedTrack
from clearway.traffic.volumes import Alerts, VolumeSet, alerts_after

SILENT = f"no report for more than {COAST_S:.0f} s"
NO_VELOCITY = "no speed and track, and no second position"
GROUNDED = "reported on the ground"
OWN_SILENT = f"the own aircraft: {SILENT}"
OWN_GROUNDED = f"the own aircraft: {GROUNDED}"
OWN_NO_VELOCITY = f"the own aircraft: {NO_VELOCITY}"
FARTHEST_M = 100_000.0
"""Aircraft farther away are in no list, unless a volume may reach them."""
ASSUMED_OWN = "height unknown, so the own height is assumed"
ASSUMED_MIXED = "barometric against geometric height, so the own height is assumed where it may be"
POSITIONS_TELL = "reported velocities disagree with the positions, which tell the velocity"
MIXED_M = 600.0
MIXED_SHARE = 0.1
"""How far a barometric and a geometric height of one place may differ: 60 hPa of pressure and 100 m
of geoid, and a tenth of the height for the temperature of the air."""


@dataclass(frozen=True, slots=True, eq=False)
class OtherTracks:
    """Other aircraft at the seconds of the own one; arrays [n] over rows, by second."""

    own: PlacedTrack
    address: tuple[str, ...]
    is_believed: tuple[bool, ...]
    """By address: whether reported velocities agree with positions."""
    aircraft: IntArray
    """[n] index of the address."""
    surface_m: FloatArray
    level_mps: FloatArray
    barometric_m: FloatArray
    geometric_m: FloatArray
    climb_mps: FloatArray
    is_silent: BoolArray
    is_grounded: BoolArray
    starts: IntArray
    """[own seconds + 1] first row of each own second."""

    @classmethod
    def of(cls, own: PlacedTrack, others: Sequence[PlacedTrack]) -> OtherTracks:
        """Others, placed at seconds at which the own aircraft is placed too."""
        nothing = np.zeros(0, dtype=np.int64)
        second = np.concatenate([nothing, *(one.second for one in others)])
        order = np.argsort(second, kind="stable")

        def rows(name: str) -> FloatArray:
            shape = getattr(own, name).shape[1:]
            each = [getattr(one, name) for one in others]
            return np.concatenate([np.zeros((0, *shape)), *each])[order]

        index = [np.full(len(one.second), n) for n, one in enumerate(others)]
        starts = np.searchsorted(second[order], own.second)
        return cls(
            own,
            tuple(one.address for one in others),
            tuple(one.is_believed for one in others),
            np.concatenate([nothing, *index])[order],
            rows("surface_m"),
            rows("level_mps"),
            rows("barometric_m"),
            rows("geometric_m"),
            rows("climb_mps"),
            rows("is_silent").astype(np.bool_),
            rows("is_grounded").astype(np.bool_),
            np.append(starts, len(order)),
        )


@dataclass(frozen=True, slots=True, eq=False)
class JudgedSecond:
    """What there is to say at one own second."""

    own_mps: FloatArray
    """[3] east, north, up; the own aircraft is at the origin."""
    own_doubt: str
    """Why nobody can be judged at this second; empty where others can."""
    judged: list[Intruder]
    covered: list[str]
    """Addresses of all that are judged, be it as too far away to matter."""
    not_judged: dict[str, str]
    """Reason by address, of those that may be in a volume or on the way into one."""
    assumed: list[tuple[str, str]]
    """Address, and what is assumed about it, of those that are near enough to matter."""


def judge_at(tracks: OtherTracks, at: int, volumes: VolumeSet) -> JudgedSecond:
    """Others at a row of the own aircraft.

    A height that is not known counts as the own one. A barometric height beside a geometric one
    counts as the own height where the two may be the same within the time that alerts look ahead.
    """
    own = tracks.own
    rows = np.arange(tracks.starts[at], tracks.starts[at + 1])
    axes = axes_at(own.surface_m[at])
    place = (tracks.surface_m[rows] - own.surface_m[at]) @ axes.T
    velocity = tracks.level_mps[rows] @ axes.T
    velocity[:, 2] = tracks.climb_mps[rows]
    own_mps = axes @ own.level_mps[at]
    own_mps[2] = own.climb_mps[at]
    place[:, 2], velocity[:, 2], assumed = _heights(tracks, at, rows, own_mps[2], volumes)
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    closing = np.where(np.isnan(speed), FASTEST_RECORDED_MPS, speed) + np.nan_to_num(
        np.hypot(own_mps[0], own_mps[1]), nan=FASTEST_RECORDED_MPS
    )
    away = np.hypot(place[:, 0], place[:, 1])
    matters = away <= _reach_m(volumes, closing)
    names = [tracks.address[n] for n in tracks.aircraft[rows]]
    reason = np.full(len(rows), "", dtype=object)
    reason[tracks.is_silent[rows]] = SILENT
    reason[tracks.is_grounded[rows]] = GROUNDED
    reason[np.isnan(speed)] = NO_VELOCITY
    own_doubt = _own_doubt(own, at)
    if own_doubt:
        reason[:] = own_doubt
    blind = np.isnan(speed) | np.isnan(own_mps[0])
    time_s = float(own.second[at])
    intruders = {
        n: Intruder(place[n], velocity[n], name=names[n], time_s=time_s)
        for n in np.flatnonzero(~blind & (matters | ((reason == "") & (away <= FARTHEST_M))))
    }
    doubtful = [one for n, one in intruders.items() if reason[n]]
    asked = alerts_after(Alerts(), volumes, np.zeros(3), own_mps, doubtful, time_s)
    would = {alert.name for alert in asked.alerts if alert.asked}
    missed = {
        names[n]: reason[n]
        for n in np.flatnonzero(matters & (reason != ""))
        if blind[n] or names[n] in would
    }
    return JudgedSecond(
        own_mps,
        own_doubt,
        [one for n, one in intruders.items() if not reason[n]],
        [name for name in names if name not in missed],
        missed,
        [(names[n], assumed[n]) for n in np.flatnonzero(matters & (reason == "")) if assumed[n]]
        + [
            (names[n], POSITIONS_TELL)
            for n in np.flatnonzero(matters & (reason == ""))
            if not tracks.is_believed[tracks.aircraft[rows[n]]]
        ],
    )


def _own_doubt(own: PlacedTrack, at: int) -> str:
    """Why the own aircraft is no place to look from; empty where it is one."""
    if np.isnan(own.level_mps[at]).any():
        return OWN_NO_VELOCITY
    if own.is_grounded[at]:
        return OWN_GROUNDED
    return OWN_SILENT if own.is_silent[at] else ""


def _heights(
    tracks: OtherTracks, at: int, rows: IntArray, own_climb_mps: float, volumes: VolumeSet
) -> tuple[FloatArray, FloatArray, list[str]]:
    """[n] heights above the own aircraft, [n] climbs, and what is assumed about each."""
    own_barometric, own_geometric = tracks.own.barometric_m[at], tracks.own.geometric_m[at]
    barometric, geometric = tracks.barometric_m[rows], tracks.geometric_m[rows]
    above = barometric - own_barometric
    above = np.where(np.isnan(above), geometric - own_geometric, above)
    own_m = own_geometric if np.isnan(own_barometric) else own_barometric
    other_m = np.where(np.isnan(barometric), geometric, barometric)
    mixed = np.isnan(above) & ~np.isnan(other_m - own_m)
    change = tracks.climb_mps[rows] - own_climb_mps
    apart = np.where(mixed, other_m - own_m, 0.0)
    later = apart + change * volumes.look_ahead_s
    nearest = np.where(apart * later <= 0.0, 0.0, np.minimum(np.abs(apart), np.abs(later)))
    off = MIXED_M + MIXED_SHARE * np.maximum(np.abs(other_m), abs(own_m))
    clear = mixed & (nearest > off)
    above = np.where(clear, apart - np.sign(apart) * off, above)
    unknown = np.isnan(above)
    climb = np.where(unknown, own_climb_mps, tracks.climb_mps[rows])
    words = np.where(mixed, ASSUMED_MIXED, np.where(unknown, ASSUMED_OWN, ""))
    return np.where(unknown, 0.0, above), climb, words.tolist()


def _reach_m(volumes: VolumeSet, closing_mps: FloatArray) -> FloatArray:
    """[n] distances beyond which no rule can ask for an alert, at closing speeds [n]."""
    reach = np.zeros(len(closing_mps))
    for rule in volumes.rules:
        volume = rule.volume
        grown = volume.radius_m + volume.growth_mps * rule.within_s
        reach = np.maximum(reach, grown + (rule.within_s + volume.tau_s) * closing_mps)
    return reach
