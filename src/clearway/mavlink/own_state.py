"""Position and attitude messages into own motion: z-up world frame.

The world is the mission's place on Earth, or the autopilot's local frame. Autopilots scale degrees
to metres more simply than geodesy does (0.3 % apart), so where both frames are told at once the one
is tied to the other there, whatever was told of the local frame's origin.
"""

from __future__ import annotations

import math
from collections import Counter, deque

import numpy as np

from clearway.base.frames import (
    FloatArray,
    attitude_enu_from_ned_frd,
    enu_from_geodetic,
    enu_from_ned,
    geodetic_from_enu,
)
from clearway.live.link.own_motion import OwnMotion
from clearway.mavlink.dialect import Message

LARGEST_M = 1e6
"""No local frame is larger."""
LOCAL_WAIT_S = 1.0
"""Global positions are used after local ones have been silent for so long."""
TILTED_S = 1.0
"""Scans are placed where the vehicle was up to half a second ago, between attitudes before that."""
PAIR_S = 0.1
"""A local and a global position this close in time tell where the local frame's origin is."""
DEGREES_E7 = 1e-7
MILLIMETRE = 1e-3
CENTIMETRE = 1e-2

NO_ATTITUDE = "position: no attitude to go with it"
NOT_FINITE = "position: not finite"
NO_ORIGIN = "position: no origin of the local frame yet"


class OwnPlace:
    """Latest of every message that tells where we are; makes motions of them.

    mission_origin: latitude, longitude in degrees and height above sea level of the world's origin;
    None takes the autopilot's local frame as the world, x east and y north.
    """

    def __init__(
        self, mission_origin: tuple[float, float, float] | None, counts: Counter[str]
    ) -> None:
        self._counts = counts
        self._mission_origin = mission_origin
        self._local_origin: FloatArray | None = None
        self._pair: tuple[FloatArray, FloatArray] | None = None  # Geodetic, local.
        self._heading_rad: float | None = None
        self._heading_s = -math.inf
        self._tilts: deque[tuple[float, float]] = deque()  # Times and tilts of the last while.
        self._local: tuple[float, FloatArray, FloatArray] | None = None
        self._home: FloatArray | None = None
        self._relative_ground_m: float | None = None  # Below the local frame's zero, up positive.

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
        if self._pair is not None:
            # Where the vehicle is the two frames agree; farther off they need not.
            return enu_from_geodetic(self._pair[0], self._mission_origin) - self._pair[1]
        if self._local_origin is None:
            return None
        if self._local is None:
            return enu_from_geodetic(self._local_origin, self._mission_origin)
        here = geodetic_from_enu(self._local[1], self._local_origin)
        return enu_from_geodetic(here, self._mission_origin) - self._local[1]

    @property
    def ground_m(self) -> float | None:
        """Height of the home in the world frame; None until it is known."""
        offset, origin = self.world_from_local_m, self.origin_geodetic
        if self._relative_ground_m is not None and offset is not None:
            return float(offset[2]) + self._relative_ground_m
        if self._home is None or origin is None:
            return None
        return float(self._home[2] - origin[2])

    def place_of(self, geodetic: FloatArray, *, above_home: bool) -> FloatArray | None:
        """[3] a place on Earth in the world frame; its height above sea level, or the home."""
        origin, ground = self.origin_geodetic, self.ground_m
        if origin is None or (above_home and ground is None):
            return None
        place = enu_from_geodetic(geodetic, origin)
        if above_home and ground is not None:
            place[2] = ground + geodetic[2]
        return place

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
            upright = math.cos(message.roll) * math.cos(message.pitch)
            self._tilts.append((time_s, math.acos(max(-1.0, min(1.0, upright)))))
            while self._tilts[0][0] < time_s - TILTED_S:
                self._tilts.popleft()

    def take_local(self, message: Message, time_s: float, oldest_s: float) -> OwnMotion | None:
        """LOCAL_POSITION_NED: metres, and metres a second."""
        place = np.array([message.x, message.y, message.z])
        velocity = np.array([message.vx, message.vy, message.vz])
        if not (np.all(np.abs(place) <= LARGEST_M) and np.all(np.abs(velocity) <= LARGEST_M)):
            self._counts[NOT_FINITE] += 1
            return None
        local, velocity = enu_from_ned(place), enu_from_ned(velocity)
        self._local = (time_s, local, velocity)
        offset = self.world_from_local_m
        if offset is None:
            self._counts[NO_ORIGIN] += 1
            return None
        return self._motion(time_s, local + offset, velocity, oldest_s)

    def take_global(self, message: Message, time_s: float, oldest_s: float) -> OwnMotion | None:
        """GLOBAL_POSITION_INT: ties the frames beside local positions, or stands in for them."""
        geodetic = decode_geodetic(message.lat, message.lon, message.alt)
        if geodetic is None:
            self._counts["position: no such latitude or longitude"] += 1
            return None
        local = self._local
        if local is not None and time_s - local[0] <= LOCAL_WAIT_S:
            if abs(time_s - local[0]) <= PAIR_S:
                there = local[1] + (time_s - local[0]) * local[2]
                self._local_origin, self._pair = _origin_of(geodetic, there), (geodetic, there)
                self._relative_ground_m = float(there[2]) - MILLIMETRE * message.relative_alt
            return None
        origin = self.origin_geodetic
        if origin is None or self._local_origin is None:
            self._counts[NO_ORIGIN] += 1
            return None
        velocity = CENTIMETRE * np.array([message.vx, message.vy, message.vz], dtype=np.float64)
        place = enu_from_geodetic(geodetic, origin)
        return self._motion(time_s, place, enu_from_ned(velocity), oldest_s)

    def take_origin(self, message: Message) -> None:
        """GPS_GLOBAL_ORIGIN: where the local frame's zero is, unless pairs tell it better."""
        told = decode_geodetic(message.latitude, message.longitude, message.altitude)
        if told is not None and self._pair is None:
            self._local_origin = told

    def take_home(self, message: Message) -> None:
        """HOME_POSITION: where the ground is; its place in both frames, while nothing else is."""
        told = decode_geodetic(message.latitude, message.longitude, message.altitude)
        local = np.array([message.x, message.y, message.z])
        if told is None:
            return
        self._home = told
        if self._local_origin is None and np.all(np.isfinite(local)):
            self._local_origin = _origin_of(told, enu_from_ned(local))

    def _motion(
        self, time_s: float, position_m: FloatArray, velocity: FloatArray, oldest_s: float
    ) -> OwnMotion | None:
        heading = self.heading_at(time_s, oldest_s)
        if heading is None:
            self._counts[NO_ATTITUDE] += 1
            return None
        tilt = max((tilt for _, tilt in self._tilts), default=0.0)
        return OwnMotion(time_s, position_m, velocity, heading, tilt_rad=tilt)


def decode_geodetic(latitude: int, longitude: int, height_mm: int) -> FloatArray | None:
    """[3] degrees and metres of MAVLink's integers; None where they say unknown, or no place."""
    degrees = latitude * DEGREES_E7, longitude * DEGREES_E7
    if abs(degrees[0]) > 90.0 or abs(degrees[1]) > 180.0 or degrees == (0.0, 0.0):
        return None
    return np.array([*degrees, height_mm * MILLIMETRE])


def _origin_of(geodetic: FloatArray, local_enu_m: FloatArray) -> FloatArray:
    """The place from which another one lies at [3] east, north, up."""
    return geodetic_from_enu(-local_enu_m, geodetic)
