"""What a simulated autopilot tells: its messages, made of the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from clearway.base.frames import (
    FloatArray,
    attitude_ned_frd_from_enu,
    geodetic_from_enu,
    ned_from_enu,
    world_from_body,
)
from clearway.mavlink.dialect import Message, dialect
from clearway.mavlink.distances import BODY_FRD, UNKNOWN
from clearway.mavlink.set_points import IGNORE_POSITION
from clearway.mavlink.simulated_targets import Target, VelocityTarget
from clearway.mavlink.simulated_vehicle import VehicleTruth
from clearway.mavlink.surroundings import PROXIMITY
from clearway.obstacles.world import World
from clearway.traffic import Intruder

SECTORS = 72
"""Of OBSTACLE_DISTANCE."""
RAYS = 5
"""Cast in each sector."""
FIRST_ADDRESS = 0xC1EA00
# ADSB_EMITTER_TYPE.
LIGHT = 1
UNMANNED = 14
ALL_VALID = 1 | 2 | 4 | 8 | 128
# MAV_MODE_FLAG.
ARMED = 128
GUIDED = 8
# MAV_LANDED_STATE.
ON_GROUND = 1
IN_AIR = 2
TAKING_OFF = 3
QUADROTOR = 2
GENERIC = 0
ACTIVE = 4
MAVLINK_3 = 3
GEOMETRIC = 1
"""ADSB_ALTITUDE_TYPE_GEOMETRIC."""


def pulse(*, armed: bool, follows: bool) -> Message:
    """HEARTBEAT."""
    base = (ARMED if armed else 0) | (GUIDED if follows else 0)
    return dialect().MAVLink_heartbeat_message(QUADROTOR, GENERIC, base, 0, ACTIVE, MAVLINK_3)


def report_landing(state: int) -> Message:
    """EXTENDED_SYS_STATE."""
    return dialect().MAVLink_extended_sys_state_message(0, state)


def health(proximity: bool) -> Message:
    """SYS_STATUS: whether a sensor of distances works."""
    known, healthy = PROXIMITY, PROXIMITY if proximity else 0
    return dialect().MAVLink_sys_status_message(
        known, known, healthy, 0, 12_000, -1, -1, 0, 0, 0, 0, 0, 0
    )


def answer(command: int, result: int, system: int, component: int) -> Message:
    """COMMAND_ACK."""
    return dialect().MAVLink_command_ack_message(command, result, 0, 0, system, component)


def local_origin(origin_geodetic: FloatArray) -> Message:
    """GPS_GLOBAL_ORIGIN."""
    latitude, longitude, height = origin_geodetic.tolist()
    return dialect().MAVLink_gps_global_origin_message(
        round(latitude * 1e7), round(longitude * 1e7), round(height * 1e3)
    )


def home(origin_geodetic: FloatArray, ground_m: float) -> Message:
    """HOME_POSITION: below the origin of the mission, on the ground."""
    latitude, longitude, height = origin_geodetic.tolist()
    return dialect().MAVLink_home_position_message(
        round(latitude * 1e7),
        round(longitude * 1e7),
        round((height + ground_m) * 1e3),
        *[0.0, 0.0, -ground_m],
        [1.0, 0.0, 0.0, 0.0],
        *[0.0, 0.0, 0.0],
    )


def target(told: Target, boot_ms: int) -> Message:
    """POSITION_TARGET_LOCAL_NED: where it flies to, or only how fast."""
    nowhere = isinstance(told, VelocityTarget)
    place = np.zeros(3) if isinstance(told, VelocityTarget) else ned_from_enu(told.position_m)
    speed = np.zeros(3) if told.velocity_mps is None else told.velocity_mps
    return dialect().MAVLink_position_target_local_ned_message(
        boot_ms, 1, IGNORE_POSITION if nowhere else 0,
        *place.tolist(), *ned_from_enu(speed).tolist(), 0.0, 0.0, 0.0, 0.0, 0.0,
    )  # fmt: skip


def attitude(truth: VehicleTruth, boot_ms: int, tilt_rad: float = 0.0) -> Message:
    """ATTITUDE, with the nose down by so much."""
    angles = attitude_ned_frd_from_enu([0.0, tilt_rad, truth.yaw_rad]).tolist()
    return dialect().MAVLink_attitude_message(boot_ms, *angles, 0.0, 0.0, 0.0)


def report_position(truth: VehicleTruth, boot_ms: int) -> Message:
    """LOCAL_POSITION_NED."""
    place = ned_from_enu(truth.position_m).tolist()
    velocity = ned_from_enu(truth.velocity_mps).tolist()
    return dialect().MAVLink_local_position_ned_message(boot_ms, *place, *velocity)


def measure_sectors(
    truth: VehicleTruth, world: World, range_m: float, tilt_rad: float = 0.0
) -> FloatArray:
    """[SECTORS] the least distance of the rays in every sector; inf where there is nothing."""
    turn = world_from_body([0.0, tilt_rad, truth.yaw_rad])
    rays = np.ascontiguousarray(_sector_rays() @ turn.T)
    hit = world.cast(truth.position_m, rays, range_m).reshape(SECTORS, RAYS)
    return np.asarray(hit.min(axis=1))


def circle(distance_m: FloatArray, boot_ms: int, range_m: float) -> Message:
    """OBSTACLE_DISTANCE."""
    reach = round(100.0 * range_m)
    told = np.where(np.isfinite(distance_m), np.floor(100.0 * distance_m), reach + 1)
    return dialect().MAVLink_obstacle_distance_message(
        1000 * boot_ms,
        0,
        [int(value) for value in np.minimum(told, UNKNOWN - 1)],
        0,
        0,
        reach,
        360.0 / SECTORS,
        0.0,
        BODY_FRD,
    )


def eighths(distance_m: FloatArray, boot_ms: int, range_m: float, shown: set[int]) -> list[Message]:
    """DISTANCE_SENSOR of the sectors that have shown anything yet, of eight; they are added to.

    None while none shows anything.
    """
    reach = round(100.0 * range_m)
    each = SECTORS // 8
    # The first sector is centred on the nose, and so is its eighth.
    around = np.roll(distance_m, each // 2)[: 8 * each].reshape(8, each).min(axis=1)
    shows = {number for number, far in enumerate(around.tolist()) if 100.0 * far < reach}
    shown |= shows
    return [
        dialect().MAVLink_distance_sensor_message(
            boot_ms, 0, reach, int(min(100.0 * far, reach)), 0, 0, number, 0, 0.0, 0.0, [0.0] * 4
        )
        for number, far in enumerate(around.tolist())
        if shows and number in shown
    ]


def adsb(
    report: Intruder, names: Sequence[str], origin_geodetic: FloatArray, category: int = UNMANNED
) -> Message:
    """ADSB_VEHICLE of one of the intruders of a mission, by names."""
    place = geodetic_from_enu(report.position_m, origin_geodetic)
    latitude, longitude, height = place.tolist()
    east, north, up = report.velocity_mps.tolist()
    return dialect().MAVLink_adsb_vehicle_message(
        FIRST_ADDRESS + names.index(report.name),
        round(latitude * 1e7),
        round(longitude * 1e7),
        GEOMETRIC,
        round(height * 1e3),
        round(math.degrees(math.atan2(east, north)) * 100) % 36_000,
        round(100.0 * math.hypot(east, north)),
        round(100.0 * up),
        report.name[:8].encode("ascii", "replace"),
        category,
        0,
        ALL_VALID,
        0,
    )


@lru_cache(maxsize=1)
def _sector_rays() -> FloatArray:
    """[SECTORS * RAYS, 3] level unit vectors of the body, sector by sector clockwise from ahead."""
    width = 2.0 * math.pi / SECTORS
    across = (np.arange(RAYS) + 0.5) / RAYS - 0.5
    clockwise = (np.arange(SECTORS)[:, None] + across).ravel() * width
    return np.stack([np.cos(clockwise), -np.sin(clockwise), np.zeros(len(clockwise))], axis=-1)
