"""Beams that a sensor hears nothing of: did they go on, or end within its blind range?

What stands nearer than a sensor's least range gives no return and hides what is behind it. A beam
without return therefore shows something only where its way through the blind range was seen to be
free before, from farther off.
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats, Floats2, UInt64s3
from clearway.base.compiled import compiled
from clearway.sensors.beams.raster import BeamRaster
from clearway.sensors.observed.seen_space import is_place_free
from clearway.sensors.passing.passed_points import Sensor

STEPS = 2.0
"""Places looked up in a voxel's width."""


@compiled
def heard_of(
    nearest: Floats2, raster: BeamRaster, sensor: Sensor, free: UInt64s3, window: Floats
) -> Floats2:
    """[columns, rows] range of the nearest return; 0 also where nothing came back and the way
    through the blind range was not seen to be free.

    nearest: `nearest_returns` of a sweep. free, window: of a `SeenSpace`.
    """
    told = nearest.copy()
    _note_hidden(told, raster, sensor, free, window)
    return told


@compiled
def _note_hidden(
    told: Floats2, raster: BeamRaster, sensor: Sensor, free: UInt64s3, window: Floats
) -> None:
    columns, rows = told.shape
    for j in range(columns):
        # The middle of the column, by its pseudo-angle.
        turned = (j + 0.5) / raster.per_column - 2.0
        forward = turned if abs(turned) <= 1.0 else np.copysign(2.0, turned) - turned
        x = np.copysign(1.0 - abs(forward), 1.0 if abs(turned) <= 1.0 else -1.0)
        level = np.sqrt(x * x + forward * forward)
        for k in range(rows):
            if told[j, k] == np.inf and raster.low[j, k] < np.inf:
                sine = min(1.0, max(-1.0, raster.bottom + (k + 0.5) / raster.per_row))
                cosine = np.sqrt(1.0 - sine * sine) / level
                if not _was_free(cosine * x, cosine * forward, sine, sensor, free, window):
                    told[j, k] = 0.0


@compiled
def _was_free(x: float, y: float, z: float, sensor: Sensor, free: UInt64s3, window: Floats) -> bool:
    """Whether a direction of the sensor's frame was seen to be free through its blind range."""
    r, o = sensor.rotation, sensor.origin
    east = r[0, 0] * x + r[0, 1] * y + r[0, 2] * z
    north = r[1, 0] * x + r[1, 1] * y + r[1, 2] * z
    up = r[2, 0] * x + r[2, 1] * y + r[2, 2] * z
    count = int(np.ceil(STEPS * sensor.min_range * window[3]))
    for n in range(count + 1):
        away = sensor.min_range * n / count
        if not is_place_free(
            free, window, o[0] + away * east, o[1] + away * north, o[2] + away * up
        ):
            return False
    return True
