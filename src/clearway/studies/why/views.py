"""Readings of a log placed in the world: the returns of all sensors around the last seconds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from clearway.base.arrays import FloatArray, IntArray
from clearway.base.state import State
from clearway.io.flights.recorded import RangeReading, RecordedFlight, RecordedSensor
from clearway.io.poses.pose_track import PoseTrack

DECISIVE_S = 30.0
"""Before the end that is looked at: longer than any vehicle takes to pass what its sensors show."""
AFTER_S = 1.0
"""After it: what is seen then stood there before."""
MOST_RETURNS = 4000
"""Of a reading, evenly thinned: enough to find what is near, and bounded for dense clouds."""


@dataclass(frozen=True, slots=True, eq=False)
class PlacedReading:
    """A reading where the vehicle was."""

    sensor: str
    reading: RangeReading
    state: State
    points_m: FloatArray
    """[m, 3] along the arcs of its returns, world frame."""
    whose: IntArray
    """[m] number of each point's return."""


def place_readings(
    flight: RecordedFlight, begin_s: float = -np.inf, end_s: float = np.inf
) -> Iterator[PlacedReading]:
    """Readings of all sensors within times, sensor by sensor; those without a pose are left out."""
    for sensor in flight.sensors:
        for reading in sensor.readings():
            if begin_s <= reading.time_s <= end_s:
                placed = _place(sensor, reading, flight.track)
                if placed is not None:
                    yield placed


def _place(sensor: RecordedSensor, reading: RangeReading, track: PoseTrack) -> PlacedReading | None:
    state = track.at(reading.time_s)
    if state is None:
        return None
    step = max(1, len(reading.points_m) // MOST_RETURNS)
    thinned = reading._replace(points_m=reading.points_m[::step])
    arcs, whose = thinned.arcs()
    body = arcs @ sensor.mounting.body_from_sensor.T + sensor.mounting.position_m
    world = state.position_m + body @ state.world_from_body.T
    return PlacedReading(sensor.name, reading, state, world, whose)


def decisive_readings(flight: RecordedFlight, end_s: float) -> tuple[PlacedReading, ...]:
    """Readings of the decisive seconds, in the order of time."""
    found = place_readings(flight, end_s - DECISIVE_S, end_s + AFTER_S)
    return tuple(sorted(found, key=lambda one: one.reading.time_s))
