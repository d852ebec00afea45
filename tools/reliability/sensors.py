"""A LiDAR whose beams never lie twice in the same directions, for flights of the study."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.base.frames import FloatArray
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import BoolArray, State
from clearway.obstacles.world import World
from clearway.sensors import BeamPattern, Lidar, LidarSensor, Mounting, Scan
from clearway.sensors.beams.simulate import simulate_scan
from clearway.sensors.cells.detection import Detection, DetectionRule
from clearway.sensors.cells.placing import Ground
from clearway.sensors.range_sensor import Pose
from clearway.sensors.standing import Standing

GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
"""Shares of it never repeat, and fill a beam spacing evenly."""
PATTERNS = 32
"""After so many scans the first pattern comes again: none of a place is kept for so long."""
SCAN_S = 0.1
"""Between two scans; slower scans skip patterns."""


@dataclass(frozen=True, eq=False)
class NonRepeatingLidar:
    """A field of beams that is shifted by another share of the beam spacing at every scan."""

    lidars: tuple[Lidar, ...]
    all_round: bool = True

    @classmethod
    def of(
        cls, field_deg: tuple[float, float], spacing_deg: float, range_m: float, sigma_m: float
    ) -> NonRepeatingLidar:
        """Beams all over a field about straight ahead, in squares."""
        width, height = field_deg
        lidars = []
        for k in range(PATTERNS):
            shift = np.array([k * GOLDEN % 1.0, k * GOLDEN**2 % 1.0])
            azimuth, elevation = (
                np.radians(spacing_deg * (np.arange(round(size / spacing_deg)) + by) - 0.5 * size)
                for size, by in zip((width, height), shift, strict=True)
            )
            pattern = BeamPattern.from_angles(
                azimuth, elevation, name="non-repeating", max_range_m=range_m
            )
            lidars.append(Lidar("lidar", pattern, mounting=Mounting(), sigma_m=sigma_m))
        return cls(tuple(lidars))

    @property
    def name(self) -> str:
        return self.lidars[0].name

    @property
    def standing(self) -> Standing:
        return self.lidars[0].standing

    @property
    def sigma_m(self) -> float:
        return self.lidars[0].sigma_m

    def _at(self, time_s: float) -> Lidar:
        return self.lidars[round(time_s / SCAN_S) % PATTERNS]

    def scan(self, world: World, state: State, rng: np.random.Generator) -> Scan:
        return simulate_scan(self._at(state.time_s), world, state, rng)

    def detect(
        self,
        grid: AvoidanceGrid,
        scan: Scan,
        *,
        grid_from_body: Pose | None = None,
        rule: DetectionRule = "ratio",
        ground: Ground | None = None,
    ) -> Detection:
        sensor = LidarSensor(self._at(scan.time_s))
        return sensor.detect(grid, scan, grid_from_body=grid_from_body, rule=rule, ground=ground)

    def returns(
        self, scan: Scan, state: State, reach_m: float, ground_m: float
    ) -> tuple[FloatArray, FloatArray]:
        return LidarSensor(self._at(scan.time_s)).returns(scan, state, reach_m, ground_m)

    def passes(
        self,
        scan: Scan,
        state: State,
        position_m: FloatArray,
        radius_m: FloatArray,
        tolerance_m: float,
    ) -> BoolArray:
        sensor = LidarSensor(self._at(scan.time_s))
        return sensor.passes(scan, state, position_m, radius_m, tolerance_m)
