"""Packets of an Ouster LiDAR (.pcap) and the sensor's metadata (.json), by the maker's library."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from clearway.io.samples.made_world import FARTHEST_M, place_at, ranges_m

SCANS, PERIOD_S = 3, 0.1
LIDAR_PORT, IMU_PORT = 7502, 7503


def _sensor() -> Any:
    from ouster.sdk import core

    sensor = core.SensorInfo.from_default(core.LidarMode._512x10)
    sensor.config.udp_port_lidar, sensor.config.udp_port_imu = LIDAR_PORT, IMU_PORT
    return sensor


def write_metadata(path: Path, rng: np.random.Generator) -> None:
    """What the sensor says of its beams."""
    del rng
    path.write_text(_sensor().to_json_string())


def write_packets(path: Path, rng: np.random.Generator) -> None:
    """Three turns, as the sensor sends them."""
    from ouster.sdk import core, pcap

    sensor = _sensor()
    directions = core.XYZLut(sensor)
    packets = []
    for index in range(SCANS):
        scan = core.LidarFrame(sensor)
        scan.frame_id = index + 1
        far = np.full((scan.h, scan.w), 1000, dtype=np.uint32)
        beams = core.destagger(sensor, directions(far)).reshape(-1, 3)
        lengths = np.linalg.norm(beams, axis=1, keepdims=True)
        ranges = ranges_m(beams / lengths, place_at(PERIOD_S * index))
        ranges = ranges + 0.02 * rng.standard_normal(len(ranges))
        told = np.where(ranges < FARTHEST_M, 1000.0 * ranges, 0.0).astype(np.uint32)
        field = scan.field(core.ChanField.RANGE)
        field[:] = core.destagger(sensor, told.reshape(scan.h, scan.w), inverse=True)
        columns = np.arange(scan.w)
        scan.timestamp[:] = 1_000_000_000 + (index * scan.w + columns) * int(1e8 / scan.w)
        scan.measurement_id[:] = columns
        scan.status[:] = 1
        packets += core.frame_to_packets(scan, core.PacketFormat(sensor), 1, 1)
    pcap.record((_timed(packet, number) for number, packet in enumerate(packets)), str(path))


def _timed(packet: Any, number: int) -> Any:
    packet.host_timestamp = 1_767_225_600_000_000_000 + number * 1_000_000
    return packet
