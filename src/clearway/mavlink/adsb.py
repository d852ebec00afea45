"""ADSB_VEHICLE into intruders: flags, altitude, age, size by category; our own echo is left out."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray, enu_from_geodetic
from clearway.mavlink.dialect import Message
from clearway.mavlink.own_state import CENTIMETRE, OwnMotion, geodetic_of
from clearway.traffic import Intruder, Ownship, Report, TrackerSettings
from clearway.traffic.tracking.screening import flaw_of_report

VALID_PLACE, VALID_ALTITUDE, VALID_HEADING, VALID_SPEED, VALID_CLIMB = 1, 2, 4, 8, 128
"""ADSB_FLAGS."""
PRESSURE = 0
"""ADSB_ALTITUDE_TYPE_PRESSURE_QNH."""
HALF_SPAN_M = {1: 6.0, 2: 15.0, 3: 20.0, 4: 30.0, 5: 35.0, 6: 8.0, 7: 8.0, 9: 12.0, 10: 15.0,
               11: 4.0, 12: 6.0, 14: 1.0, 15: 20.0}  # fmt: skip
"""Body radius by ADSB_EMITTER_TYPE: light, small, large, ... unmanned."""
UNKNOWN_HALF_SPAN_M = 15.0
MOST_AIRCRAFT = 64
"""Told to decisions at a time; no more are taken until some are gone."""
LEAST_STEP_S = 0.5
"""Between two positions that make a velocity."""

NO_PLACE = "traffic: no position"
NO_VELOCITY = "traffic: no velocity yet"
OWN_ECHO = "traffic: own echo"
TOO_MANY = f"traffic: more than {MOST_AIRCRAFT} aircraft"
FAR = "traffic: too far to meet"
STALE = "traffic: stale"
IMPOSSIBLE = "traffic: impossible"
NO_ORIGIN = "traffic: no origin of the local frame yet"
CO_ALTITUDE = "traffic: no altitude, taken at our height"
BY_PRESSURE = "traffic: altitude by pressure"


@dataclass(frozen=True, slots=True)
class AdsbSettings:
    """How reports are taken."""

    own_address: int | None = None
    """Our transponder's; without it our own echo is known by its place and velocity."""
    position_std_m: float = 0.0
    velocity_std_mps: float = 0.0
    extra_radius_m: float = 0.0
    """Kept beyond the margin and the intruder's half span."""
    reach_m: float = math.inf
    """Range of the grid."""
    horizon_s: float = math.inf
    """Time to fly through the grid."""
    oldest_s: float = 10.0


class AdsbPicture:
    """Aircraft heard of lately; gives an Intruder for each report that can be used."""

    def __init__(self, settings: AdsbSettings, counts: Counter[str]) -> None:
        self._settings, self._counts = settings, counts
        self._heard: dict[int, tuple[float, FloatArray]] = {}

    def take(
        self, message: Message, now_s: float, own: OwnMotion | None, origin: FloatArray | None
    ) -> Intruder | None:
        """The report as an intruder in the world frame, at the time that it was made."""
        if message.ICAO_address == self._settings.own_address:
            return self._left_out(OWN_ECHO)
        geodetic = geodetic_of(message.lat, message.lon, message.altitude)
        if not message.flags & VALID_PLACE or geodetic is None:
            return self._left_out(NO_PLACE)
        if origin is None or own is None:
            return self._left_out(NO_ORIGIN)
        time_s = now_s - float(message.tslc)
        if message.tslc > self._settings.oldest_s:
            return self._left_out(STALE)
        place = enu_from_geodetic(geodetic, origin)
        if not message.flags & VALID_ALTITUDE:
            self._counts[CO_ALTITUDE] += 1
            place[2] = own.position_m[2]
        elif message.altitude_type == PRESSURE:
            self._counts[BY_PRESSURE] += 1
        return self._followed(message, time_s, place, now_s, own)

    def _followed(
        self, message: Message, time_s: float, place: FloatArray, now_s: float, own: OwnMotion
    ) -> Intruder | None:
        address = int(message.ICAO_address)
        self._forget(now_s)
        before = self._heard.get(address)
        if before is None and len(self._heard) >= MOST_AIRCRAFT:
            return self._left_out(TOO_MANY)
        velocity = _told_velocity(message)
        if velocity is None:
            velocity = _velocity_between(before, time_s, place)
            if before is None or time_s - before[0] >= LEAST_STEP_S:
                self._heard[address] = (time_s, place)
            if velocity is None:
                return self._left_out(NO_VELOCITY)
        intruder = self._intruder(message, time_s, place, velocity)
        flaw = self._flaw(intruder, now_s, own)
        if flaw is not None:
            return self._left_out(flaw)
        self._heard[address] = (time_s, place)
        return intruder

    def _intruder(
        self, message: Message, time_s: float, place: FloatArray, velocity: FloatArray
    ) -> Intruder:
        settings = self._settings
        half_span = HALF_SPAN_M.get(message.emitter_type, UNKNOWN_HALF_SPAN_M)
        return Intruder(
            place,
            velocity,
            radius_m=half_span + settings.extra_radius_m,
            name=f"{message.ICAO_address:06x}",
            time_s=time_s,
            position_std_m=settings.position_std_m,
            velocity_std_mps=settings.velocity_std_mps,
            address=f"{message.ICAO_address:06x}",
        )

    def _flaw(self, intruder: Intruder, now_s: float, own: OwnMotion) -> str | None:
        settings = self._settings
        address = "" if settings.own_address is None else f"{settings.own_address:06x}"
        ownship = Ownship(own.position_m, own.velocity_mps, address)
        tracker = TrackerSettings(stale_s=settings.oldest_s)
        flaw = flaw_of_report(Report.of(intruder), now_s, ownship, tracker)
        if flaw is not None:
            return {"ownship": OWN_ECHO, "stale": STALE}.get(flaw, IMPOSSIBLE)
        closing = intruder.speed_mps + float(np.linalg.norm(own.velocity_mps))
        near = settings.reach_m + intruder.radius_m
        near += closing * (settings.horizon_s + now_s - intruder.time_s)
        apart = float(np.linalg.norm(intruder.position_m - own.position_m))
        return FAR if apart > near else None

    def _forget(self, now_s: float) -> None:
        oldest = now_s - self._settings.oldest_s
        self._heard = {key: told for key, told in self._heard.items() if told[0] >= oldest}

    def _left_out(self, reason: str) -> Intruder | None:
        self._counts[reason] += 1
        return None


def _told_velocity(message: Message) -> FloatArray | None:
    """[3] east, north, up; None where speed or heading are not valid."""
    if not (message.flags & VALID_HEADING and message.flags & VALID_SPEED):
        return None
    heading = math.radians(CENTIMETRE * message.heading)
    speed = CENTIMETRE * message.hor_velocity
    climb = CENTIMETRE * message.ver_velocity if message.flags & VALID_CLIMB else 0.0
    return np.array([speed * math.sin(heading), speed * math.cos(heading), climb])


def _velocity_between(
    before: tuple[float, FloatArray] | None, time_s: float, place: FloatArray
) -> FloatArray | None:
    """[3] by two positions."""
    if before is None or time_s - before[0] < LEAST_STEP_S:
        return None
    return np.asarray((place - before[1]) / (time_s - before[0]))
