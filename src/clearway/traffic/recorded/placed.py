"""Where aircraft of a recording were at whole seconds, in a frame that has no pole.

Places are points of the WGS 84 ellipsoid in metres from the centre of the Earth. So two aircraft
that meet over a pole, or on both sides of the date line, are as near as they are.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from clearway.base.brief import brief
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.base.units import KNOT_MPS
from clearway.traffic.recorded.aircraft import AWAY_S, FASTEST_RECORDED_MPS, Aircraft
from clearway.traffic.recorded.geodesy import surface_points
from clearway.traffic.recorded.motion import believe_climbs, estimate_climbs, interpolate_heights

COAST_S = 30.0
"""An aircraft is placed for so long after a report: as long as `fly` believes in one."""
STANDS_MPS = 0.5 * KNOT_MPS
"""A slower reported speed says nothing: receivers write 0 for "unknown" too. Positions decide."""
TAXIES_MPS = 40.0 * KNOT_MPS
"""What is faster is in the air, or about to be, even where it is reported on the ground."""
VELOCITY_WINDOW_S = 5.0
"""Velocities that come from positions are means over at least so long, where the reports allow."""
MOST_OFF = 0.5
STRAY_MPS = 10.0
"""Reported velocities that miss the way flown by more than this share of it are not believed; a
single one may miss it by so much more, for positions are rounded too."""


@dataclass(frozen=True, slots=True, eq=False)
class PlacedTrack:
    """One aircraft at whole seconds; arrays [n], by time."""

    address: str
    second: IntArray
    surface_m: FloatArray
    """[n, 3] from the centre of the Earth, on the ellipsoid under the aircraft."""
    level_mps: FloatArray
    """[n, 3] velocity over ground in the same frame; NaN where nothing tells it."""
    barometric_m: FloatArray
    """NaN where unknown for `COAST_S` or more; likewise the geometric one."""
    geometric_m: FloatArray
    climb_mps: FloatArray
    is_silent: BoolArray
    """Whether the last report is older than `COAST_S`, so that the place is a guess."""
    is_grounded: BoolArray
    """Whether it is reported on the ground, and is no faster than what taxies."""
    is_believed: bool
    """Whether reported velocities agree with the positions; if not, positions tell the velocity."""

    __repr__ = brief

    def until(self, second: int) -> PlacedTrack:
        """Up to a second, that one included."""
        kept = self.second <= second
        arrays = {
            one.name: getattr(self, one.name)[kept]
            for one in fields(self)
            if isinstance(getattr(self, one.name), np.ndarray)
        }
        return replace(self, **arrays)


def place_aircraft(one: Aircraft, at_seconds: IntArray | None = None) -> PlacedTrack:
    """An aircraft at all whole seconds from its first report on, or at those of some.

    Between two reports it flies straight, after the last one straight on, both for up to a quarter
    of an hour; what is older than `COAST_S` is marked silent.
    """
    surface = surface_points(one.latitude_deg, one.longitude_deg)
    told, believed = _read_reported_mps(one, surface)
    report, second = _seconds(one.time_s)
    if at_seconds is not None:
        wanted = np.isin(second, at_seconds)
        report, second = report[wanted], second[wanted]
    into = second - one.time_s[report]
    joined = _find_joined(one, surface)
    moved = _compute_moved_mps(one.time_s, surface, joined)
    after = np.minimum(report + 1, len(one.time_s) - 1)
    between = joined[report]
    share = np.where(between, into / np.maximum(one.time_s[after] - one.time_s[report], 1e-9), 0.0)
    here, there = (1.0 - share)[:, None], share[:, None]
    velocity = here * told[report] + there * np.where(between[:, None], told[after], 0.0)
    # The velocity of the way between two reports is known from both, after the last from before.
    flown = np.where(between[:, None], moved[after], moved[report])
    velocity = np.where(np.isnan(velocity).any(axis=1)[:, None], flown, velocity)
    onward = surface[report] + np.nan_to_num(velocity) * into[:, None]
    place = here * surface[report] + there * surface[after]
    place = np.where(between[:, None], place, onward)
    rates = believe_climbs(one)
    grounded = one.on_ground[report] & ~(np.linalg.norm(velocity, axis=1) > TAXIES_MPS)
    return PlacedTrack(
        one.address,
        second.astype(np.int64),
        place,
        velocity,
        interpolate_heights(one.time_s, one.barometric_m, rates, second, COAST_S),
        interpolate_heights(one.time_s, one.geometric_m, rates, second, COAST_S),
        estimate_climbs(one, rates, second, COAST_S),
        into > COAST_S,
        grounded,
        believed,
    )


def _seconds(time_s: FloatArray) -> tuple[IntArray, FloatArray]:
    """Last reports [n] before whole seconds, and these; absences have none."""
    until = np.append(time_s[1:], np.inf)
    silence = until - time_s
    # A longer silence is an absence: after it, the aircraft comes back as a new one.
    until = np.where(silence > AWAY_S, time_s + AWAY_S, until)
    first = np.ceil(time_s)
    counts = np.maximum(np.ceil(until) - first, 0.0).astype(np.int64)
    report = np.repeat(np.arange(len(time_s)), counts)
    steps = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return report, first[report] + steps


def _find_joined(one: Aircraft, surface: FloatArray) -> BoolArray:
    """[n] whether the way to the next report is flown: neither an absence nor a jump."""
    elapsed = np.diff(one.time_s)
    way = np.linalg.norm(np.diff(surface, axis=0), axis=1)
    flown: BoolArray = (
        (elapsed > 0.0) & (elapsed <= AWAY_S) & (way <= FASTEST_RECORDED_MPS * elapsed)
    )
    return np.append(flown, False)


def _compute_moved_mps(time_s: FloatArray, surface: FloatArray, joined: BoolArray) -> FloatArray:
    """[n, 3] mean velocity before each report, by positions; NaN where there is no way to it."""
    number = np.arange(len(time_s))
    begins = np.maximum.accumulate(np.where(np.append(True, ~joined[:-1]), number, 0))
    wanted = np.searchsorted(time_s, time_s - VELOCITY_WINDOW_S)
    first = np.maximum(begins, np.minimum(wanted, number - 1))
    elapsed = time_s - time_s[first]
    moved = (surface - surface[first]) / np.where(elapsed > 0.0, elapsed, np.nan)[:, None]
    return np.asarray(moved)


def _read_reported_mps(one: Aircraft, surface: FloatArray) -> tuple[FloatArray, bool]:
    """[n, 3] velocities over ground as reported, NaN where they say nothing; whether believed."""
    latitude, longitude = np.radians(one.latitude_deg), np.radians(one.longitude_deg)
    zero = np.zeros(len(latitude))
    east = np.stack([-np.sin(longitude), np.cos(longitude), zero], axis=-1)
    north = np.stack(
        [
            -np.sin(latitude) * np.cos(longitude),
            -np.sin(latitude) * np.sin(longitude),
            np.cos(latitude),
        ],
        axis=-1,
    )
    speed = np.where(one.ground_speed_mps > STANDS_MPS, one.ground_speed_mps, np.nan)
    told = (speed * np.sin(one.track_rad))[:, None] * east
    told = told + (speed * np.cos(one.track_rad))[:, None] * north
    elapsed = np.diff(one.time_s)
    way = np.diff(surface, axis=0)
    stated = 0.5 * (told[1:] + told[:-1]) * elapsed[:, None]
    long, other = np.linalg.norm(way, axis=1), np.linalg.norm(stated, axis=1)
    usable = ~np.isnan(other) & (elapsed <= COAST_S) & (long <= FASTEST_RECORDED_MPS * elapsed)
    off = np.linalg.norm(way - stated, axis=1)[usable] / np.maximum(long, other)[usable]
    if len(off) and float(np.median(off)) > MOST_OFF:
        return np.full_like(told, np.nan), False
    wrong = _stray(one.time_s, surface, told)
    return np.where(wrong[:, None], np.nan, told), True


def _stray(time_s: FloatArray, surface: FloatArray, told: FloatArray) -> BoolArray:
    """[n] reported velocities that positions around them contradict grossly, one by one."""
    first = np.searchsorted(time_s, time_s - VELOCITY_WINDOW_S)
    last = np.searchsorted(time_s, time_s + VELOCITY_WINDOW_S, side="right") - 1
    first = np.minimum(first, np.maximum(np.arange(len(time_s)) - 1, 0))
    last = np.maximum(last, np.minimum(np.arange(len(time_s)) + 1, len(time_s) - 1))
    elapsed = time_s[last] - time_s[first]
    moved = (surface[last] - surface[first]) / np.where(elapsed > 0.0, elapsed, np.nan)[:, None]
    speed = np.linalg.norm(moved, axis=1)
    largest = np.maximum(speed, np.linalg.norm(told, axis=1))
    off = np.linalg.norm(moved - told, axis=1)
    usable = (elapsed <= 2.0 * COAST_S) & (speed <= FASTEST_RECORDED_MPS)
    stray: BoolArray = usable & (off > MOST_OFF * largest + STRAY_MPS)
    return stray
