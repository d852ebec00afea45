"""What a log shows of its danger: who saw it when, who was silent, what the map and the air did."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.arrays import FloatArray, IntArray
from clearway.io.flights.recorded import RecordedFlight
from clearway.studies.why.ending import Ending
from clearway.studies.why.sights import FirstSight, find_sights
from clearway.studies.why.speeds import velocity_at
from clearway.studies.why.vehicle import Judge
from clearway.studies.why.views import DECISIVE_S, PlacedReading

SILENT_PERIODS = 5.0
"""Usual times between readings after which a sensor counts as dead."""
ROUNDING_S = 1e-3
SHIFTS = 8
"""Steps of a quarter of a margin in which a map is shifted to each side, and again finer."""
FITS_SHARE = 0.25
MISFITS_SHARE = 0.5
"""Of the margin: returns of a map that fits lie nearer in the median, of one that does not
farther."""
FEWEST_RETURNS = 10
MOST_FITTED = 400
CARRIED_SHARE = 0.5
"""Of the margin that a wind carries a vehicle at least, to be a cause."""
TRIED = 25
"""Times from which the way in still air is tried."""
STEP_S = 0.1


@dataclass(frozen=True, slots=True)
class Silence:
    """A sensor that had stopped."""

    sensor: str
    last_s: float
    period_s: float


@dataclass(frozen=True, slots=True, eq=False)
class MapShift:
    """Where the map had to be for the returns to lie on it."""

    shift_m: FloatArray
    """[2] east and north, or x and y: from the map to the returns."""
    misfit_m: float
    """Median distance of the returns from the map as it is, or that of the danger if it is more."""
    fit_m: float
    """And from the shifted one."""


@dataclass(frozen=True, slots=True, eq=False)
class Drift:
    """A wind that the mission does not state."""

    wind_mps: FloatArray
    """[3] beyond the one that it states."""
    carried_m: float
    """From then on to the end."""
    still_air_m: float
    """Distance that the same steering would have kept in the stated wind."""
    since_s: float
    """From when on without it: the time after the first sight that keeps most."""


@dataclass(frozen=True, slots=True, eq=False)
class CrashEvidence:
    """All that causes are distinguished by."""

    readings: int
    """In the decisive seconds."""
    sights: tuple[FirstSight, ...]
    """The first one of each sensor that has one, the earliest first."""
    silent: tuple[Silence, ...]
    map_shift: MapShift | None
    map_lacks_m: float | None
    """Distance from the danger to the nearest shape of a map that is declared complete there, where
    that map does not have the danger; else None."""
    drift: Drift | None


def gather_evidence(
    flight: RecordedFlight, judge: Judge, ending: Ending, seen: tuple[PlacedReading, ...]
) -> CrashEvidence:
    """Everything about the danger of an ending but what clearway makes of it."""
    before = [one for one in seen if one.reading.time_s < ending.time_s - ROUNDING_S]
    sights = find_sights(judge, ending, before)
    return CrashEvidence(
        len(before),
        sights,
        _silent(flight, ending),
        _map_shift(judge, ending, before),
        _map_lacks_m(judge, ending),
        _drift(flight, judge, ending, sights, before),
    )


def _silent(flight: RecordedFlight, ending: Ending) -> tuple[Silence, ...]:
    """Sensors that reported nothing for several of their periods, when it happened."""
    found = []
    for sensor in flight.sensors:
        times = np.array([reading.time_s for reading in sensor.readings()])
        if len(times) < 2:
            continue
        period = float(np.median(np.diff(times)))
        past = times[times <= ending.time_s]
        last = float(past[-1]) if len(past) else -np.inf
        if ending.time_s - last > SILENT_PERIODS * period:
            found.append(Silence(sensor.name, last, period))
    return tuple(found)


def _map_shift(judge: Judge, ending: Ending, readings: list[PlacedReading]) -> MapShift | None:
    """The shift that the map needs; None where it fits, has the danger, or fits nowhere."""
    charted, margin = judge.setup.obstacle_map, judge.margin_m
    if not len(charted.obstacles) or ending.intruder is not None:
        return None
    if float(charted.distance_m(ending.danger_m[None])[0]) < FITS_SHARE * margin:
        return None
    points, whose = _thin(readings)
    if not len(whose) or whose[-1] + 1 < FEWEST_RETURNS:
        return None

    def misfit(shift: FloatArray) -> float:
        moved = points - np.append(shift, 0.0)
        off = np.abs(charted.distance_m(moved))
        danger = ending.danger_m[None] - np.append(shift, 0.0)
        missed = abs(float(charted.distance_m(danger)[0]))
        return max(float(np.median(np.minimum.reduceat(off, _starts(whose)))), missed)

    as_is, best = misfit(np.zeros(2)), np.zeros(2)
    for step in (margin, 0.25 * margin):
        grid = step * np.arange(-SHIFTS, SHIFTS + 1)
        tried = [best + np.array([x, y]) for x in grid for y in grid]
        good = 0.5 * FITS_SHARE * margin
        best = min(tried, key=lambda one: (max(misfit(one), good), float(one @ one)))
    fit = misfit(best)
    shifted = float(np.linalg.norm(best)) > MISFITS_SHARE * margin
    if not shifted or as_is < MISFITS_SHARE * margin or fit > FITS_SHARE * margin:
        return None
    return MapShift(best, as_is, fit)


def _map_lacks_m(judge: Judge, ending: Ending) -> float | None:
    charted = judge.setup.obstacle_map
    if charted.complete_m is None or ending.intruder is not None:
        return None
    low, high = charted.complete_m
    if not ((low <= ending.danger_m) & (ending.danger_m <= high)).all():
        return None
    away = float(charted.distance_m(ending.danger_m[None])[0])
    return away if away > MISFITS_SHARE * judge.margin_m else None


def _starts(whose: IntArray) -> IntArray:
    return np.flatnonzero(np.concatenate([[True], np.diff(whose) != 0]))


def _thin(readings: list[PlacedReading]) -> tuple[FloatArray, IntArray]:
    """Points of at most so many returns, evenly over the readings, and whose each is."""
    total = sum(len(one.reading.points_m) for one in readings)
    step, points, whose, count = max(1, total // MOST_FITTED), [np.zeros((0, 3))], [], 0
    offset = 0
    for one in readings:
        returns = int(one.whose[-1]) + 1 if len(one.whose) else 0
        kept = np.arange((-offset) % step, returns, step)
        offset += returns
        chosen = np.isin(one.whose, kept)
        points.append(one.points_m[chosen])
        whose.append(count + np.searchsorted(kept, one.whose[chosen]))
        count += len(kept)
    return np.concatenate(points), np.concatenate([np.zeros(0, dtype=np.int64), *whose])


def _drift(
    flight: RecordedFlight,
    judge: Judge,
    ending: Ending,
    sights: tuple[FirstSight, ...],
    readings: list[PlacedReading],
) -> Drift | None:
    """The wind beyond the stated one, of a vehicle that the air carries; None of others."""
    automaton = judge.setup.planner.automaton
    if automaton.can_stop or not sights or ending.intruder is not None:
        return None
    begin_s, end_s = sights[0].time_s, ending.time_s
    wind = _wind(flight, judge.setup.planner.speed_mps, end_s)
    if wind is None:
        return None
    beyond = wind - np.asarray(judge.file.safety.wind_mps)
    strength = float(np.linalg.norm(beyond))
    latest_s = end_s - CARRIED_SHARE * judge.margin_m / max(strength, 1e-9)
    if latest_s <= begin_s:
        return None
    narrow = (_narrow_returns(one, judge.margin_m) for one in readings)
    returns = np.concatenate([ending.danger_m[None], *narrow])
    kept = {
        float(since_s): _least_distance(_in_still_air(flight, since_s, end_s, beyond), returns)
        for since_s in np.linspace(begin_s, latest_s, TRIED)
    }
    since_s = max(kept, key=lambda one: kept[one])
    return Drift(beyond, strength * (end_s - since_s), kept[since_s], since_s)


def _narrow_returns(one: PlacedReading, margin_m: float) -> FloatArray:
    """Points of returns that tell within a margin where something stands, which wide sectors do
    not."""
    width = one.reading.half_width_rad
    if not width:
        return one.points_m
    near = np.linalg.norm(one.points_m - one.state.position_m, axis=1) * width <= margin_m
    return np.asarray(one.points_m[near])


def _wind(flight: RecordedFlight, airspeed_mps: float, end_s: float) -> FloatArray | None:
    """The log's estimate over the decisive seconds, else what its velocities differ by from its
    attitudes."""
    logged = flight.wind[(flight.wind[:, 0] <= end_s) & (flight.wind[:, 0] >= end_s - DECISIVE_S)]
    if len(logged):
        return np.asarray(np.median(logged[:, 1:], axis=0))
    found = []
    for time_s in np.arange(max(end_s - DECISIVE_S, flight.track.time_s[0] + 1.0), end_s, STEP_S):
        state, velocity = flight.track.at(float(time_s)), velocity_at(flight.track, float(time_s))
        half_ago = flight.track.at(float(time_s) - 0.1)
        if state is not None and velocity is not None and half_ago is not None:
            found.append(velocity - airspeed_mps * half_ago.world_from_body[:, 0])
    return np.asarray(np.median(found, axis=0)) if found else None


def _in_still_air(
    flight: RecordedFlight, begin_s: float, end_s: float, wind: FloatArray
) -> FloatArray:
    """[n, 3] the way from the first sight on without a wind, and on straight where it ends."""
    times = np.arange(begin_s, end_s, STEP_S)
    states = [flight.track.at(float(time_s)) for time_s in times]
    way = [
        state.position_m - wind * (time_s - begin_s)
        for state, time_s in zip(states, times, strict=True)
        if state is not None
    ]
    if len(way) < 2:
        return np.array(way).reshape(-1, 3)
    further = np.arange(1, 1 + round(2.0 / STEP_S))[:, None] * (way[-1] - way[-2])
    return np.concatenate([np.array(way), way[-1] + further])


def _least_distance(way_m: FloatArray, returns_m: FloatArray) -> float:
    from scipy.spatial import cKDTree

    if not len(way_m):
        return np.inf
    return float(cKDTree(returns_m).query(way_m)[0].min())
