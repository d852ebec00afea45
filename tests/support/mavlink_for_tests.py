"""An autopilot's side of a link, message by message, and sessions without a link or a clock."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from clearway.live import AvoidanceSystem
from clearway.live.link.floor import FloorRule
from clearway.live.link.hearing import SessionTerms
from clearway.live.link.outcome import TickOutcome
from clearway.live.link.session import Session
from clearway.mavlink.dialect import EXTENDED_SYS_STATE
from clearway.mavlink.distances import sector_lidar
from clearway.mavlink.inbox import Inbox, ReceivedMessage
from clearway.mavlink.mavlink_session import MavlinkSession, MavlinkTerms
from clearway.mavlink.outbox import Packer
from clearway.mavlink.signing import SignatureCheck

KEY = bytes(range(32))
OTHER_KEY = bytes(range(1, 33))
ORIGIN = (52.0, 4.3, 10.0)
FOLLOWS = 128 | 8
"""Base mode: armed, guided."""
PEER = ("127.0.0.1", 14551)
SENSOR = sector_lidar(10.0)
SET_POINT, COLLISION, TEXT, BEAT = (
    "SET_POSITION_TARGET_LOCAL_NED",
    "COLLISION",
    "STATUSTEXT",
    "HEARTBEAT",
)


def framed(*messages: Any, system: int = 1, component: int = 1, key: bytes | None = None) -> bytes:
    """MAVLink 2 frames of an autopilot."""
    packer = Packer(system, component, key)
    return b"".join(packer.pack(message) for message in messages)


def raw_frame(number: int, payload: bytes) -> bytes:
    """A frame of the vehicle's autopilot with any payload, its checksum right."""
    head = bytes([len(payload), 0, 0, 0, 1, 1]) + number.to_bytes(3, "little")
    extra = mavlink.mavlink_map[number].crc_extra
    crc = mavlink.x25crc(head + payload + bytes([extra])).crc
    return b"\xfd" + head + payload + int(crc).to_bytes(2, "little")


def heartbeat(base_mode: int = FOLLOWS, autopilot: int = 0, custom_mode: int = 0) -> Any:
    return mavlink.MAVLink_heartbeat_message(2, autopilot, base_mode, custom_mode, 4, 3)


def attitude(time_s: float, heading_deg: float = 90.0) -> Any:
    heading = math.radians(heading_deg)
    return mavlink.MAVLink_attitude_message(ms(time_s), 0.0, 0.0, heading, 0.0, 0.0, 0.0)


def position(time_s: float, ned: Any = (0, 0, 0), velocity_ned: Any = (0, 1, 0)) -> Any:
    """By default at the origin, flying east: along x."""
    place, velocity = map(float, ned), map(float, velocity_ned)
    return mavlink.MAVLink_local_position_ned_message(ms(time_s), *place, *velocity)


def origin(place: Any = ORIGIN) -> Any:
    latitude, longitude, height = place
    return mavlink.MAVLink_gps_global_origin_message(
        round(latitude * 1e7), round(longitude * 1e7), round(height * 1e3)
    )


def distances(time_s: float, sectors: dict[int, int] | None = None, **more: Any) -> Any:
    """Nothing near, but for the centimetres of some sectors."""
    told = [1001] * 72
    for sector, centimetres in (sectors or {}).items():
        told[sector] = centimetres
    fields = {"increment": 5, "increment_f": 0.0, "offset": 0.0, "frame": 12, "reach": 1000} | more
    return mavlink.MAVLink_obstacle_distance_message(
        1000 * ms(time_s), 0, told, fields["increment"], 0, fields["reach"],
        fields["increment_f"], fields["offset"], fields["frame"],
    )  # fmt: skip


def aircraft(address: int = 0xABCDEF, **more: Any) -> Any:
    """A drone 8 m north and 6 m east of the origin at its height, flying south at 1 m/s."""
    fields = {
        "lat": 520_000_719, "lon": 43_000_874, "type": 1, "height_mm": 10_000, "heading": 18_000,
        "speed": 100, "climb": 0, "category": 14, "tslc": 0, "flags": 1 | 2 | 4 | 8 | 128,
    } | more  # fmt: skip
    return mavlink.MAVLink_adsb_vehicle_message(
        address, fields["lat"], fields["lon"], fields["type"], fields["height_mm"],
        fields["heading"], fields["speed"], fields["climb"], b"KITE", fields["category"],
        fields["tslc"], fields["flags"], 0,
    )  # fmt: skip


