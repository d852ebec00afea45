"""Velodyne packets into points, through velodyne-decoder; beams after its calibrations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.base.errors import MissingExtraError
from clearway.base.frames import FloatArray
from clearway.io.scans.pointcloud import PointCloud
from clearway.sensors import NAMED_PATTERNS, BeamPattern, find_pattern

NAMED = {"VLP16": "vlp16", "PuckLite": "vlp16", "VLS128": "vls128", "AlphaPrime": "vls128"}
CALIBRATIONS = {
    "HDL32E": ("HDL-32E.yml", 0.166),
    "PuckHiRes": ("Puck Hi-Res.yml", 0.2),
    "VLP32A": ("VLP-32A.yml", 0.2),
    "VLP32B": ("VLP-32B.yml", 0.2),
    "VLP32C": ("VLP-32C.yml", 0.2),
}
"""Table of laser angles, and step in azimuth in degrees at 600 rpm (one firing cycle)."""


PACKET_BYTES = 1206
"""The library ends the process on a scan without packets, and reads this many of each."""
BLOCKS = 12
BLOCK_BYTES = 100
"""Of a packet; each begins with two marks and its azimuth in hundredths of a degree, clockwise."""
LOST_RAD = np.radians(5.0)
"""A wider step in azimuth is lost packets. One packet spans 2 to 5 deg, and drivers cut sweeps
between packets, so that neither begins where the last one ended."""


class VelodyneDecoder:
    """Turns the packets of one sensor into points; the packets say which model it is.

    Raises MissingExtraError without the package.
    """

    def __init__(self, path: Path) -> None:
        try:
            import velodyne_decoder
        except ImportError as cause:
            raise MissingExtraError(f"reading {path}", "lidar") from cause
        self._library: Any = velodyne_decoder
        self._decoder: Any = velodyne_decoder.ScanDecoder(velodyne_decoder.Config(max_range=300.0))

    def cloud(self, scan: Any, source: str) -> PointCloud:
        """Points of a velodyne_msgs/VelodyneScan: x ahead, y left, z up, metres, and its beams.

        Returns nearer than 0.1 m are left out by the library. Beams are those of the model that
        the packets name, without azimuths whose packets are lost; estimated for unknown models.
        """
        if not scan.packets or any(len(one.data) != PACKET_BYTES for one in scan.packets):
            raise ValueError(f"a scan needs packets of {PACKET_BYTES} bytes")
        packets = [
            self._library.VelodynePacket(
                packet.stamp.sec + 1e-9 * packet.stamp.nanosec, packet.data
            )
            for packet in scan.packets
        ]
        _, values = self._decoder.decode(self._library.PacketVector(packets))
        points = np.ascontiguousarray(values[:, :3], dtype=np.float64)
        lost = find_lost_sectors(np.array([packet.data for packet in scan.packets]))
        model = self._decoder.model_id
        pattern = None if model is None else model_pattern(str(model).rpartition(".")[2])
        if pattern is not None and len(lost):
            pattern = without_sectors(pattern, lost)
        degrees = float(np.degrees(np.sum(lost[:, 1] - lost[:, 0])))
        return PointCloud(
            points,
            classes=None,
            crs=None,
            unit="metres",
            source=source,
            notes=(f"packets of {degrees:.0f} deg are missing",) if len(lost) else (),
            pattern=pattern,
            complete=not len(lost),
        )


def find_lost_sectors(packets: npt.NDArray[np.uint8]) -> FloatArray:
    """[n, 2] azimuths from and to, left positive, between which no packet [m, 1206] looked."""
    low = packets[:, 2 : BLOCKS * BLOCK_BYTES : BLOCK_BYTES].astype(np.int64)
    high = packets[:, 3 : BLOCKS * BLOCK_BYTES : BLOCK_BYTES].astype(np.int64)
    looked = np.sort(np.mod(-np.radians((low + 256 * high).ravel() / 100.0), 2.0 * np.pi))
    steps = np.diff(looked, append=looked[0] + 2.0 * np.pi)
    wide = steps > LOST_RAD
    return np.stack([looked[wide], looked[wide] + steps[wide]], axis=-1)


def without_sectors(pattern: BeamPattern, lost: FloatArray) -> BeamPattern:
    """The beams outside of sectors."""
    kept = np.ones(pattern.beams, dtype=np.bool_)
    for start, end in lost:
        after = np.mod(pattern.azimuth_rad - start, 2.0 * np.pi)
        kept &= (after <= 0.0) | (after >= end - start)
    return replace(
        pattern,
        name=f"{pattern.name}, {np.count_nonzero(kept)} of {pattern.beams} beams came",
        azimuth_rad=pattern.azimuth_rad[kept],
        elevation_rad=pattern.elevation_rad[kept],
    )


def model_pattern(model: str) -> BeamPattern | None:
    """Beams of a Velodyne by its name in velodyne-decoder; None for the HDL-64E, whose every
    unit has a calibration of its own."""
    if model in NAMED and NAMED[model] in NAMED_PATTERNS:
        return find_pattern(NAMED[model])
    if model not in CALIBRATIONS:
        return None
    from velodyne_decoder import Calibration, get_bundled_calibration

    file, step_deg = CALIBRATIONS[model]
    calibration: Calibration = get_bundled_calibration(file)
    words = calibration.to_string().split()
    angles = [float(words[n + 1]) for n, word in enumerate(words) if word == "vert_correction:"]
    pattern = BeamPattern.rotating(np.sort(np.degrees(angles)), step_deg, name=model)
    return replace(pattern, min_range_m=0.4, max_range_m=100.0 if model == "HDL32E" else 200.0)
