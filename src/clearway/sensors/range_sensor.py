"""The interface of range sensors: whatever answers these questions takes part in decisions.

A reading is a `Scan`: points in the sensor frame, a time, the sensor's name. Of a reading clearway
wants to know what it says of the cells, where its returns are and how far each may be off, and
which places it shows to be empty. `LidarSensor` answers for a `Lidar`; docs/sensors.md has a radar.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from clearway.base.checks import check_points, kind_of
from clearway.base.compiled import read_only
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray, State
from clearway.sensors.beams.lidar import Lidar, Scan
from clearway.sensors.beams.raster import beam_raster, nearest_returns
from clearway.sensors.cells.detection import Detection, DetectionRule, detect
from clearway.sensors.cells.placing import Ground
from clearway.sensors.memory.point_memory import (
    NONE_HIDING,
    PointMemory,
    remember,
    update_memory,
)
from clearway.sensors.memory.remembered import Pitch
from clearway.sensors.memory.swept_boxes import boxes_of_returns
from clearway.sensors.memory.uncertain import radii_unsure, turn_by_doubt
from clearway.sensors.passing.passed_points import find_passed_through, returns_in_world, sensor_at
from clearway.sensors.standing import Standing

Pose = tuple[FloatArray, FloatArray]
"""Rotation [3, 3] and translation [3]."""


@runtime_checkable
class RangeSensor(Protocol):
    """What clearway asks of a sensor that measures where things are."""

    @property
    def name(self) -> str:
        """Readings carry it; differs from sensor to sensor."""
        ...

    @property
    def standing(self) -> Standing:
        """Precision, and trust at the start."""
        ...

    @property
    def sigma_m(self) -> float:
        """Standard deviation of the range."""
        ...

    def detect(
        self,
        grid: AvoidanceGrid,
        scan: Scan,
        *,
        grid_from_body: Pose | None = None,
        rule: DetectionRule = "ratio",
        ground: Ground | None = None,
    ) -> Detection:
        """What a reading says of every cell: P_OD, P_V, and how many beams look.

        grid_from_body: where the body has moved since the reading.
        """
        ...

    def returns(
        self, scan: Scan, state: State, reach_m: float, ground_m: float
    ) -> tuple[FloatArray, FloatArray]:
        """Returns [n, 3] in the world frame, and radii [n] of the balls that they stand for.

        state: of the vehicle at the time of the reading. Returns from farther away than `reach_m`,
        at or below the height `ground_m`, and those from the own airframe are left out. A radius
        covers what lies between the beams, and what is not sure about the direction; what is not
        sure about the range is added from `sigma_m`.
        """
        ...

    def passes(
        self,
        scan: Scan,
        state: State,
        position_m: FloatArray,
        radius_m: FloatArray,
        tolerance_m: float,
    ) -> BoolArray:
        """[n] whether the reading shows that nothing is at balls in the world frame.

        Only where all that looks into the direction goes on for `tolerance_m` behind the centre,
        densely enough to meet a ball of that size. Of a scan without returns: wherever it looks so.
        """
        ...


@dataclass(frozen=True, slots=True)
class LidarSensor:
    """A `Lidar` as a range sensor."""

    lidar: Lidar

    @property
    def name(self) -> str:
        return self.lidar.name

    @property
    def standing(self) -> Standing:
        return self.lidar.standing

    @property
    def sigma_m(self) -> float:
        return self.lidar.sigma_m

    def detect(
        self,
        grid: AvoidanceGrid,
        scan: Scan,
        *,
        grid_from_body: Pose | None = None,
        rule: DetectionRule = "ratio",
        ground: Ground | None = None,
    ) -> Detection:
        return detect(
            grid, self.lidar, scan, grid_from_body=grid_from_body, rule=rule, ground=ground
        )

    def returns(
        self, scan: Scan, state: State, reach_m: float, ground_m: float
    ) -> tuple[FloatArray, FloatArray]:
        sensor = sensor_at(self.lidar, state, 0.0)
        return returns_in_world(scan.points_m, sensor, float(reach_m), float(ground_m))

    def passes(
        self,
        scan: Scan,
        state: State,
        position_m: FloatArray,
        radius_m: FloatArray,
        tolerance_m: float,
    ) -> BoolArray:
        raster = beam_raster(self.lidar.pattern)
        return find_passed_through(
            read_only(position_m),
            read_only(radius_m),
            nearest_returns(scan.points_m, raster),
            sensor_at(self.lidar, state, tolerance_m),
            raster,
        )


AnySensor = Lidar | RangeSensor


def range_sensors(sensors: Sequence[AnySensor]) -> dict[str, RangeSensor]:
    """Sensors by name, in their order; raises ClearwayError where two have the same."""
    if not np.iterable(sensors):
        raise ClearwayError(f"sensors: a sequence is needed, got {type(sensors).__name__}")
    for sensor in sensors:
        if not isinstance(getattr(sensor, "name", None), str):
            kind_of("sensors", sensor, Lidar)
    names = Counter(sensor.name for sensor in sensors)
    shared = [name for name, times in names.items() if times > 1]
    if shared:
        raise ClearwayError(f"sensors: each needs a name of its own, {shared[0]!r} is there twice")
    return {
        sensor.name: LidarSensor(sensor) if isinstance(sensor, Lidar) else sensor
        for sensor in sensors
    }


def find_returns(
    sensor: RangeSensor, scan: Scan, state: State, reach_m: float, ground_m: float
) -> tuple[FloatArray, FloatArray]:
    """What `RangeSensor.returns` answers, of one kind for compiled loops, whatever it is made of.

    Raises ClearwayError naming the sensor where that is not places [n, 3] and radii [n].
    """
    points, radii = sensor.returns(scan, state, reach_m, ground_m)
    places = check_points(f"sensor {sensor.name}: places that it returns", points)
    return read_only(places), read_only(_answer(sensor, "radii", radii, len(places), np.float64))


def find_passed(
    sensor: RangeSensor,
    scan: Scan,
    state: State,
    position_m: FloatArray,
    radius_m: FloatArray,
    tolerance_m: float,
) -> BoolArray:
    """What `RangeSensor.passes` answers; ClearwayError where that is not a yes or no each."""
    passed = sensor.passes(scan, state, position_m, radius_m, tolerance_m)
    return _answer(sensor, "what it passes", passed, len(position_m), np.bool_)


def _answer(
    sensor: RangeSensor, what: str, given: npt.ArrayLike, count: int, dtype: npt.DTypeLike
) -> npt.NDArray[Any]:
    """[count] what a sensor says of each."""
    try:
        each = np.asarray(given).astype(dtype, copy=False)
    except (TypeError, ValueError) as cause:
        raise ClearwayError(f"sensor {sensor.name}: {what}: {cause}") from cause
    if each.shape != (count,):
        raise ClearwayError(
            f"sensor {sensor.name}: {what}: must have shape [{count}], got {list(each.shape)}"
        )
    return each


def remember_reading(
    memory: PointMemory,
    sensor: RangeSensor,
    scan: Scan,
    state: State,
    *,
    tolerance_m: float = 0.0,
    angle_rad: float = 0.0,
    ground_m: float = -np.inf,
    hiding_m: FloatArray = NONE_HIDING,
) -> PointMemory:
    """Memory of one sensor after a reading; see `update_memory`, which does it for a `Lidar`."""
    if isinstance(sensor, LidarSensor):
        return update_memory(
            memory,
            sensor.lidar,
            scan,
            state,
            tolerance_m=tolerance_m,
            angle_rad=angle_rad,
            ground_m=ground_m,
            hiding_m=hiding_m,
        )
    noise = tolerance_m + 3.0 * sensor.sigma_m
    tolerance = noise + 0.5 * memory.voxel_m
    points, radii = find_returns(sensor, scan, state, memory.reach_m, ground_m)
    passed = np.all(
        [
            find_passed(sensor, scan, turned, memory.position_m, memory.radius_m, tolerance)
            for turned in turn_by_doubt(state, angle_rad)
        ],
        axis=0,
    )
    return remember(
        memory,
        boxes_of_returns(
            points,
            read_only(radii_unsure(points, radii, state, angle_rad)),
            # It answers for itself whether it would meet a ball of that size.
            2.0 * radii,
            state.position_m,
            Pitch(memory.voxel_m, memory.fine_m),
            float(scan.time_s),
        ),
        memory.boxes.doubt + np.asarray(passed, dtype=np.float64) / memory.passes_to_clear,
        state.position_m,
        float(scan.time_s),
        noise,
    )
