"""Space that was seen to be free: voxels of the world that beams crossed, remembered as one flies.

What stands somewhere and what is known to be free there are two things: between them lies what
nobody has looked at. A vehicle that cannot stop is safe only on ways through space that is known to
be free (the free spaces of section 3.5), so whatever is not marked here counts as occupied.

A beam clears what it crosses up to one voxel before the nearest return around its direction, and a
beam without return as far as the sensor would have seen the darkest target: one return that got
lost among others clears nothing behind it, nor does one whose way through the sensor's blind range
nobody has seen. Where obstacles are declared to be columns, a beam clears what lies above and below
it too.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clearway.base.brief import one_line
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray, State
from clearway.sensors.beams.lidar import Lidar, Scan
from clearway.sensors.beams.pattern import BeamPattern
from clearway.sensors.beams.raster import BeamRaster, beam_raster, nearest_returns
from clearway.sensors.observed.blind_range import heard_of
from clearway.sensors.observed.column_marking import mark_columns
from clearway.sensors.observed.free_marking import (
    COLUMNS,
    ROLL_WITHIN,
    ROWS,
    WITHIN,
    BeamField,
    field_of,
    mark,
)
from clearway.sensors.observed.seen_space import NO_BOX, ONE, WORD, SeenSpace, Voxels
from clearway.sensors.passing.passed_points import Sensor, sensor_at
from clearway.sensors.range_sensor import LidarSensor, RangeSensor, passed_by

SHAPE = (COLUMNS, COLUMNS, ROWS)
MOST_ASKED, MOST_STEPS = 20_000, 48
"""Voxels that a sensor of one's own is asked about at a sweep, and steps to the farthest one."""
FINE = 0.7
"""Of a voxel at the farthest place marked, that bins of directions are wide at least."""


