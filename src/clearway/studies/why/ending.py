"""What happened to a recorded flight: where it came nearest to what, or stopped."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from clearway.base.frames import FloatArray
from clearway.io.flights.recorded import RecordedFlight
from clearway.io.poses.pose_track import PoseTrack
from clearway.studies.why.speeds import (
    SPAN_S,
    choose_span_s,
    span_times,
    track_speeds,
    velocity_at,
)
from clearway.studies.why.vehicle import Judge
from clearway.studies.why.views import place_readings

BEFORE_S = 1.0
"""Whose mean speed a stop is compared with."""
FLIES = 0.3
STOPPED = 0.25
"""Shares: of the highest speed above which a vehicle flies, of the speed before below which it has
stopped."""
SMOOTHED = 3
"""Speeds after a stop over which the mean is taken: noise alone may pass the share in one."""
STOPS_WITHIN_S = 0.3
"""What takes longer to stop has braked."""
COARSEST_S = 0.3
"""Between poses: of coarser ones nobody can tell a crash from braking."""
LEVEL_AXES = 2
ALL_AXES = 3
"""How many of x, y, z count: level flight alone, or all of it."""
CHECK_LASTS_S = 5.0
"""Between a crash and what the autopilot states of it, at most."""


class Event(StrEnum):
    """What a flight came to."""

    CONTACT = "contact"
    NEAR = "near miss"
    NOTHING = "nothing"


@dataclass(frozen=True, slots=True, eq=False)
class Ending:
    """The moment that a log is asked about."""

    event: Event
    time_s: float
    place_m: FloatArray
    """[3] where the vehicle was."""
    danger_m: FloatArray
    """[3] what it touched or came nearest to."""
    nearest_m: float
    """Least distance from the vehicle's centre that the log shows; inf where it shows none."""
    told_by: str
    """What in the log tells it."""
    intruder: FloatArray | None = None
    """[n, 4] track of the aircraft that it was, else None."""
    radius_m: float = 0.0
    """Of that aircraft."""

    def danger_at(self, time_s: float) -> FloatArray:
        """Where the danger was at a time [3]."""
        if self.intruder is None:
            return self.danger_m
        track = self.intruder
        return np.array([np.interp(time_s, track[:, 0], track[:, axis]) for axis in (1, 2, 3)])


def find_ending(flight: RecordedFlight, judge: Judge) -> Ending:
    """The crash, the contact or the nearest moment of a flight."""
    stopped_s = _sudden_stop(flight.track)
    if flight.end is not None:
        told_s = flight.end.time_s
        known = stopped_s is not None and 0.0 <= told_s - stopped_s <= CHECK_LASTS_S
        time_s = stopped_s if known and stopped_s is not None else told_s
        return _at(flight, judge, Event.CONTACT, time_s, flight.end.words)
    aircraft = _nearest_aircraft(flight, judge)
    if flight.surface_m is not None:
        return _by_surface(flight, judge, flight.surface_m, aircraft)
    if stopped_s is not None:
        return _at(flight, judge, Event.CONTACT, stopped_s, "a sudden stop")
    times, nearest = _nearest_returns(flight)
    return _least(flight, judge, times, nearest, "the nearest return", aircraft)


def _by_surface(
    flight: RecordedFlight, judge: Judge, surface: FloatArray, aircraft: Ending | None
) -> Ending:
    words = "the run's distance to the nearest surface"
    return _least(flight, judge, flight.track.time_s, surface, words, aircraft)


def _least(
    flight: RecordedFlight,
    judge: Judge,
    times: FloatArray,
    nearest: FloatArray,
    words: str,
    aircraft: Ending | None,
) -> Ending:
    """The first contact of distances [n] at times, else the least of them, or of an aircraft."""
    charted = _map_distances(flight, judge)
    if flight.surface_m is None and np.min(charted, initial=np.inf) < nearest.min(initial=np.inf):
        times, nearest, words = flight.track.time_s, charted, "the nearest shape of the map"
    least = float(nearest.min(initial=np.inf))
    if aircraft is not None and aircraft.nearest_m - aircraft.radius_m < least:
        return aircraft
    if not np.isfinite(least):
        last_s = float(flight.track.time_s[-1])
        return _at(flight, judge, Event.NOTHING, last_s, "no sudden stop, and nothing near")
    touched = nearest <= judge.body_m
    at = int(np.argmax(touched)) if touched.any() else int(np.argmin(nearest))
    event = Event.CONTACT if touched.any() else _event(least, judge)
    ending = _at(flight, judge, event, float(times[at]), words)
    return ending if np.isfinite(ending.nearest_m) else _with_distance(ending, least)


def _with_distance(ending: Ending, nearest_m: float) -> Ending:
    from dataclasses import replace

    return replace(ending, nearest_m=nearest_m)


def _event(distance_m: float, judge: Judge) -> Event:
    if distance_m <= judge.body_m:
        return Event.CONTACT
    return Event.NEAR if distance_m < judge.margin_m else Event.NOTHING


def _map_distances(flight: RecordedFlight, judge: Judge) -> FloatArray:
    return judge.setup.obstacle_map.distance_m(flight.track.position_m)


