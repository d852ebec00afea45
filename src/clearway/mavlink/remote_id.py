"""Remote ID of drones nearby (OPEN_DRONE_ID_LOCATION) into reports of aircraft.

Heights are above the ellipsoid, and the autopilot's above sea level: GPS_RAW_INT tells both of the
own position, and with it how far they lie apart. Until it does, a drone counts at the own height.
"""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from clearway.base.frames import FloatArray, enu_from_geodetic
from clearway.base.remote_id import (
    ACCURACY_M,
    UNKNOWN_ALTITUDE_M,
    UNKNOWN_CLIMB,
    UNKNOWN_DIRECTION,
    UNKNOWN_SPEED,
    is_own_message,
    remote_address,
)
from clearway.live.link.aircraft import AircraftReport
from clearway.mavlink.adsb import CO_ALTITUDE, NO_ORIGIN, NO_PLACE
from clearway.mavlink.dialect import Message
from clearway.mavlink.own_state import CENTIMETRE, decode_geodetic

HALF_SPAN_M = 1.0
"""Of a drone."""
UNKNOWN_ACCURACY_M = 30.0
AGE_S = 1.0
"""No place is older when it is sent (ASTM F3411); the message's own second needs a common clock."""
FIX_3D = 3
ON_GROUND = 1
"""MAV_ODID_STATUS."""
OURS = "Remote ID: our own"
LANDED = "Remote ID: on the ground"
NO_GEOID = "Remote ID: height above the ellipsoid, and no GPS_RAW_INT: taken at our height"


def drone_of(
    message: Message,
    origin: FloatArray | None,
    own_height_m: float | None,
    geoid_m: float | None,
    counts: Counter[str],
) -> AircraftReport | None:
    """The report in the world frame; None, and counted, where nothing can be made of it.

    origin, own_height_m: as of `read_adsb_aircraft`. geoid_m: height of the sea level above
    the ellipsoid. Its body grows by the accuracy that it states.
    """
    identity = bytes(message.id_or_mac)
    geodetic = decode_geodetic(message.latitude, message.longitude, 0)
    if is_own_message(identity) or message.status == ON_GROUND:
        counts[OURS if is_own_message(identity) else LANDED] += 1
        return None
    if geodetic is None:
        counts[NO_PLACE] += 1
        return None
    if origin is None or own_height_m is None:
        counts[NO_ORIGIN] += 1
        return None
    height = float(message.altitude_geodetic)
    known = math.isfinite(height) and height > UNKNOWN_ALTITUDE_M
    if known and geoid_m is not None:
        geodetic[2] = height - geoid_m
    place = enu_from_geodetic(geodetic, origin)
    if not known or geoid_m is None:
        counts[NO_GEOID if known else CO_ALTITUDE] += 1
        place[2] = own_height_m
    accuracy = ACCURACY_M.get(message.horizontal_accuracy, UNKNOWN_ACCURACY_M)
    return AircraftReport(
        remote_address(identity),
        place,
        _velocity(message),
        HALF_SPAN_M + accuracy,
        AGE_S,
        (message.latitude, message.longitude, round(height) if math.isfinite(height) else 0),
    )


def _velocity(message: Message) -> FloatArray | None:
    """[3] east, north, up; None where speed or direction are not known."""
    if message.speed_horizontal >= UNKNOWN_SPEED or message.direction >= UNKNOWN_DIRECTION:
        return None
    course = math.radians(CENTIMETRE * message.direction)
    speed = CENTIMETRE * message.speed_horizontal
    climb = CENTIMETRE * message.speed_vertical if message.speed_vertical < UNKNOWN_CLIMB else 0.0
    return np.array([speed * math.sin(course), speed * math.cos(course), climb])
