"""Position and attitude messages into own states: z-up world frame, attitude of the flight path.

Sets and trajectories are those of a vehicle that flies where its nose points, (4.4). A multirotor
tilts to go forward, and wind sets a plane off its heading, so the attitude that decisions start
from is the direction of motion over ground; below a least speed it is the heading, level.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from clearway.base.frames import (
    FloatArray,
    attitude_enu_from_ned_frd,
    enu_from_geodetic,
    enu_from_ned,
    geodetic_from_enu,
)
from clearway.base.state import State
from clearway.mavlink.dialect import Message

LARGEST_M = 1e6
"""No local frame is larger."""
LOCAL_WAIT_S = 1.0
"""Global positions are used after local ones have been silent for so long."""
PAIR_S = 0.1
"""A local and a global position this close in time tell where the local frame's origin is."""
DEGREES_E7 = 1e-7
MILLIMETRE = 1e-3
CENTIMETRE = 1e-2

NO_ATTITUDE = "position: no attitude to go with it"
NOT_FINITE = "position: not finite"
NO_ORIGIN = "position: no origin of the local frame yet"


@dataclass(frozen=True, slots=True, eq=False)
class OwnMotion:
    """Own place and motion as told, world frame."""

    time_s: float
    position_m: FloatArray
    """[3]"""
    velocity_mps: FloatArray
    """[3]"""
    heading_rad: float
    """Yaw of the nose, left positive from x."""

    def direction(self, least_mps: float) -> tuple[float, float]:
        """Pitch (nose down positive) and yaw of the flight path; of the nose when slower."""
        x, y, z = self.velocity_mps.tolist()
        level = math.hypot(x, y)
        if math.hypot(level, z) < least_mps:
            return 0.0, self.heading_rad
        yaw = math.atan2(y, x) if level >= 0.5 * least_mps else self.heading_rad
        return math.atan2(-z, level), yaw

    def state(
        self, least_mps: float, position_std_m: float, attitude_std_rad: float = 0.0
    ) -> State:
        """The own state that decisions start from."""
        pitch, yaw = self.direction(least_mps)
        attitude = np.array([0.0, pitch, yaw])
        return State(self.position_m, attitude, self.time_s, position_std_m, attitude_std_rad)


class OwnPlace:
    """Latest of every message that tells where we are; makes a Motion of them.

    mission_origin: latitude, longitude in degrees and height above sea level of the world's origin;
    None takes the autopilot's local frame as the world, x east and y north.
    """

    def __init__(
        self, mission_origin: tuple[float, float, float] | None, counts: Counter[str]
    ) -> None:
        self._counts = counts
        self._mission_origin = mission_origin
        self._local_origin: FloatArray | None = None
        self._told_outright = False
        self._heading_rad: float | None = None
        self._heading_s = -math.inf
        self._local: tuple[float, FloatArray] | None = None

    @property
    def origin_geodetic(self) -> FloatArray | None:
        """[3] latitude, longitude, height above sea level of the world's origin, once known."""
        if self._mission_origin is not None:
            return np.array(self._mission_origin)
        return self._local_origin

    @property
    def world_from_local_m(self) -> FloatArray | None:
        """[3] the autopilot's origin in the world frame; None until it is known."""
        if self._mission_origin is None:
            return np.zeros(3)
        if self._local_origin is None:
            return None
        return enu_from_geodetic(self._local_origin, self._mission_origin)

    def heading_at(self, time_s: float, oldest_s: float) -> float | None:
        """Yaw of the nose, if it was told within a time."""
        if self._heading_rad is None or time_s - self._heading_s > oldest_s:
            return None
        return self._heading_rad

    def take_attitude(self, message: Message, time_s: float) -> None:
        """ATTITUDE: roll, pitch, heading of a forward-right-down body in north-east-down."""
        angles = [message.roll, message.pitch, message.yaw]
        if not np.all(np.isfinite(angles)):
            self._counts["attitude: not finite"] += 1
            return
        if time_s >= self._heading_s:
            self._heading_rad = float(attitude_enu_from_ned_frd(angles)[2])
            self._heading_s = time_s

    def take_local(self, message: Message, time_s: float, oldest_s: float) -> OwnMotion | None:
        """LOCAL_POSITION_NED: metres, and metres a second."""
        place = np.array([message.x, message.y, message.z])
        velocity = np.array([message.vx, message.vy, message.vz])
        if not (np.all(np.abs(place) <= LARGEST_M) and np.all(np.abs(velocity) <= LARGEST_M)):
            self._counts[NOT_FINITE] += 1
            return None
        local = enu_from_ned(place)
        self._local = (time_s, local)
        offset = self.world_from_local_m
        if offset is None:
            self._counts[NO_ORIGIN] += 1
            return None
        return self._motion(time_s, local + offset, enu_from_ned(velocity), oldest_s)

    def take_global(self, message: Message, time_s: float, oldest_s: float) -> OwnMotion | None:
        """GLOBAL_POSITION_INT: tells the origin beside local positions, or stands in for them."""
        geodetic = geodetic_of(message.lat, message.lon, message.alt)
        if geodetic is None:
            self._counts["position: no such latitude or longitude"] += 1
            return None
        local = self._local
        if local is not None and time_s - local[0] <= LOCAL_WAIT_S:
            if not self._told_outright and abs(time_s - local[0]) <= PAIR_S:
                self._local_origin = _origin_of(geodetic, local[1])
            return None
        origin = self.origin_geodetic
        if origin is None or self._local_origin is None:
            self._counts[NO_ORIGIN] += 1
            return None
        velocity = CENTIMETRE * np.array([message.vx, message.vy, message.vz], dtype=np.float64)
        place = enu_from_geodetic(geodetic, origin)
        return self._motion(time_s, place, enu_from_ned(velocity), oldest_s)

    def take_origin(self, message: Message) -> None:
        """GPS_GLOBAL_ORIGIN: where the local frame's zero is."""
        told = geodetic_of(message.latitude, message.longitude, message.altitude)
        if told is not None:
            self._local_origin, self._told_outright = told, True

    def take_home(self, message: Message) -> None:
        """HOME_POSITION: the home's place in both frames; used while nothing else is known."""
        told = geodetic_of(message.latitude, message.longitude, message.altitude)
        local = np.array([message.x, message.y, message.z])
        if told is None or self._local_origin is not None or not np.all(np.isfinite(local)):
            return
        self._local_origin = _origin_of(told, enu_from_ned(local))

    def _motion(
        self, time_s: float, position_m: FloatArray, velocity: FloatArray, oldest_s: float
    ) -> OwnMotion | None:
        heading = self.heading_at(time_s, oldest_s)
        if heading is None:
            self._counts[NO_ATTITUDE] += 1
            return None
        return OwnMotion(time_s, position_m, velocity, heading)


def geodetic_of(latitude: int, longitude: int, height_mm: int) -> FloatArray | None:
    """[3] degrees and metres of MAVLink's integers; None where they say unknown, or no place."""
    degrees = latitude * DEGREES_E7, longitude * DEGREES_E7
    if abs(degrees[0]) > 90.0 or abs(degrees[1]) > 180.0 or degrees == (0.0, 0.0):
        return None
    return np.array([*degrees, height_mm * MILLIMETRE])


def _origin_of(geodetic: FloatArray, local_enu_m: FloatArray) -> FloatArray:
    """The place from which another one lies at [3] east, north, up."""
    return geodetic_from_enu(-local_enu_m, geodetic)
