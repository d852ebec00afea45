"""Odometry and poses into own motion: map frame, z up, attitude as told."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np

from clearway.base.frames import FloatArray, attitude_from_rotation
from clearway.live.link.own_motion import OwnMotion
from clearway.ros2.transforms import RigidTransform, Transforms, transform_of

UNMEASURED = 1e6
"""Variances from here on mean that nobody measures it (m^2, rad^2)."""
FASTEST_MPS = 1e4
NO_POSE = "own position: no pose"


class OwnPlaceHeard:
    """Makes motions of messages."""

    def __init__(
        self, transforms: Transforms, map_frame: str, base_frame: str, counts: Counter[str]
    ) -> None:
        self._transforms, self._counts = transforms, counts
        self._map, self._base = map_frame.lstrip("/"), base_frame.lstrip("/")
        self._last: OwnMotion | None = None

    def take(self, message: Any, time_s: float) -> OwnMotion | None:
        """An Odometry, PoseStamped or PoseWithCovarianceStamped; None, and counted, where nothing
        can be made of it."""
        covered = message.pose if hasattr(message.pose, "covariance") else None
        pose = message.pose if covered is None else covered.pose
        told = transform_of(pose.position, pose.orientation)
        if told is None:
            self._counts[NO_POSE] += 1
            return None
        frame = message.header.frame_id.lstrip("/")
        there = self._transforms.locate(frame, self._map, time_s, "own position")
        if there is None:
            return None
        child = getattr(message, "child_frame_id", "").lstrip("/") or self._base
        body = self._transforms.locate(self._base, child, time_s, "own position")
        if body is None:
            return None
        place = body.then(told).then(there)
        attitude = attitude_from_rotation(place.rotation)
        velocity = self._velocity(message, told, there, place.position_m, time_s)
        position_std, attitude_std = read_deviations(
            None if covered is None else covered.covariance
        )
        motion = OwnMotion(
            time_s, place.position_m, velocity, float(attitude[2]), position_std, attitude_std,
            attitude,
        )  # fmt: skip
        self._last = motion
        return motion

    def _velocity(
        self,
        message: Any,
        told: RigidTransform,
        there: RigidTransform,
        place_m: FloatArray,
        time_s: float,
    ) -> FloatArray:
        """[3] in the map frame: as told, in the body; else from the pose before."""
        twist = getattr(message, "twist", None)
        if twist is not None:
            linear = twist.twist.linear
            own = np.array([linear.x, linear.y, linear.z], dtype=np.float64)
            if np.all(np.abs(own) <= FASTEST_MPS):
                turned: FloatArray = there.rotation @ told.rotation @ own
                return turned
        before = self._last
        if before is None or not 1e-3 < time_s - before.time_s < 2.0:
            return np.zeros(3)
        way: FloatArray = (place_m - before.position_m) / (time_s - before.time_s)
        return way if float(np.linalg.norm(way)) <= FASTEST_MPS else np.zeros(3)


def read_deviations(covariance: Any) -> tuple[float, float]:
    """Standard deviations of place (m) and attitude (rad) by REP 103's six by six.

    Zero where they are unknown: all zero, or what is no variance (ROS writes -1).
    """
    if covariance is None or len(covariance) != 36:
        return 0.0, 0.0
    variances = np.array([float(covariance[7 * axis]) for axis in range(6)])
    known = (variances >= 0.0) & (variances < UNMEASURED)  # NaN is neither.
    stds = np.sqrt(np.where(known, variances, 0.0))
    return float(stds[:3].max()), float(min(stds[3:].max(), math.pi))
