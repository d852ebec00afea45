"""A recording as arrays that can be asked for any time of the flight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from clearway.base.frames import FloatArray
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.view.replay.reading import Recording

MOST_DOTS = 6_000
TOGETHER = 64
"""Decisions whose dots are looked at together."""
TRAIL_S = 6.0
"""Of intruders."""


@dataclass(frozen=True, eq=False)
class Scenes:
    """What a film shows, world frame."""

    title: str
    margin_m: float
    body_radius_m: float
    range_m: float
    waypoints_m: FloatArray
    """[n, 3]"""
    world: ObstacleMap
    """What is really there, of shapes."""
    time_s: FloatArray
    """[n] of the steps."""
    place_m: FloatArray
    """[n, 3]"""
    yaw_rad: FloatArray
    """[n] without leaps."""
    nearest_m: FloatArray
    """[n] to any surface; inf where there is none."""
    decided_s: FloatArray
    """[decisions]"""
    decisions: Sequence[dict[str, Any]]
    seen_m: FloatArray
    """[dots, 3] places that decisions reckoned with, each once."""
    seen_s: FloatArray
    """[dots] since when, ascending."""
    intruders: dict[str, FloatArray]
    """[n, 4] time and place of each, by name."""
    intruder_radius_m: dict[str, float]

    @classmethod
    def of(cls, recording: Recording) -> Scenes:
        """Errors as of what a damaged recording raises."""
        mission, states = recording.mission, recording.states
        seen_m, seen_s = _find_seen(recording)
        radii = {name: float(r or 0.0) for name, r in mission["intruder_radius_m"].items()}
        return cls(
            title=f"{mission['name']}, flown by {mission['planner']}",
            margin_m=float(mission["margin_m"]),
            body_radius_m=float(mission["body_radius_m"]),
            range_m=float(mission["grid"]["range_edges_m"][-1]),
            waypoints_m=np.array(mission["waypoints_m"], dtype=np.float64).reshape(-1, 3),
            world=ObstacleMap([_obstacle(one) for one in mission["obstacles"] if _is_there(one)]),
            time_s=np.array([state["time_s"] for state in states]),
            place_m=np.array([state["position_m"] for state in states]),
            yaw_rad=np.unwrap([state["attitude_rad"][2] for state in states]),
            nearest_m=_nearest(recording, radii),
            decided_s=np.array([one["time_s"] for one in recording.decisions]),
            decisions=recording.decisions,
            seen_m=seen_m,
            seen_s=seen_s,
            intruders=_tracks(recording),
            intruder_radius_m=radii,
        )

    def decision_at(self, time_s: float) -> dict[str, Any] | None:
        """The last decision until then."""
        at = int(np.searchsorted(self.decided_s, time_s + 1e-6)) - 1
        return None if at < 0 else self.decisions[at]

    def trail(self, name: str, time_s: float) -> FloatArray:
        """[n, 3] where an intruder came from until then; empty while it is not there."""
        track = self.intruders[name]
        recent = (track[:, 0] <= time_s + 1e-6) & (track[:, 0] > time_s - TRAIL_S)
        there = bool(len(track)) and track[0, 0] <= time_s + 1e-6 <= track[-1, 0] + 1.0
        return track[recent, 1:] if there else track[:0, 1:]


def _is_there(shape: dict[str, Any]) -> bool:
    return shape["known"] in ("world", "both")


def _obstacle(shape: dict[str, Any]) -> Obstacle:
    return Obstacle(
        shape["shape"],
        np.array(shape["position_m"]),
        orientation_rad=np.array(shape["orientation_rad"]),
        size_m=tuple(shape["size_m"]),
        radius_m=float(shape["radius_m"]),
        name=shape["name"],
    )


def _nearest(recording: Recording, radii: dict[str, float]) -> FloatArray:
    """To obstacles, and to the surfaces of intruders."""
    body = max(radii.values(), default=0.0)
    nearest = []
    for state in recording.states:
        still, flying = state["obstacle_distance_m"], state["intruder_distance_m"]
        nearest.append(
            min(
                np.inf if still is None else float(still),
                np.inf if flying is None else float(flying) - body,
            )
        )
    return np.array(nearest)


def _find_seen(recording: Recording) -> tuple[FloatArray, FloatArray]:
    """Places with the time of the first decision that knew of them."""
    every, when = np.zeros((0, 3)), np.zeros(0)
    decided_s = np.array([float(one["time_s"]) for one in recording.decisions])
    # A few at a time: those of an hour together would fill the memory.
    for begin in range(0, min(len(decided_s), len(recording.points_m)), TOGETHER):
        clouds = recording.points_m[begin : begin + TOGETHER]
        times = decided_s[begin : begin + TOGETHER]
        every = np.concatenate([every, *clouds[: len(times)]])
        counts = [len(cloud) for cloud in clouds[: len(times)]]
        when = np.concatenate([when, np.repeat(times[: len(clouds)], counts)])
        first = np.sort(np.unique(np.round(every, 2), axis=0, return_index=True)[1])
        every, when = every[first], when[first]
    thin = slice(None, None, max(1, len(when) // MOST_DOTS))
    return every[thin], when[thin]


def _tracks(recording: Recording) -> dict[str, FloatArray]:
    found: dict[str, list[list[float]]] = {}
    for message in recording.intruders:
        for one in message["intruders"]:
            found.setdefault(one["name"], []).append([message["time_s"], *one["position_m"]])
    return {name: np.array(rows) for name, rows in found.items()}
