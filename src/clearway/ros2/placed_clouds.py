"""Clouds of topics into scans: those of a sensor of the mission, moved to their stamp."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from clearway.base.frames import FloatArray, attitude_from_rotation, spherical_from_cartesian
from clearway.base.state import State
from clearway.io.scans.optical import AHEAD_FROM_OPTICAL, is_optical
from clearway.live.link.past import PastStates
from clearway.live.link.placed_scans import ScanMaker
from clearway.ros2.clouds import TimedPoints
from clearway.ros2.transforms import RigidTransform, Transforms
from clearway.sensors import BeamPattern, Lidar, Mounting, Scan

SLICES = 32
"""Of a sweep, each moved at once."""
OFF_M = 0.02
OFF_RAD = math.radians(0.5)
"""A sensor mounted farther from where the mission says is not the mission's."""
WITHIN_S = 0.5

MOUNTED_ELSEWHERE = "cloud: its sensor is mounted elsewhere than the mission says"
MOUNTED_OPTICAL = (
    "cloud: attitude_deg of its sensor turns optical axes, which are turned already: it must say "
    "how the camera looks, and 0, 0, 0 is ahead"
)
ANOTHER_FIELD = (
    "cloud: its points lie where no beam of its sensor looks: `frame` of the cloud states their "
    "axes, body or optical"
)
WRONG_FRAMES = (MOUNTED_ELSEWHERE, MOUNTED_OPTICAL, ANOTHER_FIELD)
EMPTY = "cloud: empty, which says nothing"
ENOUGH = 20
FEWEST = 0.01
"""Points that tell where a sensor looks, and the share of them that its beams must explain."""
FIELD_SLACK_RAD = math.radians(5.0)


class PlacedClouds:
    """Of the mission's sensors by name; feed it with own state estimates."""

    def __init__(
        self, transforms: Transforms, base_frame: str, lidars: Mapping[str, Lidar]
    ) -> None:
        self.transforms, self._base, self._lidars = transforms, base_frame, dict(lidars)
        self._past = PastStates()
        self._fit: set[str] = set()
        """Sensors that have been seen to look where their beams do."""

    def move(self, state: State, heading_rad: float) -> None:
        """The own state estimate at a new time."""
        self._past.add(state, heading_rad)

    def flaw(self, name: str, frame: str, time_s: float, points_m: FloatArray) -> str | None:
        """Why a cloud of a frame is none of a sensor's; None if it is.

        points_m: [n, 3] x ahead, as all clouds are; a mission says of a camera how it looks.
        """
        there = self.transforms.of(frame, self._base, time_s)
        if there is None:
            return f"cloud: {self.transforms.describe_gap(frame, self._base, time_s)}"
        mounting = self._lidars[name].mounting
        ahead = there
        if is_optical(frame):
            ahead = there._replace(rotation=there.rotation @ AHEAD_FROM_OPTICAL.T)
        if not _is_at(ahead, mounting):
            return MOUNTED_OPTICAL if _is_at(there, mounting) else MOUNTED_ELSEWHERE
        if name not in self._fit and len(points_m) >= ENOUGH:
            if not _looks_at(self._lidars[name].pattern, points_m):
                return ANOTHER_FIELD
            self._fit.add(name)
        return None

    def maker(self, name: str, points: TimedPoints, time_s: float, *, deskew: bool) -> ScanMaker:
        def scan(_state: State, _heading: float) -> Scan:
            placed = points.points_m
            if deskew and points.later_s is not None and len(placed):
                placed = self._deskew(name, placed, points.later_s, time_s)
            return Scan(placed, time_s, sensor=name)

        return scan

    def _deskew(
        self, name: str, points_m: FloatArray, later_s: FloatArray, time_s: float
    ) -> FloatArray:
        """Points as they would have come all at the stamp."""
        at = self._past.at(time_s, WITHIN_S)
        if at is None:
            return points_m
        here, mounting = at[0], self._lidars[name].mounting
        sensor = RigidTransform(mounting.body_from_sensor, mounting.position_m)
        to_here = sensor.then(RigidTransform(here.world_from_body, here.position_m)).inverse
        first, last = float(later_s.min()), float(later_s.max())
        edges = np.linspace(first, last, SLICES + 1)
        which = np.clip(np.searchsorted(edges, later_s, side="right") - 1, 0, SLICES - 1)
        moved = points_m.copy()
        for number in np.unique(which).tolist():
            middle = 0.5 * (edges[number] + edges[number + 1])
            then = self._past.at(time_s + middle, WITHIN_S)
            if then is None:
                continue
            body = RigidTransform(then[0].world_from_body, then[0].position_m)
            mine = which == number
            moved[mine] = sensor.then(body).then(to_here).points(points_m[mine])
        return moved


def _is_at(there: RigidTransform, mounting: Mounting) -> bool:
    off = attitude_from_rotation(there.rotation.T @ mounting.body_from_sensor)
    apart = float(np.linalg.norm(there.position_m - mounting.position_m))
    return apart <= OFF_M and float(np.abs(off).max()) <= OFF_RAD


def _looks_at(pattern: BeamPattern, points_m: FloatArray) -> bool:
    """Whether some points lie within the angles of the beams."""
    angles = spherical_from_cartesian(points_m)[:, 1:]
    inside = np.ones(len(points_m), dtype=np.bool_)
    for own, beams in zip(angles.T, (pattern.azimuth_rad, pattern.elevation_rad), strict=True):
        inside &= own >= beams.min() - FIELD_SLACK_RAD
        inside &= own <= beams.max() + FIELD_SLACK_RAD
    return float(np.mean(inside)) >= FEWEST
