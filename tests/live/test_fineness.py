"""Beams too coarse for the smallest object declared are refused before take-off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import ClearwayError, FlightRefusedError
from clearway.live.preflight.fineness import (
    thickness_held_m,
    too_coarse,
    turning_distance_m,
    what_beams_hold,
    what_limits_speed,
)
from clearway.missions.setup import prepare
from clearway.missions.world_file import read_mission
from clearway.sensors import BeamPattern
from worlds_for_tests import GRID, LIDAR, planner


def test_the_turning_distance_is_where_a_turn_just_keeps_the_margin() -> None:
    made = planner()
    radius, margin = made.automaton.turning_radius_m, 0.6
    left_m = turning_distance_m(made) - made.automaton.step_m
    assert np.hypot(left_m, radius) - radius == pytest.approx(margin)


def test_beams_are_held_against_what_is_declared() -> None:
    held = thickness_held_m(planner(), [LIDAR])
    assert held == pytest.approx(LIDAR.pattern.spacing_rad * turning_distance_m(planner()))
    assert too_coarse(planner(smallest_object_m=1.001 * held), [LIDAR]) is None
    reason = too_coarse(planner(smallest_object_m=0.006), [LIDAR])
    assert reason is not None
    assert "68" in reason
    assert "1.2 deg" in reason
    assert "0.106 deg apart would do" in reason
    fine = replace(
        LIDAR, pattern=BeamPattern.per_cell(GRID, 122, elevations_per_cell=114, max_range_m=10.0)
    )
    assert np.degrees(fine.pattern.spacing_rad) <= 0.106
    assert too_coarse(planner(smallest_object_m=0.006), [LIDAR, fine]) is None


def test_no_lidar_that_looks_so_far_is_refused_too() -> None:
    short = replace(LIDAR, pattern=replace(LIDAR.pattern, max_range_m=2.0))
    for lidars in ([], [short]):
        reason = too_coarse(planner(smallest_object_m=1.0), lidars)
        assert reason is not None
        assert "no LiDAR looks as far" in reason


COPTER = """
[mission]
name = "coarse"
waypoints_m = [[20, 0, 0]]
[vehicle]
kind = "multirotor"
speed_mps = 8
acceleration_mps2 = 4
[safety]
smallest_object_m = 0.2
[[lidar]]
field_deg = [360, 30]
spacing_deg = SPACING
max_range_m = 40
"""


def test_beams_too_coarse_for_the_speed_are_reported(tmp_path: Path) -> None:
    """At 2 degrees 0.2 m can hide beyond 4 m; stopping from 8 m/s takes more than twice as much."""
    found = {}
    for spacing in ("2", "0.5"):
        (tmp_path / "coarse.toml").write_text(COPTER.replace("SPACING", spacing))
        notes = prepare(read_mission(tmp_path / "coarse.toml")).notes
        found[spacing] = [note for note in notes if "beams show no free space beyond" in note]
    assert [len(notes) for notes in found.values()] == [1, 0]
    assert "beyond 4.04 m" in found["2"][0]
    assert what_limits_speed(planner(smallest_object_m=0.001), [LIDAR]) is None  # It cannot stop.


def test_where_nothing_is_declared_the_log_says_what_beams_hold() -> None:
    assert too_coarse(planner(), [LIDAR]) is None
    said = what_beams_hold(planner(), [LIDAR])
    assert said is not None
    assert "67" in said or "68" in said
    assert what_beams_hold(planner(smallest_object_m=0.1), [LIDAR]) is None


def test_a_mission_with_coarse_beams_is_refused() -> None:
    file = read_mission("static-obstacles")
    assert any("smallest_object_m" in note for note in prepare(file).notes)
    declared = prepare(file.with_values("safety", smallest_object_m=0.01))
    assert not any("smallest_object_m" in note for note in declared.notes)
    with pytest.raises(FlightRefusedError, match="mm apart"):
        declared.refuse_impossible()
    prepare(file.with_values("safety", smallest_object_m=0.2)).refuse_impossible()


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_impossible_sizes_are_refused(value: float) -> None:
    with pytest.raises(ClearwayError, match="smallest_object_m"):
        planner(smallest_object_m=value)
