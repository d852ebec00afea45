"""Space that was seen to be free, remembered as one flies: voxels that beams crossed, range views.

What stands somewhere and what is known to be free there are two things: between them lies
unobserved space. A vehicle that cannot stop is safe only on ways through space that is known to be
free (the free spaces of section 3.5), so whatever is not marked here counts as occupied.

A beam clears what lies before its return, and a beam without return as far as the sensor would
have seen the darkest target; none clears anything from where the smallest object may hide between
beams. A place is free if all beams about it go on: one return that got lost among others clears
nothing behind it, nor does one whose way through the sensor's blind range is unobserved. Where
obstacles are declared to be columns, a beam clears what lies above and below it too.

Each scan becomes a range view; the latest and keyframes are asked. Voxels are their index: they
note where all beams about their middle went on, for as long as the window holds them. What sensors
of one's own say passes, and what lies above and below a level plane, is known by whole voxels
alone.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clearway.base.brief import one_line
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray, State
from clearway.sensors.beams.lidar import Lidar, Scan
from clearway.sensors.observed.blind_range import hide_unheard
from clearway.sensors.observed.column_marking import mark_columns
from clearway.sensors.observed.free_marking import (
    COLUMNS,
    ROLL_WITHIN,
    ROWS,
    WITHIN,
    mark,
)
from clearway.sensors.observed.free_voxels import (
    HALF_DIAGONAL,
    NO_BOX,
    NO_VOXELS,
    ONE,
    WORD,
    Voxels,
)
from clearway.sensors.observed.kept_views import KeptViews
from clearway.sensors.observed.seen_space import SeenSpace
from clearway.sensors.observed.view_shape import view_shape
from clearway.sensors.passing.passed_points import Sensor, sensor_at
from clearway.sensors.range_sensor import LidarSensor, RangeSensor, find_passed

SHAPE = (COLUMNS, COLUMNS, ROWS)
MOST_ASKED = 20_000
MOST_STEPS = 48
"""Voxels that a sensor of one's own is asked about at a sweep, and steps to the farthest one."""
KEYFRAMES = 64
"""Views that are kept beside the latest."""
APART_M = 0.5
APART_OF_REACH = 1.0 / 80.0
"""Keyframes stand so far apart at least, or that share of the reach."""


