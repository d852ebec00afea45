"""OBSTACLE_DISTANCE into scans: sectors as beams that returned, cleared, or saw nothing.

The message has up to 72 sectors, each with the least distance in it. The sensor that decisions know
has beams all round, a few to a sector: each takes the distance of the sector that it lies in, so
what is somewhere in a sector counts as everywhere across it. Sectors lie in the level plane, as
autopilots use them; an opening says how far up and down they stand for, which a tilt of the vehicle
lessens. A sector that is unknown is no free space: its beams are told as ended within the blind
range.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray, wrap_angle
from clearway.base.state import State
from clearway.mavlink.dialect import Message
from clearway.sensors import BeamPattern, Lidar, Mounting, Scan
from clearway.sensors.beams.lidar import MOST_TILT_RAD

NAME = "obstacle-distance"
UNKNOWN = 65_535
"""UINT16_MAX: nothing is known of the sector, or it is not used."""
NORTH_ALIGNED = 0
"""MAV_FRAME_GLOBAL."""
BODY_FRD = 12
"""MAV_FRAME_BODY_FRD."""
STEP_RAD = math.radians(1.0)
"""Between beams, all round."""
LEAST_FAN_STEP_RAD = math.radians(3.0)
BLIND_M = 0.0075
"""Blind range."""
ENDED_M = 0.005
"""Where beams end that saw nothing."""
TOUCHING_M = 0.01
"""What a distance of 0 stands for: an obstacle at the sensor."""
LEAST_STEP_DEG = 0.1
"""No sensor has finer sectors."""
FLOWN_TILT_RAD = math.radians(15.0)
"""Taken from the opening for good: a copter tilts by so much where it gains 2.6 m/s in a second.
What pre-flight tries is then what is seen in flight."""
LEVEL_RAD = math.radians(3.0)
"""A level sector says nothing of beams that point farther off the level than this; a sensor may be
mounted off the level, or its plane tilt between two attitudes, by as much."""

OTHER_FRAME = "distances: of another frame"
NO_SECTORS = "distances: no sector is known"
SHORT = "distances: sensor ends before the mission's range"


def sector_lidar(
    max_range_m: float, fan_rad: float = 0.0, sigma_m: float = 0.0, airframe_radius_m: float = 0.0
) -> Lidar:
    """The sensor behind OBSTACLE_DISTANCE: beams all round, level or in a fan.

    fan_rad: how far up and down the sensor looks; its beams fan out by less (`FLOWN_TILT_RAD`).
    """
    fan_rad = max(fan_rad - FLOWN_TILT_RAD, 0.0)
    azimuths = np.arange(-math.pi + 0.5 * STEP_RAD, math.pi, STEP_RAD)
    half = math.ceil(fan_rad / LEAST_FAN_STEP_RAD - 1e-9)
    elevations = np.linspace(-fan_rad, fan_rad, 2 * half + 1)
    pattern = BeamPattern.from_angles(
        azimuths, elevations, name=NAME, min_range_m=BLIND_M, max_range_m=max_range_m
    )
    return Lidar(
        NAME,
        pattern,
        mounting=Mounting(),
        sigma_m=sigma_m,
        dropout=0.0,
        airframe_radius_m=airframe_radius_m,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Sectors:
    """Distances all round, level."""

    distance_m: FloatArray
    """[n] NaN where unknown, inf where nothing is within the sensor's range."""
    increment_rad: float
    """From sector to sector, clockwise seen from above."""
    offset_rad: float
    """Of the middle of the first sector, clockwise from the nose or from north."""
    from_north: bool
    reach_m: float
    """The sensor's range."""
    blind_m: float = 0.0
    """How near the sensor measures nothing."""

    @classmethod
    def of(cls, message: Message, counts: Counter[str]) -> Sectors | None:
        """The sectors of a message; None, and counted, where it cannot be used."""
        if message.frame not in (NORTH_ALIGNED, BODY_FRD):
            counts[OTHER_FRAME] += 1
            return None
        told = np.array(message.distances, dtype=np.float64)
        step = message.increment_f if message.increment_f else float(message.increment)
        offset = message.angle_offset
        usable = LEAST_STEP_DEG <= abs(step) <= 360.0 and abs(offset) <= 360.0
        reach = float(message.max_distance)
        known = told < UNKNOWN
        if not (usable and reach > 0.0 and known.any()):
            counts[NO_SECTORS] += 1
            return None
        distance = np.where(told > reach, np.inf, np.maximum(0.01 * told, TOUCHING_M))
        distance[~known] = np.nan
        count = min(len(told), round(360.0 / abs(step)))
        return cls(
            distance[:count],
            math.radians(step),
            math.radians(offset),
            message.frame == NORTH_ALIGNED,
            0.01 * reach,
            0.01 * message.min_distance,
        )

    def towards(self, clockwise_rad: FloatArray) -> FloatArray:
        """[n] distances of the sectors in which directions lie; NaN where none is known."""
        step = abs(self.increment_rad)
        turned = np.sign(self.increment_rad) * (clockwise_rad - self.offset_rad)
        index = np.floor(np.mod(turned + 0.5 * step, 2.0 * math.pi) / step + 1e-9)
        index = index.astype(np.int64)
        there = index < len(self.distance_m)
        return np.where(there, self.distance_m[np.where(there, index, 0)], np.nan)

    def about(self, clockwise_rad: FloatArray, aside_rad: float) -> FloatArray:
        """[n] the least distance up to so far beside directions; NaN where any is unknown."""
        steps = math.ceil(aside_rad / abs(self.increment_rad) - 1e-9)
        aside = np.linspace(-aside_rad, aside_rad, 2 * steps + 1)
        distances = [self.towards(clockwise_rad + each) for each in aside]
        return np.asarray(np.minimum.reduce(distances))


