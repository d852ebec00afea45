"""Packets of an Ouster LiDAR (.pcap) and the sensor's metadata (.json), by the maker's library."""

from __future__ import annotations

import struct
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from clearway.io.samples.made_world import FARTHEST_M, place_at, ranges_m

SCANS = 3
PERIOD_S = 0.1
LIDAR_PORT = 7502
IMU_PORT = 7503
PCAP_HEAD = 24
RECORD_HEAD = 16
ETHERNET_HEAD = 14
BEGIN_S = 1_767_225_600
"""2026-01-01T00:00:00Z."""


def _sensor() -> Any:
    core: Any = import_module("ouster.sdk.core")
    sensor = core.SensorInfo.from_default(core.LidarMode._512x10)
    sensor.config.udp_port_lidar, sensor.config.udp_port_imu = LIDAR_PORT, IMU_PORT
    return sensor


def write_metadata(path: Path, rng: np.random.Generator) -> None:
    """What the sensor says of its beams."""
    del rng
    path.write_text(_sensor().to_json_string())


def write_packets(path: Path, rng: np.random.Generator) -> None:
    """Three turns, as the sensor sends them."""
    core: Any = import_module("ouster.sdk.core")
    pcap: Any = import_module("ouster.sdk.pcap")
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
    pcap.record(packets, str(path))
    path.write_bytes(_time_packets(path.read_bytes()))


def _time_packets(recorded: bytes) -> bytes:
    """The capture with times that are the same whenever it is written, a millisecond apart."""
    content = bytearray(recorded)
    at, number = PCAP_HEAD, 0
    while at < len(content):
        (length,) = struct.unpack_from("<I", content, at + 8)
        struct.pack_into("<II", content, at, BEGIN_S, 1000 * number)
        _number(content, at + RECORD_HEAD + ETHERNET_HEAD, number)
        at, number = at + RECORD_HEAD + length, number + 1
    return bytes(content)


def _number(content: bytearray, at: int, number: int) -> None:
    """Give an IP packet its number in the capture, in place of one in the process, and its sum."""
    struct.pack_into(">H", content, at + 4, number)
    struct.pack_into(">H", content, at + 10, 0)
    total = sum(struct.unpack_from(">10H", content, at))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    struct.pack_into(">H", content, at + 10, total ^ 0xFFFF)
