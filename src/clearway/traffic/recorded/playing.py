"""Recorded traffic played in a simulated flight: true where it was reported, told as it was
reported.

The aircraft fly as recorded, whatever the ownship does. Their positions are interpolated between
reports over at most 12 s; where an aircraft is silent for longer, nobody knows where it was, so it
is not there. Reports reach the ownship at their recorded times.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from clearway.base.frames import FloatArray, enu_from_geodetic
from clearway.base.made import TimedPlaces
from clearway.base.state import BoolArray, IntArray, State, freeze_array
from clearway.obstacles.obstacle import Obstacle
from clearway.traffic import Intruder
from clearway.traffic.recorded.aircraft import FASTEST_RECORDED_MPS, LONGEST_GAP_S, Aircraft
from clearway.traffic.recorded.local import POSITION_STD_M, VELOCITY_STD_MPS

CLIMB_WINDOW_S = 20.0
"""Altitudes come in steps: where no climb is reported, it is the mean over so long."""
UNTOLD_VELOCITY_STD_MPS = 5.0
"""Of a velocity that is taken from the last two positions."""


@dataclass(frozen=True, eq=False)
class PlayedTrack:
    """One aircraft in the local frame, at the times of the flight; arrays [n] over its reports."""

    name: str
    time_s: FloatArray
    position_m: FloatArray
    """[n, 3]"""
    velocity_mps: FloatArray
    """[n, 3] as told; from earlier positions where it is not. NaN where neither is known."""
    velocity_std_mps: FloatArray
    radius_m: float
    """Half of the altitude steps of both aircraft: how far the height between them may be off."""
    known: BoolArray = field(init=False, repr=False)
    """[n - 1] between which reports it may be interpolated."""

    def __post_init__(self) -> None:
        for name in ("time_s", "velocity_std_mps"):
            object.__setattr__(self, name, freeze_array(getattr(self, name), (len(self.time_s),)))
        for name in ("position_m", "velocity_mps"):
            object.__setattr__(self, name, freeze_array(getattr(self, name), (len(self.time_s), 3)))
        silence = np.diff(self.time_s)
        level = np.linalg.norm(np.diff(self.position_m[:, :2], axis=0), axis=1)
        known = (silence <= LONGEST_GAP_S) & (level <= FASTEST_RECORDED_MPS * silence)
        object.__setattr__(self, "known", known)

    def at(self, time_s: float) -> FloatArray | None:
        """[3] position at a time; None where it is not reported."""
        after = bisect_right(self.time_s, time_s + 1e-9)
        if after == 0:
            return None
        if after == len(self.time_s) or not self.known[after - 1]:
            alone = time_s - self.time_s[after - 1] <= 1e-6
            return np.asarray(self.position_m[after - 1]) if alone else None
        before_s, after_s = self.time_s[after - 1], self.time_s[after]
        share = (time_s - before_s) / (after_s - before_s)
        before_m, after_m = self.position_m[after - 1], self.position_m[after]
        return np.asarray(before_m + share * (after_m - before_m))


class RecordedTraffic:
    """The aircraft of a recording during one flight, as `simulation.simulate` asks for traffic.

    tracks: times are those of the flight. heard_within_m: reports of aircraft farther than this
    from the ownship, horizontally, are not heard. deaf: no report at all reaches the ownship.
    """

    def __init__(
        self, tracks: Sequence[PlayedTrack], heard_within_m: float = np.inf, deaf: bool = False
    ) -> None:
        self.tracks: dict[str, TimedPlaces] = {}
        self._played = tuple(tracks)
        self._heard_within_m, self._deaf = heard_within_m, deaf
        # What was reported shortly before is known at the start.
        self._told = {one.name: bisect_left(one.time_s, -LONGEST_GAP_S) for one in tracks}
        self._own = np.zeros(3)

    def step(self, own: State) -> None:
        """Move on to the time of the own true state."""
        self._own = own.position_m
        for track in self._played:
            place = track.at(own.time_s)
            if place is not None:
                self.tracks.setdefault(track.name, TimedPlaces()).append((own.time_s, place))

    def reports(self, time_s: float) -> list[Intruder]:
        """What has been reported since the last call, up to a time, in the world frame."""
        heard: list[Intruder] = []
        for track in self._played:
            first = self._told[track.name]
            last = bisect_right(track.time_s, time_s + 1e-9)
            self._told[track.name] = last
            if not self._deaf:
                heard += [_report(track, at) for at in range(first, last) if self._hears(track, at)]
        return sorted(heard, key=lambda report: report.time_s)

    def bodies(self, time_s: float) -> list[Obstacle]:
        """None: what a range sensor would have seen of them is not recorded."""
        del time_s
        return []

    def radii_m(self) -> dict[str, float]:
        """How far the height above or below each aircraft may be off, by name."""
        return {track.name: track.radius_m for track in self._played}

    def _hears(self, track: PlayedTrack, at: int) -> bool:
        away = np.linalg.norm(track.position_m[at, :2] - self._own[:2])
        return bool(away <= self._heard_within_m and not np.isnan(track.velocity_mps[at]).any())


def _report(track: PlayedTrack, at: int) -> Intruder:
    return Intruder(
        track.position_m[at],
        track.velocity_mps[at],
        radius_m=track.radius_m,
        name=track.name,
        time_s=float(track.time_s[at]),
        position_std_m=POSITION_STD_M,
        velocity_std_mps=float(track.velocity_std_mps[at]),
        address=track.name,
    )


def play_track(
    aircraft: Aircraft,
    origin_geodetic: npt.ArrayLike,
    from_s: float,
    *,
    geometric: bool = False,
    own_step_m: float = 0.0,
) -> PlayedTrack | None:
    """An aircraft in the frame of a mission, east-north-up; None if its height is never known.

    from_s: time of the recording at which the flight begins. geometric: heights above the ellipsoid
    in place of barometric ones; the two are never mixed. own_step_m: step of the own altitudes.
    Reports on the ground, and those without a height of that kind, are left out.
    """
    height = aircraft.geometric_m if geometric else aircraft.barometric_m
    use = np.flatnonzero(~np.isnan(height) & ~aircraft.on_ground)
    if not len(use):
        return None
    time_s = aircraft.time_s[use] - from_s
    geodetic = np.column_stack([aircraft.latitude_deg, aircraft.longitude_deg, height])[use]
    position = enu_from_geodetic(geodetic, origin_geodetic)
    velocity, std = _velocities(aircraft, use, time_s, position)
    step = 0.0 if geometric else aircraft.altitude_step_m
    return PlayedTrack(aircraft.address, time_s, position, velocity, std, 0.5 * (step + own_step_m))


def _velocities(
    aircraft: Aircraft, use: IntArray, time_s: FloatArray, position: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Velocities [n, 3] as told or from earlier positions, and their standard deviations [n]."""
    speed, course = aircraft.ground_speed_mps[use], aircraft.track_rad[use]
    told = np.column_stack([speed * np.sin(course), speed * np.cos(course)])
    moved = np.full((len(use), 2), np.nan)
    moved[1:] = np.diff(position[:, :2], axis=0) / np.diff(time_s)[:, None]
    silent = np.isnan(told[:, 0] + told[:, 1])
    level = np.where(silent.reshape(-1, 1), moved, told)
    rate = aircraft.vertical_rate_mps[use]
    climb = np.where(np.isnan(rate), _climbs(time_s, position[:, 2]), rate)
    std = np.where(silent, UNTOLD_VELOCITY_STD_MPS, VELOCITY_STD_MPS)
    return np.column_stack([level, climb]), std


def _climbs(time_s: FloatArray, height_m: FloatArray) -> FloatArray:
    """[n] mean climb since the first report of the last `CLIMB_WINDOW_S`; 0 where there is none."""
    first = np.searchsorted(time_s, time_s - CLIMB_WINDOW_S)
    elapsed = time_s - time_s[first]
    climbed = height_m - height_m[first]
    return np.divide(climbed, elapsed, out=np.zeros(len(time_s)), where=elapsed > 0.0)
