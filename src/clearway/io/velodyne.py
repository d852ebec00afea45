"""Velodyne packets into points, through velodyne-decoder; beams after its calibrations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import MissingExtraError
from clearway.frames import FloatArray
from clearway.sensors import NAMED_PATTERNS, BeamPattern, named_pattern

NAMED = {"VLP16": "vlp16", "PuckLite": "vlp16", "VLS128": "vls128", "AlphaPrime": "vls128"}
CALIBRATIONS = {
    "HDL32E": ("HDL-32E.yml", 0.166),
    "PuckHiRes": ("Puck Hi-Res.yml", 0.2),
    "VLP32A": ("VLP-32A.yml", 0.2),
    "VLP32B": ("VLP-32B.yml", 0.2),
    "VLP32C": ("VLP-32C.yml", 0.2),
}
"""Table of laser angles, and step in azimuth in degrees at 600 rpm (one firing cycle)."""


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

    def points(self, scan: Any) -> FloatArray:
        """[n, 3] of a velodyne_msgs/VelodyneScan: x ahead, y left, z up, metres.

        Returns nearer than 0.1 m are left out by the library.
        """
        packets = [
            self._library.VelodynePacket(
                packet.stamp.sec + 1e-9 * packet.stamp.nanosec, packet.data
            )
            for packet in scan.packets
        ]
        _, values = self._decoder.decode(self._library.PacketVector(packets))
        return np.ascontiguousarray(values[:, :3], dtype=np.float64)

    def pattern(self) -> BeamPattern | None:
        """Beams of the model that the packets name; None before any, and for unknown models."""
        model = self._decoder.model_id
        return None if model is None else model_pattern(str(model).rpartition(".")[2])


def model_pattern(model: str) -> BeamPattern | None:
    """Beams of a Velodyne by its name in velodyne-decoder; None for the HDL-64E, whose every
    unit has a calibration of its own."""
    if model in NAMED and NAMED[model] in NAMED_PATTERNS:
        return named_pattern(NAMED[model])
    if model not in CALIBRATIONS:
        return None
    from velodyne_decoder import Calibration, get_bundled_calibration

    file, step_deg = CALIBRATIONS[model]
    calibration: Calibration = get_bundled_calibration(file)
    words = calibration.to_string().split()
    angles = [float(words[n + 1]) for n, word in enumerate(words) if word == "vert_correction:"]
    pattern = BeamPattern.rotating(np.sort(np.degrees(angles)), step_deg, name=model)
    return replace(pattern, min_range_m=0.4, max_range_m=100.0 if model == "HDL32E" else 200.0)
