"""Remote ID of others (OPEN_DRONE_ID messages of MAVLink) as reports of traffic."""

from __future__ import annotations

import math
from typing import Any

from clearway.base.remote_id import (
    ANONYMOUS,
    UNKNOWN_ALTITUDE_M,
    UNKNOWN_CLIMB,
    UNKNOWN_DIRECTION,
    UNKNOWN_SPEED,
    is_own_message,
    remote_address,
)
from clearway.io.traffic.traffic_rows import NO_POSITION, Sieve
from clearway.traffic.recorded.report import NOT_ICAO, TrafficReport

LOCATION, IDENTITY, PACK = (
    f"OPEN_DRONE_ID_{name}" for name in ("LOCATION", "BASIC_ID", "MESSAGE_PACK")
)
OURS = "the vehicle's own Remote ID"
HOUR_S = 3_600.0
GROUND = 1
"""MAV_ODID_STATUS."""
LONGEST_NAME = 20


class RemoteIds:
    """Takes messages of one file; names come apart from places, each under who sends it."""

    def __init__(self, sieve: Sieve) -> None:
        self._sieve = sieve
        self._names: dict[int, str] = {}

    def take(self, message: Any, kind: str, arrived_s: float) -> None:
        """One OPEN_DRONE_ID message, and when it came, seconds since 1970."""
        if kind == PACK:
            self._sieve.drop("Remote ID messages in a pack")
        elif is_own_message(bytes(message.id_or_mac)):
            self._sieve.use(OURS)
        elif kind == IDENTITY:
            name = bytes(message.uas_id).rstrip(b"\0").decode("ascii", "replace").strip()
            self._names[remote_address(bytes(message.id_or_mac))] = name[:LONGEST_NAME]
            self._sieve.use("identity")
        elif kind == LOCATION:
            self._take_place(message, arrived_s)
        else:
            self._sieve.use("other message of Remote ID")

    def _take_place(self, message: Any, arrived_s: float) -> None:
        """Degrees times 1e7, metres, centimetres a second, hundredths of degrees."""
        number = remote_address(bytes(message.id_or_mac))
        address = f"{NOT_ICAO}{number - ANONYMOUS:06x}"
        self._sieve.heard[address] += 1
        if message.latitude == message.longitude == 0:
            self._sieve.drop(NO_POSITION)
            return
        barometric, geometric = (
            None if value <= UNKNOWN_ALTITUDE_M else float(value)
            for value in (message.altitude_barometric, message.altitude_geodetic)
        )
        told = geometric if barometric is None else barometric
        kind = "geometric" if barometric is None else "barometric"
        on_ground = message.status == GROUND
        slow = message.speed_horizontal == UNKNOWN_SPEED
        course = message.direction >= UNKNOWN_DIRECTION
        self._sieve.take(
            TrafficReport(
                _moment(arrived_s, float(message.timestamp)),
                address,
                message.latitude * 1e-7,
                message.longitude * 1e-7,
                None if on_ground else told,
                "ground" if on_ground else None if told is None else kind,  # type: ignore[arg-type]
                geometric,
                None if slow else message.speed_horizontal * 1e-2,
                None if course else math.radians(message.direction * 1e-2),
                None if message.speed_vertical >= UNKNOWN_CLIMB else message.speed_vertical * 1e-2,
                self._names.get(number, ""),
                "remote id",
            )
        )


def _moment(arrived_s: float, after_hour_s: float) -> float:
    """When the place was true: seconds after a full hour, nearest to when the message came."""
    if not 0.0 <= after_hour_s <= HOUR_S:  # 65535 where it is unknown
        return arrived_s
    return after_hour_s + HOUR_S * round((arrived_s - after_hour_s) / HOUR_S)
