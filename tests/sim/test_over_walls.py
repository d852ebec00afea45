"""A copter flies over a wall that is too long to fly round."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare

MISSION = """
[mission]
name = "over"
waypoints_m = [[36, {goal_y}, 1.5]]
[vehicle]
position_m = [0, {start_y}, 1.5]
attitude_deg = [0, 0, {yaw_deg}]
kind = "multirotor"
speed_mps = {speed_mps}
acceleration_mps2 = 5
body_radius_m = 0.2
[grid]
range_m = 40
[safety]
margin_m = 0.4
smallest_object_m = 0.3
[simulation]
time_limit_s = 60
scan_rate_hz = 10
[[lidar]]
name = "rings"
field_deg = [360, 50]
spacing_deg = 1
max_range_m = 40
[[obstacle]]
name = "ground"
shape = "cuboid"
known = "world"
position_m = [0, 0, -0.5]
size_m = [400, 400, 1]
[[obstacle]]
name = "wall"
shape = "cuboid"
known = "world"
position_m = [18, 0, {middle_m}]
size_m = [0.5, 160, {height_m}]
"""


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(2, 20))]
)
def test_a_copter_climbs_over_a_long_wall(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    height_m = rng.uniform(2.0, 3.5)
    path = tmp_path / "over.toml"
    path.write_text(
        MISSION.format(
            start_y=rng.uniform(-3.0, 3.0),
            goal_y=rng.uniform(-3.0, 3.0),
            yaw_deg=rng.uniform(-180.0, 180.0),
            speed_mps=rng.uniform(3.0, 10.0),
            middle_m=0.5 * height_m,
            height_m=height_m,
        )
    )
    run = prepare(read_mission_file(str(path))).fly()
    assert run.reached
    assert run.metrics.margin_violations == 0
    assert run.metrics.path_length_m < 1.5 * 36.0
