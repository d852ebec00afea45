"""A recorded way: where a body was at times, and where it was in between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.checks import LARGEST, LATEST_S
from clearway.base.frames import FloatArray, attitude_from_rotation
from clearway.base.state import State

LONGEST_POSE_GAP_S = 1.0
"""Poses are not interpolated over longer silence, nor kept for longer at either end."""
SAME_TURN = 0.9995
"""Cosine of half the angle from which two attitudes are so near that a straight line serves."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseTrack:
    """Poses of a body in the world frame: x ahead or east, y left or north, z up."""

    source: str
    time_s: FloatArray
    """[n] ascending."""
    position_m: FloatArray
    """[n, 3]"""
    quaternion: FloatArray
    """[n, 4] w, x, y, z, world from body; the body has x ahead, y left, z up."""
    notes: tuple[str, ...] = ()
    position_std_m: FloatArray | None = None
    """[n] along the least certain axis; None where it is not reported."""
    attitude_std_rad: FloatArray | None = None
    """[n] about the least certain axis."""

    def at(self, time_s: float) -> State | None:
        """The pose at a time, interpolated; None in gaps and away from both ends."""
        times = self.time_s
        after = int(np.searchsorted(times, time_s))
        before = max(0, after - 1)
        after = min(after, len(times) - 1)
        if before == after or not times[before] <= time_s <= times[after]:
            nearest = min((before, after), key=lambda n: abs(times[n] - time_s))
            if abs(times[nearest] - time_s) > LONGEST_POSE_GAP_S:
                return None
            return self._state(nearest, nearest, 0.0, time_s)
        gap = float(times[after] - times[before])
        if gap > LONGEST_POSE_GAP_S:
            told = times[after] == time_s  # after a gap, but at its very time
            return self._state(after, after, 0.0, time_s) if told else None
        return self._state(before, after, float(time_s - times[before]) / gap, time_s)

    def _state(self, before: int, after: int, share: float, time_s: float) -> State:
        position = (1.0 - share) * self.position_m[before] + share * self.position_m[after]
        turned = slerp(self.quaternion[before], self.quaternion[after], share)
        attitude = attitude_from_rotation(convert_quaternion(turned))
        position_std, attitude_std = (
            0.0 if std is None else float(max(std[before], std[after]))
            for std in (self.position_std_m, self.attitude_std_rad)
        )
        return State(
            position,
            attitude,
            time_s=time_s,
            position_std_m=position_std,
            attitude_std_rad=attitude_std,
        )


def pose_track(
    source: str,
    time_s: FloatArray,
    position_m: FloatArray,
    quaternion: FloatArray,
    notes: tuple[str, ...] = (),
    deviations: FloatArray | None = None,
) -> PoseTrack:
    """A track by time, poses that are not finite, or not a turn, or told twice, or so far away that
    they are nowhere on Earth, or at no time of it, left out.

    deviations: [n, 2] standard deviations of position (m) and attitude (rad); None where not told.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        length = np.linalg.norm(quaternion, axis=1)
    whole = np.isfinite(np.column_stack([time_s, position_m, quaternion])).all(axis=1)
    whole &= (np.abs(position_m) <= LARGEST).all(axis=1) & (np.abs(time_s) <= LATEST_S)
    kept = np.flatnonzero(whole & (length > 0.5) & np.isfinite(length))
    _, first = np.unique(time_s[kept], return_index=True)
    kept = kept[first]
    left_out = len(time_s) - len(kept)
    if left_out:
        why = f"not finite, beyond {LARGEST:g} m or {LATEST_S:g} s, or told twice"
        notes = (*notes, f"{left_out} poses left out: {why}")
    stds = (None, None) if deviations is None else (deviations[kept, 0], deviations[kept, 1])
    turned = quaternion[kept] / length[kept, None]
    return PoseTrack(source, time_s[kept], position_m[kept], turned, notes, *stds)


def slerp(start: FloatArray, end: FloatArray, share: float) -> FloatArray:
    """The quaternion at a share of the shorter way from one to another."""
    cosine = float(start @ end)
    if cosine < 0.0:
        cosine, end = -cosine, -end
    if cosine > SAME_TURN:
        straight: FloatArray = (1.0 - share) * start + share * end
        return straight / np.linalg.norm(straight)
    angle = np.arccos(cosine)
    turned: FloatArray = (np.sin((1.0 - share) * angle) * start + np.sin(share * angle) * end) / (
        np.sin(angle)
    )
    return turned


def convert_quaternion(quaternion: FloatArray) -> FloatArray:
    """[3, 3] of a unit quaternion w, x, y, z."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def quaternions_of(rotations: FloatArray) -> FloatArray:
    """[n, 4] unit quaternions w, x, y, z of rotations [n, 3, 3]."""
    from scipy.spatial.transform import Rotation

    mixed = Rotation.from_matrix(rotations).as_quat().reshape(-1, 4)
    quaternions: FloatArray = np.ascontiguousarray(mixed[:, [3, 0, 1, 2]])
    return quaternions