def drone(**more: Any) -> Any:
    """A drone where `aircraft` is, by Remote ID: 10 m above sea level, 48 m more above WGS 84."""
    fields = {
        "sender": b"\x60\x60\x1f\x01", "status": 2, "direction": 18_000, "speed": 100, "climb": 0,
        "lat": 520_000_719, "lon": 43_000_874, "height_m": 58.0, "accuracy": 11,
    } | more  # fmt: skip
    return mavlink.MAVLink_open_drone_id_location_message(
        0, 0, fields["sender"].ljust(20, b"\0"), fields["status"], fields["direction"],
        fields["speed"], fields["climb"], fields["lat"], fields["lon"], -1000.0,
        fields["height_m"], 0, 20.0, fields["accuracy"], 4, 4, 3, 120.0, 1,
    )  # fmt: skip


def ms(time_s: float) -> int:
    return round(1000.0 * time_s) % 2**32


def in_the_air(state: int = 2) -> Any:
    """EXTENDED_SYS_STATE."""
    return mavlink.MAVLink_extended_sys_state_message(0, state)


OF_THE_LINK = ("system", "component", "position_std_m", "mission_origin", "asks")
"""What a bench is told that is of the link, not of the session."""


class Bench:
    """A session and an inbox, told everything by hand; our clock and the vehicle's run together."""

    def __init__(
        self,
        *,
        act: bool = True,
        key: bytes | None = None,
        sensor: bool = True,
        airborne: bool = True,
        waypoints: Any = ((30.0, 0.0, 0.0),),
        **settings: Any,
    ) -> None:
        # The reach set is built when this is imported, which tests of messages need not wait for.
        from worlds_for_tests import mission, planner

        self.counts: Counter[str] = Counter()
        lidar = SENSOR if sensor else None
        self.system = AvoidanceSystem(
            planner(), mission(*waypoints), lidars=() if lidar is None else (lidar,)
        )
        over = {key: settings.pop(key) for key in OF_THE_LINK if key in settings}
        settings = {"floor": FloorRule(0.6, -100.0)} | settings
        terms = MavlinkTerms(session=SessionTerms(act=act, **settings), **over)
        core = Session(self.system, lidar, terms.session, self.counts)
        self.session = MavlinkSession(core, lidar, terms, self.counts)
        check = None if key is None else SignatureCheck(key)
        self.inbox = Inbox(1, 1, check, stream=False)
        if airborne:
            self.session.take(ReceivedMessage(in_the_air(), EXTENDED_SYS_STATE, PEER), 0.0)

    def hear(self, wall_s: float, *pieces: bytes) -> None:
        for arrival in self.inbox.take([(piece, PEER) for piece in pieces]):
            self.session.take(arrival, wall_s)

    def tell(self, wall_s: float, *messages: Any, **more: Any) -> None:
        self.hear(wall_s, framed(*messages, **more))

    def tick(self, time_s: float, *messages: Any) -> TickOutcome:
        """Hear messages and tick, our clock 1000 s ahead of the vehicle's."""
        if messages:
            self.tell(1000.0 + time_s, *messages)
        return self.session.tick(1000.0 + time_s)

    def all_well(self, time_s: float, **more: Any) -> TickOutcome:
        """A tick with everything fresh."""
        place = more.get("ned", (0.0, 0.0, 0.0))
        return self.tick(
            time_s,
            heartbeat(),
            origin(),
            attitude(time_s),
            position(time_s, place),
            distances(time_s, more.get("sectors")),
        )


def sent(outcome: TickOutcome, kind: str) -> list[Any]:
    """Messages of a type that an outcome sends."""
    return [message for message in outcome.messages if message.get_type() == kind]


def enu(*values: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array(values)


def words(outcome: Any) -> str:
    """All that an outcome says in STATUSTEXT."""
    return "".join(message.text for message in sent(outcome, TEXT))