def _nearest_returns(flight: RecordedFlight) -> tuple[FloatArray, FloatArray]:
    """Times of all readings with returns, and how near the nearest was."""
    rows = [
        (
            one.reading.time_s,
            float(np.linalg.norm(one.points_m - one.state.position_m, axis=1).min()),
        )
        for one in place_readings(flight)
        if len(one.points_m)
    ]
    table = np.array(rows, dtype=np.float64).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def _nearest_aircraft(flight: RecordedFlight, judge: Judge) -> Ending | None:
    """The closest intruder as an ending; None where the log has none."""
    found: list[Ending] = []
    for name, track in flight.intruders.items():
        own = np.column_stack(
            [
                np.interp(track[:, 0], flight.track.time_s, flight.track.position_m[:, axis])
                for axis in range(3)
            ]
        )
        apart = np.linalg.norm(own - track[:, 1:], axis=1)
        at = int(np.argmin(apart))
        radius = flight.intruder_radius_m.get(name, 0.0)
        found.append(
            Ending(
                _event(float(apart[at]) - radius, judge),
                float(track[at, 0]),
                own[at],
                track[at, 1:],
                float(apart[at]),
                f"the nearest aircraft, {name}",
                track,
                radius,
            )
        )
    return min(found, key=lambda one: one.nearest_m - one.radius_m, default=None)


def _at(flight: RecordedFlight, judge: Judge, event: Event, time_s: float, told_by: str) -> Ending:
    """An ending at a time, with the return that the vehicle's nose was nearest to."""
    state = flight.track.at(time_s)
    place = flight.track.position_m[-1] if state is None else state.position_m
    before = velocity_at(flight.track, time_s - SPAN_S)
    heading = np.zeros(3) if before is None else before
    speed = float(np.linalg.norm(heading))
    nose = place + (judge.body_m * heading / speed if speed > 1e-6 else 0.0)
    around = judge.body_m + judge.margin_m
    near = [
        one.points_m[np.linalg.norm(one.points_m - place, axis=1) <= around]
        for one in place_readings(flight, time_s - BEFORE_S * 30.0, time_s + BEFORE_S)
        if not one.reading.half_width_rad
    ]
    returns = np.concatenate([np.zeros((0, 3)), *near])
    if not len(returns):
        return Ending(event, time_s, place, nose, np.inf, told_by)
    danger = returns[int(np.argmin(np.linalg.norm(returns - nose, axis=1)))]
    nearest = float(np.linalg.norm(returns - place, axis=1).min())
    return Ending(event, time_s, place, danger, nearest, told_by)


def _sudden_stop(track: PoseTrack) -> float | None:
    """When a vehicle that flew stood still at once, and never flew again; None where none did.

    Level flight that ends at once counts too: what hit something may fall.
    """
    times = track.time_s
    if len(times) < 3 or float(np.median(np.diff(times))) > COARSEST_S:
        return None
    flies = float(np.median(track_speeds(track)))
    flies_level = _highest(track_speeds(track, LEVEL_AXES)) > FLIES * flies
    found = [_stop_along(track, axes) for axes in (LEVEL_AXES, ALL_AXES)[not flies_level :]]
    return min((one for one in found if one is not None), default=None)


def _highest(speeds: FloatArray) -> float:
    return float(np.percentile(speeds, 99.0))


def _stop_along(track: PoseTrack, axes: int) -> float | None:
    """When the movement along the first axes ended at once, and for good."""
    span_s = choose_span_s(track, float(np.median(track_speeds(track, axes))))
    speeds = track_speeds(track, axes, span_s)
    highest = _highest(speeds)
    flying = np.flatnonzero(speeds > FLIES * highest)
    if not len(flying) or highest <= 0.0:
        return None
    last = int(flying[-1])
    before = speeds[max(0, last - round(BEFORE_S / span_s)) : last]
    after = speeds[last + 2 :]
    if not len(before) or not len(after):
        return None
    steady = float(before.mean())
    count = min(SMOOTHED, len(after))
    smooth = np.convolve(after, np.full(count, 1.0 / count), "valid")
    if steady <= FLIES * highest or float(smooth.max()) > STOPPED * steady:
        return None
    if float(speeds[last - 1]) < 0.7 * steady:
        return None  # It has braked.
    return _moment_of_stop(track, float(span_times(track, span_s)[last]), span_s, axes)


def _moment_of_stop(track: PoseTrack, about_s: float, span_s: float, axes: int) -> float:
    """The time, to a pose, at which the vehicle came to its last place along the first axes."""
    after = np.flatnonzero(track.time_s >= about_s - span_s)
    end = track.at(about_s + 2.0 * span_s + STOPS_WITHIN_S)
    rest = track.position_m[-1] if end is None else end.position_m
    away = np.linalg.norm((track.position_m[after] - rest)[:, :axes], axis=1)
    farthest, noise = float(away.max(initial=0.0)), float(np.median(away))
    arrived = np.flatnonzero(away <= max(0.05 * farthest, min(2.0 * noise, 0.2 * farthest), 1e-9))
    return float(track.time_s[after[int(arrived[0])]]) if len(arrived) else about_s