class FreeSpace:
    """Seen space that moves with the vehicle; what lies far behind is forgotten.

    voxel_m: width of a voxel. start_m [3], start_free_m: a ball of the world that the mission
    declares free, since nobody can look at where the vehicle stands. reach_m: farther away nothing
    is free. complete_m [2, 3]: lowest and highest corner of the box in which a map shows all that
    stands: there nothing needs to be seen. span_m: lowest and highest height between which whatever
    stands reaches through all heights; None where nothing is declared. smallest_m: thickness of the
    smallest object, which must not hide between beams; 0 where nothing is promised of what is
    thinner than beams are apart. finds_all: balls narrower than a voxel count as free wherever a
    view shows them; else only where a voxel's middle was seen too, which is quick to tell for
    vehicles that look up thousands of places at a decision.

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
        smallest_m: float = 0.0,
        finds_all: bool = False,
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
        self._whole: Voxels = NO_VOXELS
        self._smallest_m, self._finds_all = smallest_m, finds_all
        self._kept = KeptViews(KEYFRAMES, max(APART_M, APART_OF_REACH * self.reach_m))
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
                    [HALF_DIAGONAL * self._voxel_m if self._finds_all else 0.0],
                ]
            )
            self._seen = SeenSpace(self._free, window, self._kept.views, self._whole)
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
        """All that was seen; after the own position has jumped, nobody knows where that lies."""
        self._free[:] = 0
        self._whole = NO_VOXELS
        self._kept.forget()
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
        """Take in what a sweep shows to be free; of sensors of one's own, what they say passes.

        state: of the vehicle at the time of the sweep. tolerance_m: how far short of a return it
        ends.
        """
        self._follow(state.position_m)
        if isinstance(sensor, LidarSensor):
            self._take_sweep(sensor.lidar, scan, state, tolerance_m)
        else:
            self._take_passes(sensor, scan, state, tolerance_m)

    def correct(self, lidar: Lidar, scan: Scan, state: State, tolerance_m: float = 0.0) -> None:
        """Take the latest sweep of a LiDAR once more, as it is known by now."""
        if lidar.name in self._kept.latest:
            self._take_sweep(lidar, scan, state, tolerance_m, again=True)

    def _take_sweep(
        self, lidar: Lidar, scan: Scan, state: State, tolerance_m: float, *, again: bool = False
    ) -> None:
        shape = view_shape(lidar.pattern)
        sensor = sensor_at(lidar, state, 0.0)
        if scan.blind_m is not None:
            sensor = sensor._replace(min_range=scan.blind_m)
        reach_m = min(self.reach_m, lidar.clears_to_m, self._fine_to_m(shape.gap_rad))
        # Nobody knows how high beams passed that may be tilted: only columns are marked by them.
        limits_m = float(sensor.min_range), 0.0 if scan.tilt_rad else reach_m
        short_m = tolerance_m + 3.0 * lidar.sigma_m
        slot, image = self._kept.take(lidar, scan, sensor, limits_m, short_m, again=again)
        if sensor.min_range > 0.0:
            hide_unheard(image, shape.numbers, shape.directions, sensor, self._for_blind(sensor))
        self._kept.finish(lidar, slot)
        self._seen = None
        window, view = (self._free, self._low, self._voxel_m), (self._kept.views, slot)
        if not scan.tilt_rad:
            mark(*window, reach_m, *view)
        if self._span_m is not None:
            heights = self._span_m + np.array([tolerance_m, -tolerance_m])
            sines, window = shape.beam_sines, (self._whole_voxels(), *window[1:])
            mark_columns(*window, sines, sensor, reach_m, *view, heights, scan.tilt_rad)
            self._free |= self._whole

    def _whole_voxels(self) -> Voxels:
        """Voxels known to be free from end to end, once there are any."""
        if len(self._whole) == 1:
            self._whole, self._seen = np.zeros_like(self._free), None
        return self._whole

    def _fine_to_m(self, gap_rad: float) -> float:
        """How far beams lie so near to each other that the smallest object cannot hide."""
        return 0.5 * self._smallest_m / math.sin(gap_rad) if self._smallest_m > 0.0 else math.inf

    def _for_blind(self, sensor: Sensor) -> SeenSpace:
        """What a blind sensor knew before: as it is now, and the ball about the start as it was
        declared, whatever has been seen in it since. Where all was forgotten, what stands in blind
        range counts as free until the sensor has left it: else it would never see again."""
        if self._declared is None:
            self._declared = sensor.origin, sensor.min_range + 2.0 * self._voxel_m
        window = self.seen.window.copy()
        window[4:7], window[7] = self._declared
        return self.seen._replace(window=window)

    def _take_passes(
        self, sensor: RangeSensor, scan: Scan, state: State, tolerance_m: float
    ) -> None:
        about = np.floor(state.position_m / self._voxel_m).astype(np.int64) + self._nearby
        about = about[np.all((about >= self._low) & (about < self._low + SHAPE), axis=1)]
        a, b, c = about.T & np.array([[COLUMNS - 1], [COLUMNS - 1], [ROWS - 1]])
        word, bit = c // WORD, ONE << (c % WORD).astype(np.uint64)
        whole = self._whole_voxels()
        unseen = np.flatnonzero(whole[a, b, word] & bit == 0)[:MOST_ASKED]
        half = np.full(len(unseen), HALF_DIAGONAL * self._voxel_m)
        beyond = self._voxel_m + tolerance_m + 3.0 * sensor.sigma_m
        places = np.asarray((about[unseen] + 0.5) * self._voxel_m, dtype=np.float64)
        passed = unseen[find_passed(sensor, scan, state, places, half, beyond)]
        for voxels in (whole, self._free):
            np.bitwise_or.at(voxels, (a[passed], b[passed], word[passed]), bit[passed])

    @cached_property
    def _nearby(self) -> IntArray:
        """[n, 3] steps to the voxels within reach, the nearest first, and no more than can be."""
        most = min(int(self.reach_m / self._voxel_m), MOST_STEPS)
        ticks = np.arange(-most, most + 1)
        ball = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
        squared = np.einsum("ij,ij->i", ball, ball)
        nearest = np.argsort(squared, kind="stable")
        return np.asarray(ball[nearest[: np.count_nonzero(squared <= most**2)]], dtype=np.int64)

    @property
    def _both(self) -> list[Voxels]:
        return [self._free] if len(self._whole) == 1 else [self._free, self._whole]

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
                for voxels in self._both:
                    voxels &= ~words
            else:
                for voxels in self._both:
                    voxels[(cleared,) if axis == 0 else (slice(None), cleared)] = 0
            low[axis] = wanted[axis]
        self._low, self._seen = low, None
