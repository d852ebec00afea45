"""Ways out in wind, and from a tilt that no movement leads to: flown on for as long as they were
verified, instead of what is not verified at all."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.sim import Run

VEHICLE = "turn_step_deg = {turn}\npitch_limit_deg = {turn}\nbody_radius_m = 0.2"
SCENE = """
[mission]
name = "drifts"
waypoints_m = [[70.0, 0.0, 0.0]]
[grid]
range_m = {range}
azimuth_deg = 60.0
elevation_deg = 45.0
[safety]
margin_m = {margin}
wind_mps = {wind}
[simulation]
time_limit_s = 120.0
wind_mps = {wind}
[[lidar]]
beams_per_cell = [12, 8]
sigma_m = 0.01
[vehicle]
"""


UNSURE = """
[mission]
name = "unsure"
waypoints_m = [[40.0, 0.0, 0.0]]
[vehicle]
kind = "inertialess"
body_radius_m = 0.1
[grid]
range_m = 6.0
[safety]
margin_m = 0.15
[simulation]
position_sigma_m = 0.1
time_limit_s = 90.0
seed = {seed}
[[lidar]]
sigma_m = 0.01
"""


def flown(folder: Path, vehicle: str, walls: str, **values: object) -> Run[Any]:
    return of_mission(folder, SCENE.format(**values) + vehicle + walls)


def of_mission(folder: Path, text: str) -> Run[Any]:
    path = folder / "mission.toml"
    path.write_text(text)
    return prepare(read_mission_file(path)).fly()


def slabs(*places: tuple[tuple[float, float, float], tuple[float, float, float]]) -> str:
    one = '\n[[obstacle]]\nshape = "cuboid"\nposition_m = {}\nsize_m = {}'
    return "".join(one.format(list(at), list(size)) for at, size in places)


def room(half_m: float, height_m: float) -> str:
    wide = 2.0 * half_m + 1.0
    return slabs(
        *(((0.0, 0.0, s * height_m), (wide, wide, 0.4)) for s in (-1.0, 1.0)),
        *(((s * half_m, 0.0, 0.0), (0.4, wide, 2.0 * height_m)) for s in (-1.0, 1.0)),
        *(((0.0, s * half_m, 0.0), (wide, 0.4, 2.0 * height_m)) for s in (-1.0, 1.0)),
    )


@pytest.mark.parametrize(
    "wind", [[0.29, 0.06, 0.0], pytest.param([0.25, -0.1, 0.0], marks=pytest.mark.nightly)]
)
def test_wind_takes_no_way_out_before_a_wall(tmp_path: Path, wind: list[float]) -> None:
    wall = slabs(((12.0, 0.0, 0.0), (0.5, 24.0, 32.0)))
    vehicle = "turn_step_deg = 15.0\nbody_radius_m = 0.2"
    run = flown(tmp_path, vehicle, wall, range=15.0, wind=wind, margin=0.6)
    assert run.metrics.margin_violations == 0
    assert run.summary()["decisions_without_escape"] == 0


DRIFTS_OFF = """
[mission]
name = "drifts-off"
waypoints_m = [[30.0, 0.0, 0.0]]
[vehicle]
kind = "inertialess"
turn_step_deg = {turn}
body_radius_m = 0.2
[grid]
range_m = 10.6
azimuth_deg = 30.0
elevation_deg = 25.0
[safety]
margin_m = 0.3
wind_mps = {wind}
[simulation]
time_limit_s = 60.0
wind_mps = {wind}
[[lidar]]
beams_per_cell = [20, 10]
"""


@pytest.mark.parametrize(
    ("turn", "wind"),
    [
        (20.0, [-0.176, 0.095, 0.0]),
        pytest.param(20.0, [-0.176, -0.095, 0.0], marks=pytest.mark.nightly),
    ],
)
def test_a_hold_that_is_blown_off_the_start_is_no_way_out(
    tmp_path: Path, turn: float, wind: list[float]
) -> None:
    """It was one for some seconds of those asked for; then nothing certain was left, and the ball
    where nobody had looked was touched."""
    ball = '\n[[obstacle]]\nshape = "ball"\nposition_m = [1.0, 3.6, -0.07]\nradius_m = 0.9'
    run = of_mission(tmp_path, DRIFTS_OFF.format(turn=turn, wind=wind) + ball)
    told = run.summary()
    assert told["escape_mode"] == "strict"
    assert told["decisions_without_escape"] == 0
    assert run.metrics.margin_violations == 0
    assert run.reached


def test_a_tilt_between_two_steps_leads_into_no_wall_of_a_room(tmp_path: Path) -> None:
    vehicle = VEHICLE.format(turn=20.0) + "\nattitude_deg = [0.0, 10.0, 0.0]"
    scene = {"range": 10.0, "wind": [0.0, 0.0, 0.0], "margin": 0.4}
    run = flown(tmp_path, vehicle, room(6.9, 3.5), **scene)
    assert run.metrics.margin_violations == 0
    assert run.summary()["decisions_without_escape"] <= 0.1 * len(run.decisions)


@pytest.mark.parametrize("seed", [2, 3])
def test_who_can_stop_stops_where_an_unsure_place_costs_the_way_out(
    tmp_path: Path, seed: int
) -> None:
    """Also where the reach set, of a small grid, has no room for holding."""
    run = of_mission(tmp_path, UNSURE.format(seed=seed))
    reach_set = run.decisions[0].flight.decision.prepared.reach_set
    roots = {reach_set.movement_names[m] for m in reach_set.movement[reach_set.parent < 0]}
    assert "Hold" not in roots
    lost = 0
    for before, now in pairwise(entry.flight.decision for entry in run.decisions):
        had = before.way_out is not None and before.way_out.certain
        if had and not (now.way_out is not None and now.way_out.certain):
            lost += 1
            assert now.movements[0] == "Hold"
    assert lost > 0
