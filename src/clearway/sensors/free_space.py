"""Space that was seen to be free: voxels of the world that beams crossed, remembered as one flies.

What stands somewhere and what is known to be free there are two things: between them lies what
nobody has looked at. A vehicle that cannot stop is safe only on ways through space that is known to
be free (the free spaces of section 3.5), so whatever is not marked here counts as occupied.

A beam clears what it crosses up to one voxel before the nearest return around its direction, and a
beam without return as far as the sensor would have seen the darkest target: one return that got
lost among others clears nothing behind it, nor does one whose way through the sensor's blind range
nobody has seen.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clearway.base.brief import one_line
from clearway.base.compiled import borrowing, compiled
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.state import IntArray, State
from clearway.sensors.beams import BeamPattern
from clearway.sensors.binning import TINY
from clearway.sensors.blind_range import heard_of
from clearway.sensors.lidar import Lidar, Scan
from clearway.sensors.passing import BeamRaster, Sensor, beam_raster, nearest_returns, sensor_at
from clearway.sensors.range_sensor import LidarSensor, RangeSensor
from clearway.sensors.seen_space import NO_BOX, ONE, WORD, SeenSpace, Voxels, bits_from

COLUMNS, ROWS = 256, 128
"""Voxels of the window along each horizontal axis, and along the vertical: powers of two."""
SHAPE = (COLUMNS, COLUMNS, ROWS)
ROLL_WITHIN = 8
"""The window follows once the vehicle is off its middle by this part of its width."""
MOST_ASKED, MOST_STEPS = 20_000, 48
"""Voxels that a sensor of one's own is asked about at a sweep, and steps to the farthest one."""
FINE = 0.7
"""Of a voxel at the farthest place marked, that bins of directions are wide at least."""
WITHIN = 0.5 - 1.0 / ROLL_WITHIN
"""Part of the window's width that is always there on either side of the vehicle."""