class FreeSpace:
    """Seen space that moves with the vehicle; what lies far behind is forgotten.

    voxel_m: width of a voxel. start_m [3], start_free_m: a ball of the world that the mission
    declares free, since nobody can look at where the vehicle stands. reach_m: farther away nothing
    is marked. complete_m [2, 3]: lowest and highest corner of the box in which a map shows all that
    stands: there nothing needs to be seen. span_m: lowest and highest height between which whatever
    stands reaches through all heights; None where nothing is declared.

    Raises ClearwayError for a voxel that is no positive number.
    """

    def __init__(
        self,
        voxel_m: float,
        start_m: npt.ArrayLike,
        start_free_m: float = 0.0,
        *,
        reach_m: float = np.inf,
        complete_m: FloatArray | None = None,
        span_m: tuple[float, float] | None = None,
    ) -> None:
        if not 0.0 < voxel_m < np.inf:
            raise ClearwayError(f"free space: voxel_m must be above 0, got {voxel_m}")
        self._free: Voxels = np.zeros((COLUMNS, COLUMNS, ROWS // WORD), dtype=np.uint64)
        self._voxel_m = float(voxel_m)
        self._start_m = np.array(start_m, dtype=np.float64)
        self._start_free_m = float(start_free_m)
        self._declared: tuple[FloatArray, float] | None = (self._start_m, float(start_free_m))
        self.reach_m = min(float(reach_m), WITHIN * COLUMNS * self._voxel_m)
        """How far from the vehicle anything is marked."""
        self._complete_m = NO_BOX if complete_m is None else complete_m
        self._span_m = None if span_m is None else np.array(span_m, dtype=np.float64)
        self._low = self._lowest(self._start_m)
        self._looks: dict[str, tuple[BeamPattern, tuple[BeamRaster, BeamField]]] = {}
        self._seen: SeenSpace | None = None  # Until the window moves, or the ball is withdrawn.

    def __repr__(self) -> str:
        count = int(np.unpackbits(self._free.view(np.uint8)).sum())
        return one_line("FreeSpace", (f"{count:,} voxels of {self._voxel_m:g} m seen free",))

    @property
    def seen(self) -> SeenSpace:
        """As it is now; later sweeps change it."""
        if self._seen is None:
            window = np.concatenate(
                [
                    self._low,
                    [1.0 / self._voxel_m],
                    self._start_m,
                    [self._start_free_m],
                    self._complete_m.ravel(),
                ]
            )
            self._seen = SeenSpace(self._free, window)
        return self._seen

    @property
    def start(self) -> tuple[FloatArray, float]:
        """Middle [3] and radius of the ball that still counts as declared free."""
        return self._start_m, self._start_free_m

    def begin_at(self, start_m: FloatArray, start_free_m: float) -> None:
        """Declare a ball about another place free, in place of the one about the start."""
        self._start_m, self._start_free_m = start_m, start_free_m
        self._declared, self._seen = (start_m, start_free_m), None

    def forget(self) -> None:
        """All that was seen; after the own place has jumped, nobody knows where that lies."""
        self._free[:] = 0
        self._start_free_m = 0.0
        self._declared = self._seen = None

    def withdraw_start(self, position_m: FloatArray, radius_m: FloatArray) -> None:
        """Declare the ball about the start no larger than returns [n, 3] leave it."""
        if self._start_free_m > 0.0 and len(position_m):
            away = np.linalg.norm(position_m - self._start_m, axis=1) - radius_m
            left_m = float(np.clip(away.min(), 0.0, self._start_free_m))
            if left_m < self._start_free_m:
                self._start_free_m, self._seen = left_m, None

    def take(self, sensor: RangeSensor, scan: Scan, state: State, tolerance_m: float = 0.0) -> None:
        """Mark what a sweep shows to be free; of sensors that are no LiDAR, what they say passes.

        state: of the vehicle at the time of the sweep. tolerance_m: how far short of a return,
        beside a voxel, it ends.
        """
        self._follow(state.position_m)
        if isinstance(sensor, LidarSensor):
            self._take_sweep(sensor.lidar, scan, state, tolerance_m)
        else:
            self._take_passes(sensor, scan, state, tolerance_m)

    def _take_sweep(self, lidar: Lidar, scan: Scan, state: State, tolerance_m: float) -> None:
        (raster, field), sensor = self._looks_of(lidar), sensor_at(lidar, state, 0.0)
        if scan.blind_m is not None:
            sensor = sensor._replace(min_range=scan.blind_m)
        nearest = nearest_returns(scan.points_m, raster)
        if sensor.min_range > 0.0:
            free, window = self._for_blind(sensor)
            nearest = heard_of(nearest, raster, sensor, free, window)
        reach_m = min(self.reach_m, lidar.clears_to_m)
        short_m = self._voxel_m + tolerance_m + 3.0 * lidar.sigma_m
        known = (self._free, self._low, self._voxel_m, raster, field, nearest, sensor)
        if not scan.tilt_rad:  # Else nobody knows how high its beams passed.
            mark(*known, reach_m, short_m)
        if self._span_m is not None:
            heights = self._span_m + np.array([tolerance_m, -tolerance_m])
            mark_columns(*known, reach_m, short_m, heights, scan.tilt_rad)

    def _for_blind(self, sensor: Sensor) -> SeenSpace:
        """What a blind sensor knew before: as it is now, and the ball about the start as it was
        declared, whatever has been seen in it since. Where all was forgotten, what stands in blind
        range counts as free until the sensor has left it: else it would never see again."""
        if self._declared is None:
            self._declared = sensor.origin, sensor.min_range + 2.0 * self._voxel_m
        window = self.seen.window.copy()
        window[4:7], window[7] = self._declared
        return SeenSpace(self._free, window)

    def _take_passes(
        self, sensor: RangeSensor, scan: Scan, state: State, tolerance_m: float
    ) -> None:
        voxels = np.floor(state.position_m / self._voxel_m).astype(np.int64) + self._nearby
        voxels = voxels[np.all((voxels >= self._low) & (voxels < self._low + SHAPE), axis=1)]
        a, b, c = voxels.T & np.array([[COLUMNS - 1], [COLUMNS - 1], [ROWS - 1]])
        word, bit = c // WORD, ONE << (c % WORD).astype(np.uint64)
        unseen = np.flatnonzero(self._free[a, b, word] & bit == 0)[:MOST_ASKED]
        half = np.full(len(unseen), 0.5 * self._voxel_m)
        beyond = self._voxel_m + tolerance_m + 3.0 * sensor.sigma_m
        places = np.asarray((voxels[unseen] + 0.5) * self._voxel_m, dtype=np.float64)
        passed = unseen[passed_by(sensor, scan, state, places, half, beyond)]
        np.bitwise_or.at(self._free, (a[passed], b[passed], word[passed]), bit[passed])

    @cached_property
    def _nearby(self) -> IntArray:
        """[n, 3] steps to the voxels within reach, the nearest first, and no more than can be."""
        most = min(int(self.reach_m / self._voxel_m), MOST_STEPS)
        ticks = np.arange(-most, most + 1)
        ball = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
        squared = np.einsum("ij,ij->i", ball, ball)
        nearest = np.argsort(squared, kind="stable")
        return np.asarray(ball[nearest[: np.count_nonzero(squared <= most**2)]], dtype=np.int64)

    def _looks_of(self, lidar: Lidar) -> tuple[BeamRaster, BeamField]:
        """Where its beams look, in directions no finer than voxels are at their farthest."""
        known = self._looks.get(lidar.name)
        if known is None or known[0] is not lidar.pattern:
            reach_m = min(self.reach_m, lidar.clears_to_m)
            widest = max(lidar.pattern.spacing_rad, FINE * self._voxel_m / reach_m)
            raster = beam_raster(replace(lidar.pattern, spacing_rad=widest))
            known = self._looks[lidar.name] = lidar.pattern, (raster, field_of(raster))
        return known[1]

    def _lowest(self, position_m: FloatArray) -> IntArray:
        middle = np.floor(position_m / self._voxel_m).astype(np.int64)
        return np.asarray(middle - np.array(SHAPE) // 2, dtype=np.int64)

    def _is_about(self, position_m: FloatArray) -> bool:
        """Whether the window need not follow to a place."""
        for at, low, count in zip(position_m.tolist(), self._low.tolist(), SHAPE, strict=True):
            if abs(math.floor(at / self._voxel_m) - count // 2 - low) > count // ROLL_WITHIN:
                return False
        return True

    def _follow(self, position_m: FloatArray) -> None:
        """Let the window follow the vehicle, and clear what comes into it."""
        if self._is_about(position_m):
            return
        wanted = self._lowest(position_m)
        low = self._low.copy()
        for axis, count in enumerate(SHAPE):
            moved = int(wanted[axis] - low[axis])
            if abs(moved) <= count // ROLL_WITHIN:
                continue
            fresh = (
                np.arange(low[axis] + count, wanted[axis] + count)
                if moved > 0
                else np.arange(wanted[axis], low[axis])
            )
            cleared = np.unique(fresh[-count:] & (count - 1))
            if axis == 2:
                words = np.zeros(ROWS // WORD, dtype=np.uint64)
                np.bitwise_or.at(words, cleared // WORD, ONE << (cleared % WORD).astype(np.uint64))
                self._free &= ~words
            else:
                self._free[(cleared,) if axis == 0 else (slice(None), cleared)] = 0
            low[axis] = wanted[axis]
        self._low, self._seen = low, None
