"""The part of one aircraft in an encounter, for the ownship to take: start, speed and route."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.brief import brief
from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray
from clearway.traffic.recorded.aircraft import Aircraft
from clearway.traffic.recorded.closest import ClosestPair
from clearway.traffic.recorded.playing import PlayedTrack, play_track

BEFORE_S = 90.0
AFTER_S = 90.0
"""Flown before and after the closest point of the recording, as far as it reaches."""
LONGEST_SILENCE_S = 60.0
"""The route bridges silences up to this; beyond, nobody knows where the aircraft went."""
LEAST_BEFORE_S = 15.0
SLOWEST_ROUTE_MPS = 2.0
"""What is slower hovers or drifts, and has no course to fly."""
LEG_S = 30.0
"""Of a leg of the route: shorter ones than the look-ahead are flown badly, for a decision knows of
two waypoints only."""


@dataclass(frozen=True, eq=False)
class OwnPart:
    """What the ownship flies in place of `own`; local frame, times since the start of the flight.

    Its corners lie on the recorded track, one of them where the two were closest. The speed is that
    of the aircraft from the start to there, so that who flies the route without avoidance is at the
    encounter when the aircraft was.
    """

    own: Aircraft
    other: Aircraft
    origin_geodetic: tuple[float, float, float]
    """Latitude, longitude, altitude of the closest point, barometric where both report it."""
    geometric: bool
    """Whether heights are geometric, since one of the two reports no barometric ones."""
    from_s: float
    """Time of the recording at which the flight begins."""
    closest_s: float
    """Time of the closest point."""
    speed_mps: float
    start_m: FloatArray
    """[3]"""
    attitude_rad: FloatArray
    """[3] level, on the course to the first corner."""
    waypoints_m: FloatArray
    """[n, 3] corners of the recorded track, and straight on where it ends too early."""
    recorded: PlayedTrack
    """All of the own track, with its gaps."""
    until_s: float
    """When the last waypoint is due."""

    __repr__ = brief


def take_part(
    pair: ClosestPair,
    own_address: str | None = None,
    before_s: float = BEFORE_S,
    after_s: float = AFTER_S,
    leg_s: float = LEG_S,
) -> OwnPart:
    """The place of one aircraft of a pair, the first one where none is named.

    Raises InputError if the pair has no such aircraft, or too little is recorded of it.
    """
    own, other = _choose(pair, own_address)
    geometric = bool(np.isnan(own.barometric_m).all() or np.isnan(other.barometric_m).all())
    origin = (pair.latitude_deg, pair.longitude_deg, pair.altitude_m)
    time_s, places = _usable(
        own.address,
        play_track(own, origin, pair.time_s, geometric=geometric),
        before_s,
        after_s,
    )
    corners, closest = _corners(time_s, places, leg_s)
    from_s = pair.time_s + float(time_s[0])
    course = corners[1] - corners[0]
    legs_m = np.linalg.norm(np.diff(corners[: closest + 1], axis=0), axis=1)
    speed_mps = float(legs_m.sum() / -time_s[0])
    if speed_mps < SLOWEST_ROUTE_MPS:
        raise InputError(
            own.address,
            f"it flies at {speed_mps:.1f} m/s before the encounter, and a route needs at least "
            f"{SLOWEST_ROUTE_MPS:.0f}; type --as {other.address}",
        )
    leg_m = speed_mps * leg_s
    recorded = play_track(own, origin, from_s, geometric=geometric)
    assert recorded is not None
    return OwnPart(
        own=own,
        other=other,
        origin_geodetic=origin,
        geometric=geometric,
        from_s=from_s,
        closest_s=pair.time_s - from_s,
        speed_mps=speed_mps,
        start_m=corners[0],
        attitude_rad=np.array([0.0, 0.0, np.arctan2(course[1], course[0])]),
        waypoints_m=_straight_on(corners, speed_mps * (after_s - float(time_s[-1])), leg_m)[1:],
        recorded=recorded,
        until_s=after_s - float(time_s[0]),
    )


def _choose(pair: ClosestPair, own_address: str | None) -> tuple[Aircraft, Aircraft]:
    """The own aircraft and the other, by address or callsign."""
    if own_address is None:
        return pair.first, pair.second
    wanted = own_address.strip().lower()
    for own, other in ((pair.first, pair.second), (pair.second, pair.first)):
        if wanted in (own.address.lower(), own.callsign.lower()):
            return own, other
    names = " or ".join(
        f"{one.address} ({one.callsign})" if one.callsign else one.address
        for one in (pair.first, pair.second)
    )
    raise InputError("own aircraft", f"{own_address!r} is not in this encounter; valid: {names}")


def _usable(
    address: str, track: PlayedTrack | None, before_s: float, after_s: float
) -> tuple[FloatArray, FloatArray]:
    """Times [n] since the closest point and places [n, 3] that a route can be made of."""
    if track is None:
        raise InputError(address, "no altitude of it is known, so nothing can be flown")
    rows = _unbroken(track.time_s, before_s, after_s)
    time_s, places = track.time_s[rows], track.position_m[rows]
    if len(time_s) < 2 or time_s[0] > -LEAST_BEFORE_S or time_s[-1] < -1.0:
        raise InputError(
            address,
            f"too little is recorded of it before the encounter: {LEAST_BEFORE_S:.0f} s are "
            f"needed, without a silence of more than {LONGEST_SILENCE_S:.0f} s",
        )
    return time_s, places


def _unbroken(time_s: FloatArray, before_s: float, after_s: float) -> BoolArray:
    """[n] reports around time 0, between the silences next to it that are too long."""
    breaks = np.flatnonzero(np.diff(time_s) > LONGEST_SILENCE_S)
    earliest = max((time_s[at + 1] for at in breaks if time_s[at + 1] <= 0.0), default=-np.inf)
    latest = min((time_s[at] for at in breaks if time_s[at] > 0.0), default=np.inf)
    first, last = max(-before_s, earliest), min(after_s, latest)
    inside: BoolArray = (time_s >= first) & (time_s <= last)
    return inside


def _corners(time_s: FloatArray, places_m: FloatArray, leg_s: float) -> tuple[FloatArray, int]:
    """Corners [n, 3] of a route along a track, one of them at time 0, and which one that is.

    Legs are as long as the aircraft flies in `leg_s` at its mean speed before time 0.
    """
    steps = np.linalg.norm(np.diff(places_m[:, :2], axis=0), axis=1)
    flown = np.concatenate([[0.0], np.cumsum(steps)])
    here = float(np.interp(0.0, time_s, flown))
    leg = max(1.0, leg_s * here / -float(time_s[0]))
    before = here - leg * np.arange(int(here / leg + 0.5), 0, -1)
    after = np.arange(here, flown[-1] - 0.5 * leg, leg)
    at = np.concatenate([[0.0], before[before > 0.5 * leg], after, flown[-1:]])
    corners = np.column_stack([np.interp(at, flown, places_m[:, axis]) for axis in range(3)])
    return corners, len(at) - len(after) - 1


def _straight_on(corners_m: FloatArray, more_m: float, leg_m: float) -> FloatArray:
    """The corners and, level along the last course, another one; or the last one moved there."""
    course = corners_m[-1] - corners_m[-2]
    course[2] = 0.0
    end = corners_m[-1] + more_m * course / max(float(np.linalg.norm(course)), 1e-9)
    kept = corners_m if more_m > 0.5 * leg_m else corners_m[:-1]
    return np.vstack([kept, end])