class FreeSpace:
    """Seen space that moves with the vehicle; what lies far behind is forgotten.

    voxel_m: width of a voxel. start_m [3], start_free_m: a ball of the world that the mission
    declares free, since nobody can look at where the vehicle stands. reach_m: farther away nothing
    is marked. complete_m [2, 3]: lowest and highest corner of the box in which a map shows all that
    stands: there nothing needs to be seen. Raises ClearwayError for a voxel that is no positive
    number.
    """

    def __init__(
        self,
        voxel_m: float,
        start_m: npt.ArrayLike,
        start_free_m: float = 0.0,
        *,
        reach_m: float = np.inf,
        complete_m: FloatArray | None = None,
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
        self._low = self._lowest(self._start_m)
        self._patterns: dict[str, tuple[BeamPattern, BeamPattern]] = {}

    def __repr__(self) -> str:
        count = int(np.unpackbits(self._free.view(np.uint8)).sum())
        return one_line("FreeSpace", (f"{count:,} voxels of {self._voxel_m:g} m seen free",))

    @property
    def seen(self) -> SeenSpace:
        """As it is now; later sweeps change it."""
        window = np.concatenate(
            [
                self._low,
                [1.0 / self._voxel_m],
                self._start_m,
                [self._start_free_m],
                self._complete_m.ravel(),
            ]
        )
        return SeenSpace(self._free, window)

    @property
    def start(self) -> tuple[FloatArray, float]:
        """Middle [3] and radius of the ball that still counts as declared free."""
        return self._start_m, self._start_free_m

    def forget(self) -> None:
        """All that was seen; after the own place has jumped, nobody knows where that lies."""
        self._free[:] = 0
        self._start_free_m = 0.0
        self._declared = None

    def withdraw_start(self, position_m: FloatArray, radius_m: FloatArray) -> None:
        """Declare the ball about the start no larger than returns [n, 3] leave it."""
        if self._start_free_m > 0.0 and len(position_m):
            away = np.linalg.norm(position_m - self._start_m, axis=1) - radius_m
            self._start_free_m = float(np.clip(away.min(), 0.0, self._start_free_m))

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
        raster, sensor = beam_raster(self._pattern(lidar)), sensor_at(lidar, state, 0.0)
        nearest = nearest_returns(scan.points_m, raster)
        if sensor.min_range > 0.0:
            free, window = self._for_blind(sensor)
            nearest = heard_of(nearest, raster, sensor, free, window)
        _mark(
            self._free,
            self._low,
            self._voxel_m,
            raster,
            nearest,
            sensor,
            min(self.reach_m, lidar.clears_to_m),
            self._voxel_m + tolerance_m + 3.0 * lidar.sigma_m,
        )

    def _for_blind(self, sensor: Sensor) -> SeenSpace:
        """What a blind sensor knew before: as it is now, and the ball about the start as it was
        declared, whatever has been seen in it since. Where all was forgotten, what stands in blind
        range counts as free until the sensor has left it: else it would never see again."""
        if self._declared is None:
            self._declared = sensor.origin, sensor.min_range + 2.0 * self._voxel_m
        window = self.seen.window
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
        passed = unseen[sensor.passes(scan, state, places, half, beyond)]
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

    def _pattern(self, lidar: Lidar) -> BeamPattern:
        """The beams, in directions no finer than voxels are at their farthest."""
        known = self._patterns.get(lidar.name)
        if known is None or known[0] is not lidar.pattern:
            reach_m = min(self.reach_m, lidar.clears_to_m)
            widest = max(lidar.pattern.spacing_rad, FINE * self._voxel_m / reach_m)
            known = (lidar.pattern, replace(lidar.pattern, spacing_rad=widest))
            self._patterns[lidar.name] = known
        return known[1]

    def _lowest(self, position_m: FloatArray) -> IntArray:
        middle = np.floor(position_m / self._voxel_m).astype(np.int64)
        return np.asarray(middle - np.array(SHAPE) // 2, dtype=np.int64)

    def _follow(self, position_m: FloatArray) -> None:
        """Let the window follow the vehicle, and clear what comes into it."""
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
        self._low = low


@compiled
def _nearest_around(nearest: FloatArray, raster: BeamRaster) -> FloatArray:
    """[columns, rows] range of the nearest return in a bin and in those around it, as many columns
    as lie within one bin's width there."""
    by_rows, around = nearest.copy(), np.empty(nearest.shape)
    windows = np.empty(nearest.shape[1], dtype=np.int64)
    _take_nearest(nearest, raster.bottom, raster.per_row, by_rows, windows, around)
    return around


@borrowing
def _take_nearest(
    nearest: FloatArray,
    bottom: float,
    per_row: float,
    by_rows: FloatArray,
    windows: IntArray,
    around: FloatArray,
) -> None:
    """Fill in `_nearest_around`, by the nearest of three rows and by columns to either side."""
    columns, rows = nearest.shape
    widest = 0
    for j in range(columns):
        for k in range(1, rows):
            by_rows[j, k] = min(nearest[j, k], nearest[j, k - 1])
        for k in range(rows - 1):
            by_rows[j, k] = min(by_rows[j, k], nearest[j, k + 1])
    for k in range(rows):
        sine = min(1.0, abs(bottom + (k + 0.5) / per_row))
        cosine = np.sqrt(1.0 - sine * sine)
        windows[k] = 8 if cosine * 8.0 < 1.0 else int(np.ceil(1.0 / cosine))
        widest = max(widest, windows[k])
    for j in range(columns):
        for k in range(rows):
            around[j, k] = by_rows[j, k]
        for shift in range(-widest, widest + 1):
            beside = (j + shift) % columns
            for k in range(rows):
                near = by_rows[beside, k] if abs(shift) <= windows[k] else np.inf
                around[j, k] = min(around[j, k], near)


@compiled
def _mark(
    free: Voxels,
    low: IntArray,
    voxel: float,
    raster: BeamRaster,
    nearest: FloatArray,
    sensor: Sensor,
    reach: float,
    short: float,
) -> None:
    """Mark the voxels that a sweep saw: those whose middle lies between beams that all go on.

    Between neighbouring beams a voxel counts as crossed: what hides there is thinner than beams
    are apart. What was seen before is passed over.
    """
    _mark_passed(free, low, voxel, raster, _nearest_around(nearest, raster), sensor, reach, short)


@borrowing
def _ends_along(origin: float, far: float, voxel: float) -> tuple[int, int]:
    """First and last voxel within a distance along an axis."""
    return int(np.floor((origin - far) / voxel)), int(np.floor((origin + far) / voxel))


@borrowing
def _mark_passed(
    free: Voxels,
    low: IntArray,
    voxel: float,
    raster: BeamRaster,
    around: FloatArray,
    sensor: Sensor,
    reach: float,
    short: float,
) -> None:
    r, o = sensor.rotation, sensor.origin
    ox, oy, oz = o[0], o[1], o[2]
    first_a, last_a = _ends_along(ox, reach, voxel)
    first_b, last_b = _ends_along(oy, reach, voxel)
    first_c, last_c = _ends_along(oz, min(reach, (WITHIN * ROWS - 1.0) * voxel), voxel)
    # A sensor off the vehicle's middle sees beyond the window: a bit there is one at its other end.
    first_a, last_a = max(first_a, low[0]), min(last_a, low[0] + COLUMNS - 1)
    first_b, last_b = max(first_b, low[1]), min(last_b, low[1] + COLUMNS - 1)
    first_c, last_c = max(first_c, low[2]), min(last_c, low[2] + ROWS - 1)
    near2, far2 = sensor.min_range**2, reach * reach
    lowest, highest, behind = _field_of(raster)
    right, left = _sides(raster)
    below, above = _slopes(lowest, highest, r[2, 2])
    r00, r01, r02 = r[0, 0], r[0, 1], r[0, 2]
    r10, r11, r12 = r[1, 0], r[1, 1], r[1, 2]
    r20, r21, r22 = r[2, 0], r[2, 1], r[2, 2]
    for a in range(first_a, last_a + 1):
        dx = (a + 0.5) * voxel - ox
        for b in range(first_b, last_b + 1):
            dy = (b + 0.5) * voxel - oy
            level2 = dx * dx + dy * dy
            if level2 > far2:
                continue
            x0, z0 = r00 * dx + r10 * dy, r02 * dx + r12 * dy
            y0 = r01 * dx + r11 * dy
            i, j = np.uint64(a & (COLUMNS - 1)), np.uint64(b & (COLUMNS - 1))
            level, tall = np.sqrt(level2), np.sqrt(far2 - level2)
            bottom = max(-tall, below * level) if below > -np.inf else -tall
            top = min(tall, above * level) if above < np.inf else tall
            if not behind:  # Ahead, and between the outermost beams to either side.
                bottom, top = _above_zero(bottom, top, x0, r20, reach)
                if abs(left) < 1.0:
                    aside = left / (1.0 - abs(left))
                    bottom, top = _above_zero(
                        bottom, top, aside * x0 - y0, aside * r20 - r21, reach
                    )
                if abs(right) < 1.0:
                    aside = right / (1.0 - abs(right))
                    bottom, top = _above_zero(
                        bottom, top, y0 - aside * x0, r21 - aside * r20, reach
                    )
                if top < bottom - 2.0 * voxel:
                    continue
            # One voxel more on either side than need be: what decides is asked of each of them.
            c0 = max(first_c, int(np.floor((oz + bottom) / voxel)) - 1)
            c1 = min(last_c, int(np.floor((oz + top) / voxel)) + 1)
            c = c0
            while c <= c1:
                first = c & (ROWS - 1)
                count = min(c1 - c + 1, WORD - (first & (WORD - 1)))
                word, fresh = np.uint64(first // WORD), np.uint64(0)
                missing = bits_from(first, count) & ~free[i, j, word]
                for n in range(count):
                    if missing == 0:
                        break
                    bit = ONE << np.uint64((first & (WORD - 1)) + n)
                    if missing & bit == 0:
                        continue
                    missing ^= bit
                    dz = (c + n + 0.5) * voxel - oz
                    x, squared = x0 + r20 * dz, level2 + dz * dz
                    if squared > far2 or squared < near2 or (x < 0.0 and not behind):
                        continue
                    z, distance = z0 + r22 * dz, np.sqrt(squared)
                    if z < lowest * distance or z > highest * distance:
                        continue
                    y = y0 + r21 * dz
                    aside = abs(x) + abs(y)
                    if not behind and (y < right * aside or y > left * aside):
                        continue
                    if _goes_on(x, y, z, distance, short, around, raster):
                        fresh |= bit
                free[i, j, word] |= fresh
                c += count


@borrowing
def _above_zero(
    bottom: float, top: float, value: float, slope: float, reach: float
) -> tuple[float, float]:
    """The part of an interval in which `value` + `slope` times the place is not below 0; where it
    is so nowhere, one that ends before it begins."""
    if slope > 1e-9:
        return max(bottom, -value / slope), top
    if slope < -1e-9:
        return bottom, min(top, -value / slope)
    return (bottom, top) if value >= -1e-6 * reach else (bottom, -np.inf)


@borrowing
def _slopes(lowest: float, highest: float, upright: float) -> tuple[float, float]:
    """Least and greatest height over level distance that beams reach, from the sines of the lowest
    and highest one and the cosine of the sensor's tilt; infinite where some look straight up."""
    tilt = np.arccos(min(1.0, max(-1.0, upright))) + 1e-6
    low = np.arcsin(min(1.0, max(-1.0, lowest))) - tilt
    high = np.arcsin(min(1.0, max(-1.0, highest))) + tilt
    steep = 0.5 * np.pi - 1e-3
    below = -np.inf if low <= -steep else np.tan(min(low, steep))
    above = np.inf if high >= steep else np.tan(max(high, -steep))
    return below, above


@borrowing
def _field_of(raster: BeamRaster) -> tuple[float, float, bool]:
    """Sines of the lowest and highest beam, and whether any looks behind."""
    lowest, highest, behind = np.inf, -np.inf, False
    columns, rows = raster.low.shape
    for j in range(columns):
        for k in range(rows):
            if raster.low[j, k] < np.inf:
                lowest, highest = min(lowest, raster.low[j, k]), max(highest, raster.high[j, k])
                behind = behind or abs((j + 0.5) / raster.per_column - 2.0) > 1.0
    return lowest, highest, behind


@borrowing
def _sides(raster: BeamRaster) -> tuple[float, float]:
    """Of beams that look ahead, y over |x| + |y| of the rightmost and the leftmost bin's edge."""
    right, left = np.inf, -np.inf
    columns, rows = raster.low.shape
    for j in range(columns):
        for k in range(rows):
            if raster.low[j, k] < np.inf:
                right = min(right, j / raster.per_column - 2.0 - 1e-9)
                left = max(left, (j + 1) / raster.per_column - 2.0 + 1e-9)
    return right, left


@borrowing
def _goes_on(
    x: float,
    y: float,
    z: float,
    distance: float,
    short: float,
    around: FloatArray,
    raster: BeamRaster,
) -> bool:
    """Whether beams lie about a direction, and all of them go on beyond a distance."""
    sine = z / (distance + TINY)
    row = (sine - raster.bottom) * raster.per_row
    if row < 0.0 or row >= around.shape[1]:
        return False
    k = int(row)
    forward = y / (abs(x) + abs(y) + TINY)
    turned = forward if x >= 0.0 else np.copysign(2.0, y) - forward
    column = (turned + 2.0) * raster.per_column
    columns = around.shape[0]
    j = min(int(column), columns - 1)
    if around[j, k] < distance + short or raster.low[j, k] == np.inf:
        return False
    # Beyond the outermost beams of the pattern nobody looks.
    if sine < raster.low[j, k] and (k == 0 or raster.low[j, k - 1] == np.inf):
        return False
    if sine > raster.high[j, k] and (k + 1 == around.shape[1] or raster.low[j, k + 1] == np.inf):
        return False
    beside = (j - 1) % columns if column - j < 0.5 else (j + 1) % columns
    return _has_beams(raster, beside, k)


@borrowing
def _has_beams(raster: BeamRaster, column: int, row: int) -> bool:
    """Whether there are beams in a column at about a row."""
    for k in range(max(row - 1, 0), min(row + 2, raster.low.shape[1])):
        if raster.low[column, k] < np.inf:
            return True
    return False