def make_sector_scan(
    sectors: Sectors,
    lidar: Lidar,
    state: State,
    heading_rad: float,
    counts: Counter[str],
    tilt_rad: float = 0.0,
) -> Scan:
    """What the beams of `lidar` saw, for a vehicle in a state with its nose at a heading.

    state: attitude of the flight path, which is what the beams are fixed to; heading_rad: yaw of
    the nose; tilt_rad: how far the body may have been off the level. Beams that saw nothing end
    within the blind range.
    """
    pattern = lidar.pattern
    level = pattern.directions @ state.world_from_body.T
    azimuth = np.arctan2(level[:, 1], level[:, 0])
    ahead = 0.5 * math.pi if sectors.from_north else heading_rad
    fan = float(np.abs(pattern.elevation_rad).max())
    left = fan + FLOWN_TILT_RAD - tilt_rad if fan else -tilt_rad
    up = max(min(fan, left), LEVEL_RAD)
    distance = sectors.about(
        np.asarray(wrap_angle(ahead - azimuth)), _aside(tilt_rad, up if fan else 0.0)
    )
    steep = np.abs(np.arcsin(np.clip(level[:, 2], -1.0, 1.0)))
    distance = np.where(steep > up + 1e-9, np.nan, distance)
    if sectors.reach_m < pattern.max_range_m - 0.01:
        counts[SHORT] += 1
        distance = np.where(np.isinf(distance), np.nan, distance)
    ended = np.where(np.isnan(distance), ENDED_M, distance)
    back = np.isfinite(ended)
    points = np.ascontiguousarray(ended[back, None] * pattern.directions[back])
    unsure = min(max(LEVEL_RAD - left, 0.0), MOST_TILT_RAD)
    return Scan(points, state.time_s, sensor=lidar.name, tilt_rad=unsure, blind_m=sectors.blind_m)


def _aside(tilt_rad: float, up_rad: float) -> float:
    """How far a direction, so far up or down, may lie beside where it does in the tilted body."""
    tilt = min(tilt_rad, MOST_TILT_RAD)
    return math.tan(0.5 * tilt) ** 2 + math.sin(tilt) * math.tan(up_rad)


def nothing_known(reach_m: float) -> Sectors:
    """A circle of which no sector is known."""
    return Sectors(np.full(8, np.nan), math.radians(45.0), 0.0, False, reach_m)
