"""Recorded scans through the avoidance system: what it would have decided at each of them.

The vehicle follows its recorded way whatever is decided; nothing closes the loop.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from clearway.base.brief import brief
from clearway.base.errors import ClearwayError
from clearway.base.frames import world_from_body
from clearway.base.state import State
from clearway.live.mission import Mission
from clearway.live.outputs.flight_decision import FlightDecision
from clearway.live.system import AvoidanceSystem
from clearway.sensors import Scan

AHEAD = 10.0
"""How far ahead of the last pose the last goal is, in ranges of the grid: nothing ends there."""


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """One scan and where the vehicle was, both of the same time."""

    state: State
    scan: Scan

    __repr__ = brief


@dataclass(frozen=True, slots=True, eq=False)
class PlayedScan:
    """What was seen and decided at one moment."""

    moment: Moment
    planned: State | None
    """Where the plan before had the vehicle; None without a plan, and past its end."""
    hits: int
    """Returns within the grid."""
    nearest_m: float
    """Distance of the nearest return that counts from the vehicle; inf without any.

    Returns of the own airframe, in the sensor's blind range or beyond its range do not count."""
    decision: FlightDecision

    __repr__ = brief


def mission_along(states: Sequence[State], range_m: float, reach_radius_m: float) -> Mission:
    """Waypoints on the way that was flown, a range apart, and on straight ahead from its end.

    Raises ClearwayError without any state.
    """
    if not states:
        raise ClearwayError("a mission along recorded poses needs at least one")
    way, last = [states[0].position_m], states[-1]
    for state in states:
        if np.linalg.norm(state.position_m - way[-1]) >= range_m:
            way.append(state.position_m)
    heading = world_from_body([0.0, 0.0, float(last.attitude_rad[2])])
    way.append(last.position_m + heading @ np.array([AHEAD * range_m, 0.0, 0.0]))
    return Mission(
        "recorded way",
        states[0],
        waypoints_m=np.array(way[1:]),
        reach_radius_m=reach_radius_m,
        pass_within_m=max(reach_radius_m, 0.5 * range_m),
    )


def play(system: AvoidanceSystem, moments: Iterable[Moment]) -> Iterator[PlayedScan]:
    """Decide at every moment; times must ascend.

    The system is fed with each state and scan as in flight, and keeps what it remembers.
    """
    system.followed = False
    for moment in moments:
        planned = system.state_at(moment.state.time_s)
        system.update(moment.state)
        system.update(moment.scan)
        time_s = moment.state.time_s
        situation, _ = system.situation(time_s)
        squared = [
            float(np.einsum("ij,ij->i", detection.points_m, detection.points_m).min())
            for detection in situation.detections
            if len(detection.points_m)
        ]
        yield PlayedScan(
            moment,
            planned,
            sum(int(detection.hits.sum()) for detection in situation.detections),
            float(np.sqrt(min(squared, default=np.inf))),
            system.decide(time_s),
        )
