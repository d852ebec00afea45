"""Frames: world, body, NED/ENU and geodetic; Cartesian and spherical ("planar") coordinates.

Inside, frames are right-handed with z up: world is x forward or east, y left or north; body is
x forward, y left. The world is the global frame of def. 16, the body the local one of
def. 17. Roll, pitch and yaw are as in (3.37) corrected: pitch is positive nose down, yaw positive
left. A name says the target frame first: `world_from_body @ p_body = p_world`.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clearway.base.arrays import FloatArray as FloatArray
from clearway.base.arrays import Floats2
from clearway.base.compiled import compiled

LEVEL = np.array([1.0, 1.0, 0.0])
"""What the axes count in level distances."""
IN_SPACE = np.ones(3)
"""Likewise in distances in space."""


def measure_length(vector: FloatArray) -> float:
    """Length of one vector [n]: numpy's norm to the bit, in a third of its time."""
    return math.sqrt(vector.dot(vector))


def world_from_body(attitude_rad: npt.ArrayLike) -> FloatArray:
    """Rotation [..., 3, 3] from body to world, Rz(yaw) Ry(pitch) Rx(roll), eq. (3.37).

    attitude_rad: [..., 3] roll, pitch (nose down positive), yaw (left positive).
    """
    attitude = np.asarray(attitude_rad, dtype=np.float64)
    if attitude.ndim == 1:
        return compute_rotation(*attitude.tolist())
    flat = [compute_rotation(*angles) for angles in attitude.reshape(-1, 3)]
    return np.array(flat).reshape(*attitude.shape[:-1], 3, 3)


@compiled
def compute_rotation(roll: float, pitch: float, yaw: float) -> Floats2:
    """[3, 3] (3.37) of one attitude, rad: the product of yaw (3.36), pitch (3.35), roll (3.34)."""
    sin_roll, cos_roll = np.sin(roll), np.cos(roll)
    sin_pitch, cos_pitch = np.sin(pitch), np.cos(pitch)
    sin_yaw, cos_yaw = np.sin(yaw), np.cos(yaw)
    rotation = np.empty((3, 3))
    rotation[0, 0] = cos_pitch * cos_yaw
    rotation[0, 1] = cos_yaw * sin_roll * sin_pitch - cos_roll * sin_yaw
    rotation[0, 2] = sin_roll * sin_yaw + cos_roll * cos_yaw * sin_pitch
    rotation[1, 0] = cos_pitch * sin_yaw
    rotation[1, 1] = cos_roll * cos_yaw + sin_roll * sin_pitch * sin_yaw
    rotation[1, 2] = cos_roll * sin_pitch * sin_yaw - cos_yaw * sin_roll
    rotation[2, 0] = -sin_pitch
    rotation[2, 1] = cos_pitch * sin_roll
    rotation[2, 2] = cos_roll * cos_pitch
    return rotation


def body_from_world(attitude_rad: npt.ArrayLike) -> FloatArray:
    """Rotation [..., 3, 3] from world to body: the transpose of (3.37), which (3.48) misprints."""
    return np.swapaxes(world_from_body(attitude_rad), -1, -2)


def attitude_from_rotation(world_from_body: npt.ArrayLike) -> FloatArray:
    """Roll, pitch, yaw [..., 3] of a rotation [..., 3, 3]; roll is 0 at pitch +-90 deg (3.38)."""
    rotation = np.asarray(world_from_body, dtype=np.float64)
    pitch = np.arcsin(np.clip(-rotation[..., 2, 0], -1.0, 1.0))
    locked = np.hypot(rotation[..., 2, 1], rotation[..., 2, 2]) < 1e-12
    roll = np.where(locked, 0.0, np.arctan2(rotation[..., 2, 1], rotation[..., 2, 2]))
    yaw = np.where(
        locked,
        np.arctan2(-rotation[..., 0, 1], rotation[..., 1, 1]),
        np.arctan2(rotation[..., 1, 0], rotation[..., 0, 0]),
    )
    return np.stack([roll, pitch, yaw], axis=-1)


def wrap_angle(angle_rad: npt.ArrayLike) -> FloatArray:
    """The same angle in (-pi, pi]."""
    angle = np.asarray(angle_rad, dtype=np.float64)
    return np.pi - np.mod(np.pi - angle, 2.0 * np.pi)


def spherical_from_cartesian(points_m: npt.ArrayLike) -> FloatArray:
    """Distance, azimuth (left positive), elevation (up positive) [..., 3].

    (3.43), (3.44), (3.45) and (3.46).
    """
    x, y, z = np.moveaxis(np.asarray(points_m, dtype=np.float64), -1, 0)
    horizontal = np.hypot(x, y)
    return np.stack([np.hypot(horizontal, z), np.arctan2(y, x), np.arctan2(z, horizontal)], axis=-1)


