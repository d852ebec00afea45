"""Other aircraft: px4_msgs/TransponderReport and mavros_msgs/ADSBVehicle, which tell the same, and
our own message, which tells them in any frame."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np

from clearway.base.frames import FloatArray, enu_from_geodetic
from clearway.live.link.aircraft import AircraftReport
from clearway.ros2.transforms import RigidTransform

PLACE = 1
ALTITUDE = 2
HEADING = 4
SPEED = 8
CLIMB = 128
"""Flags of what is valid, as of MAVLink's ADSB_FLAGS."""
HALF_SPAN_M = {1: 6.0, 2: 15.0, 3: 20.0, 4: 30.0, 5: 35.0, 6: 8.0, 7: 8.0, 9: 12.0, 10: 15.0,
               11: 4.0, 12: 6.0, 14: 1.0, 15: 20.0}  # fmt: skip
UNKNOWN_HALF_SPAN_M = 15.0
FASTEST_MPS = 1e4
FARTHEST_M = 1e7
WIDEST_M = 1e3


def read_ros2_aircraft(
    message: Any, origin: FloatArray | None, own_height_m: float, counts: Counter[str]
) -> AircraftReport | None:
    """The report in the map frame; None, and counted, where nothing can be made of it.

    origin: latitude, longitude, height of the map frame's origin, by the mission.
    """
    latitude = float(getattr(message, "latitude", getattr(message, "lat", math.nan)))
    longitude = float(getattr(message, "longitude", getattr(message, "lon", math.nan)))
    flags, height = int(message.flags), float(message.altitude)
    known = abs(latitude) <= 90.0 and abs(longitude) <= 180.0 and flags & PLACE
    if not known:
        counts["traffic: no position"] += 1
        return None
    if origin is None:
        counts["traffic: the mission has no origin_geodetic"] += 1
        return None
    has_height = bool(flags & ALTITUDE) and abs(height) < 1e5
    place = enu_from_geodetic([latitude, longitude, height if has_height else 0.0], origin)
    if not has_height:
        counts["traffic: no altitude, taken at our height"] += 1
        place[2] = own_height_m
    tslc = message.tslc
    age_s = float(tslc) if not hasattr(tslc, "sec") else tslc.sec + 1e-9 * tslc.nanosec
    return AircraftReport(
        int(message.icao_address) & 0xFFFFFF,
        place,
        _velocity(message, flags),
        HALF_SPAN_M.get(int(message.emitter_type), UNKNOWN_HALF_SPAN_M),
        max(0.0, age_s),
        (round(latitude * 1e7), round(longitude * 1e7), round(height * 1e3) if has_height else 0),
    )


def _velocity(message: Any, flags: int) -> FloatArray | None:
    """[3] east, north, up; None where speed or heading are not valid."""
    if not (flags & HEADING and flags & SPEED):
        return None
    heading, speed = float(message.heading), float(message.hor_velocity)
    climb = float(message.ver_velocity) if flags & CLIMB else 0.0
    velocity = np.array([speed * math.sin(heading), speed * math.cos(heading), climb])
    return velocity if np.all(np.abs(velocity) <= FASTEST_MPS) else None


def aircraft_in_frame(
    message: Any, there: RigidTransform, age_s: float, counts: Counter[str]
) -> AircraftReport | None:
    """A clearway_msgs/Aircraft in the map frame; None, and counted, where it says nothing.

    there: of its frame in the map. age_s: since its stamp.
    """
    place = np.array([message.position.x, message.position.y, message.position.z], dtype=np.float64)
    radius = float(message.radius)
    if not (np.all(np.abs(place) < FARTHEST_M) and 0.0 <= radius <= WIDEST_M):
        counts["traffic: no position"] += 1
        return None
    told = message.velocity
    velocity = there.rotation @ np.array([told.x, told.y, told.z], dtype=np.float64)
    return AircraftReport(
        int(message.address),
        there.points(place[None])[0],
        velocity if np.all(np.abs(velocity) <= FASTEST_MPS) else None,
        radius,
        age_s,
        tuple(round(1e3 * float(value)) for value in place),
    )
