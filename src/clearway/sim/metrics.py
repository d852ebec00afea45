"""What a flight was like: distances, violations, length, tracking, effort."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from clearway.base.brief import brief
from clearway.base.frames import FloatArray
from clearway.base.state import BoolArray, IntArray
from clearway.obstacles.world import World
from clearway.sim.swept import measure_swept_distance_m


@dataclass(frozen=True, slots=True, eq=False)
class IntruderDistances:
    """Collision distance (6.17)-(6.19): between centres, at equal times."""

    names: tuple[str, ...]
    distance_m: FloatArray
    """[intruders, n] least since the time before, both flying straight between two times of the
    track; inf before an intruder appears."""
    margin_m: FloatArray
    """[intruders] safety margin plus body radius (6.16)."""

    __repr__ = brief

    @property
    def closest(self) -> IntArray:
        """[n] index of the closest intruder at each time (6.18)."""
        return np.asarray(np.argmin(self.distance_m, axis=0), dtype=np.int64)

    @property
    def nearest_m(self) -> FloatArray:
        """[n] distance to the closest intruder at each time."""
        return np.asarray(self.distance_m.min(axis=0))

    @property
    def min_distance_m(self) -> float:
        return float(self.distance_m.min())

    @property
    def closest_name(self) -> str:
        """The intruder that came nearest of all."""
        return self.names[int(np.argmin(self.distance_m.min(axis=1)))]

    @property
    def violations(self) -> int:
        """Episodes in which some intruder is nearer than its margin, each intruder by itself."""
        inside = self.distance_m < self.margin_m[:, None] - 1e-9
        return sum(episodes(row) for row in inside)


@dataclass(frozen=True, slots=True, eq=False)
class FlightMetrics:
    """Measures of one flown track (6.4.2)."""

    time_s: float
    path_length_m: float
    obstacle_distance_m: FloatArray
    """[n] least distance from the vehicle's centre to a true surface since the time before."""
    margin_violations: int
    """Episodes below the safety margin, of obstacles and of intruders."""
    tracking_m: FloatArray
    """[n] distance to the straight lines between the waypoints (6.13)."""
    climb_m: float
    """Metres climbed."""
    effort_m2ps3: float
    """Time integral of the squared acceleration across the path: what turning costs."""
    intruders: IntruderDistances | None = None
    """Distances to traffic; None in flights without any."""
    straight: IntruderDistances | None = None
    """What straight flight from waypoint to waypoint would have had to the same traffic."""

    __repr__ = brief

    @property
    def min_obstacle_distance_m(self) -> float:
        """Smallest distance to an obstacle; inf in an empty world."""
        return float(np.min(self.obstacle_distance_m, initial=np.inf))


def measure_flight(
    time_s: FloatArray,
    states: FloatArray,
    world: World,
    nominal_m: FloatArray,
    safety_margin_m: float,
    intruders: IntruderDistances | None = None,
    straight: IntruderDistances | None = None,
) -> FlightMetrics:
    """Metrics of a track: times [n], states [n, 6], and the nominal polyline [m, 3]."""
    position = np.ascontiguousarray(states[:, :3])
    steps = np.diff(position, axis=0)
    distance = measure_swept_distance_m(world, position, safety_margin_m)
    return FlightMetrics(
        time_s=float(time_s[-1] - time_s[0]),
        path_length_m=float(np.linalg.norm(steps, axis=1).sum()),
        obstacle_distance_m=distance,
        margin_violations=episodes(distance < safety_margin_m - 1e-9)
        + (intruders.violations if intruders else 0),
        tracking_m=distance_to_polyline(position, nominal_m),
        climb_m=float(np.maximum(steps[:, 2], 0.0).sum()),
        effort_m2ps3=_effort(time_s, position),
        intruders=intruders,
        straight=straight,
    )


def intruder_distances(
    time_s: FloatArray,
    positions_m: FloatArray,
    tracks: Mapping[str, Sequence[tuple[float, FloatArray]]],
    margins_m: Mapping[str, float],
) -> IntruderDistances | None:
    """Distances of a track, times [n] and positions [n, 3], to intruders, swept between times."""
    if not tracks:
        return None
    distance = np.full((len(tracks), len(time_s)), np.inf)
    for row, track in enumerate(tracks.values()):
        at = np.searchsorted(time_s, [time - 1e-9 for time, _ in track])
        places = np.array([place for _, place in track])
        apart = places - positions_m[at]
        distance[row, at] = np.linalg.norm(apart, axis=1)
        distance[row, at[1:]] = np.minimum(distance[row, at[1:]], _least_between(apart))
    margins = np.array([margins_m[name] for name in tracks])
    return IntruderDistances(tuple(tracks), distance, margins)


def _least_between(apart_m: FloatArray) -> FloatArray:
    """[n - 1] least length of offsets [n, 3] that change evenly from one to the next."""
    first, change = apart_m[:-1], np.diff(apart_m, axis=0)
    squared = np.einsum("ij,ij->i", change, change)
    towards = -np.einsum("ij,ij->i", first, change)
    share = np.clip(
        np.divide(towards, squared, out=np.zeros(len(squared)), where=squared > 0), 0, 1
    )
    return np.asarray(np.linalg.norm(first + share[:, None] * change, axis=1))


def straight_distances(
    time_s: FloatArray,
    corners_m: FloatArray,
    speed_mps: float,
    tracks: Mapping[str, Sequence[tuple[float, FloatArray]]],
    margins_m: Mapping[str, float],
) -> IntruderDistances | None:
    """As `intruder_distances` of a flight along the polyline [m, 3]; inf after its end."""
    passed = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(corners_m, axis=0), axis=1)))
    flown = speed_mps * (time_s - time_s[0])
    places = np.stack([np.interp(flown, passed, corners_m[:, axis]) for axis in range(3)], axis=1)
    found = intruder_distances(time_s, places, tracks, margins_m)
    if found is None:
        return None
    under_way = flown <= passed[-1] + 1e-9
    return replace(found, distance_m=np.where(under_way, found.distance_m, np.inf))


def episodes(flags: BoolArray) -> int:
    """Number of runs of true values."""
    padded = np.concatenate([[False], flags])
    return int(np.count_nonzero(padded[1:] & ~padded[:-1]))


def distance_to_polyline(points_m: FloatArray, corners_m: FloatArray) -> FloatArray:
    """[n] distance of points [n, 3] to the nearest segment of a polyline [m, 3]."""
    nearest = np.full(len(points_m), np.inf)
    for start, end in pairwise(corners_m):
        along = end - start
        share = (points_m - start) @ along / max(float(along @ along), 1e-12)
        foot = start + np.clip(share, 0.0, 1.0)[:, None] * along
        nearest = np.minimum(nearest, np.linalg.norm(points_m - foot, axis=1))
    return nearest


def _effort(time_s: FloatArray, position_m: FloatArray) -> float:
    span = np.diff(time_s)
    if len(span) < 2:
        return 0.0
    velocity = np.diff(position_m, axis=0) / span[:, None]
    middle = 0.5 * (span[1:] + span[:-1])
    acceleration = np.diff(velocity, axis=0) / middle[:, None]
    return float(np.sum(np.sum(acceleration**2, axis=1) * middle))