def cartesian_from_spherical(spherical: npt.ArrayLike) -> FloatArray:
    """Points [..., 3] in metres of distance, azimuth, elevation [..., 3].

    (3.39), (3.40), (3.41) and (3.42).
    """
    distance, azimuth, elevation = np.moveaxis(np.asarray(spherical, dtype=np.float64), -1, 0)
    horizontal = np.cos(elevation) * distance
    return np.stack(
        [np.cos(azimuth) * horizontal, np.sin(azimuth) * horizontal, np.sin(elevation) * distance],
        axis=-1,
    )


def world_points_from_body(
    points_body_m: npt.ArrayLike, position_world_m: npt.ArrayLike, attitude_rad: npt.ArrayLike
) -> FloatArray:
    """Points [n, 3] of the body frame in the world frame: (3.47), def. 18."""
    points = np.asarray(points_body_m, dtype=np.float64)
    position = np.asarray(position_world_m, dtype=np.float64)
    rotated: FloatArray = points @ body_from_world(attitude_rad)
    return rotated + position


def body_points_from_world(
    points_world_m: npt.ArrayLike, position_world_m: npt.ArrayLike, attitude_rad: npt.ArrayLike
) -> FloatArray:
    """Points [n, 3] of the world frame in the body frame: (3.48) corrected, def. 19."""
    position = np.asarray(position_world_m, dtype=np.float64)
    offset: FloatArray = np.asarray(points_world_m, dtype=np.float64) - position
    rotated: FloatArray = offset @ world_from_body(attitude_rad)
    return rotated


def enu_from_ned(vectors_ned: npt.ArrayLike) -> FloatArray:
    """East-north-up [..., 3] of north-east-down; the same swap serves both ways."""
    north, east, down = np.moveaxis(np.asarray(vectors_ned, dtype=np.float64), -1, 0)
    return np.stack([east, north, -down], axis=-1)


def ned_from_enu(vectors_enu: npt.ArrayLike) -> FloatArray:
    """North-east-down [..., 3] of east-north-up."""
    return enu_from_ned(vectors_enu)


def attitude_enu_from_ned_frd(attitude_ned_frd_rad: npt.ArrayLike) -> FloatArray:
    """Roll, pitch, yaw here (ENU world, forward-left-up body) of aerospace roll, pitch, heading.

    The aerospace attitude [..., 3] is of a forward-right-down body in north-east-down: pitch is
    positive nose up and heading clockwise from north.
    """
    roll, pitch, heading = np.moveaxis(np.asarray(attitude_ned_frd_rad, dtype=np.float64), -1, 0)
    return np.stack([roll, -pitch, wrap_angle(np.pi / 2.0 - heading)], axis=-1)


def attitude_ned_frd_from_enu(attitude_rad: npt.ArrayLike) -> FloatArray:
    """Aerospace roll, pitch (nose up), heading (clockwise from north) of an attitude used here."""
    return attitude_enu_from_ned_frd(attitude_rad)


def enu_from_geodetic(geodetic: npt.ArrayLike, origin_geodetic: npt.ArrayLike) -> FloatArray:
    """East-north-up [..., 3] in metres of latitude and longitude in degrees and height in metres.

    geodetic: [..., 3] latitude_deg, longitude_deg, ellipsoidal height_m (WGS 84); the origin [3]
    likewise. Good to the accuracy of `pymap3d`, which does the work.
    """
    import pymap3d

    latitude, longitude, height = np.moveaxis(np.array(geodetic, dtype=np.float64), -1, 0)
    origin = np.array(origin_geodetic, dtype=np.float64)
    # Copies: pymap3d may write into the arrays that it is given.
    return np.stack(
        pymap3d.geodetic2enu(latitude.copy(), longitude.copy(), height.copy(), *origin), axis=-1
    )


def geodetic_from_enu(points_enu_m: npt.ArrayLike, origin_geodetic: npt.ArrayLike) -> FloatArray:
    """Latitude_deg, longitude_deg, height_m [..., 3] of east-north-up points in metres."""
    import pymap3d

    east, north, up = np.moveaxis(np.array(points_enu_m, dtype=np.float64), -1, 0)
    origin = np.array(origin_geodetic, dtype=np.float64)
    return np.stack(pymap3d.enu2geodetic(east.copy(), north.copy(), up.copy(), *origin), axis=-1)
