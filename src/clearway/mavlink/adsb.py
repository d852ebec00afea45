"""ADSB_VEHICLE into reports of aircraft: flags, altitude, age, size by category."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from clearway.base.frames import FloatArray, enu_from_geodetic
from clearway.live.link.aircraft import AircraftReport
from clearway.mavlink.dialect import Message
from clearway.mavlink.own_state import CENTIMETRE, decode_geodetic

# ADSB_FLAGS.
VALID_PLACE = 1
VALID_ALTITUDE = 2
VALID_HEADING = 4
VALID_SPEED = 8
VALID_CLIMB = 128
PRESSURE = 0
"""ADSB_ALTITUDE_TYPE_PRESSURE_QNH."""
HALF_SPAN_M = {1: 6.0, 2: 15.0, 3: 20.0, 4: 30.0, 5: 35.0, 6: 8.0, 7: 8.0, 9: 12.0, 10: 15.0,
               11: 4.0, 12: 6.0, 14: 1.0, 15: 20.0}  # fmt: skip
"""Body radius by ADSB_EMITTER_TYPE: light, small, large, ... unmanned."""
UNKNOWN_HALF_SPAN_M = 15.0

NO_PLACE = "traffic: no position"
NO_ORIGIN = "traffic: no origin of the local frame yet"
CO_ALTITUDE = "traffic: no altitude, taken at our height"
BY_PRESSURE = "traffic: altitude by pressure"


def read_adsb_aircraft(
    message: Message, origin: FloatArray | None, own_height_m: float | None, counts: Counter[str]
) -> AircraftReport | None:
    """The report in the world frame; None, and counted, where nothing can be made of it.

    origin: latitude, longitude, height of the world's; own_height_m: for those without altitude.
    """
    geodetic = decode_geodetic(message.lat, message.lon, message.altitude)
    if not message.flags & VALID_PLACE or geodetic is None:
        counts[NO_PLACE] += 1
        return None
    if origin is None or own_height_m is None:
        counts[NO_ORIGIN] += 1
        return None
    place = enu_from_geodetic(geodetic, origin)
    if not message.flags & VALID_ALTITUDE:
        counts[CO_ALTITUDE] += 1
        place[2] = own_height_m
    elif message.altitude_type == PRESSURE:
        counts[BY_PRESSURE] += 1
    return AircraftReport(
        int(message.ICAO_address),
        place,
        _read_velocity(message),
        HALF_SPAN_M.get(message.emitter_type, UNKNOWN_HALF_SPAN_M),
        float(message.tslc),
        (message.lat, message.lon, message.altitude),
    )


def _read_velocity(message: Message) -> FloatArray | None:
    """[3] east, north, up; None where speed or heading are not valid."""
    if not (message.flags & VALID_HEADING and message.flags & VALID_SPEED):
        return None
    heading = math.radians(CENTIMETRE * message.heading)
    speed = CENTIMETRE * message.hor_velocity
    climb = CENTIMETRE * message.ver_velocity if message.flags & VALID_CLIMB else 0.0
    return np.array([speed * math.sin(heading), speed * math.cos(heading), climb])
