"""Scenes: what they come to, and the known answers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clearway.base.frames import world_from_body, world_points_from_body
from clearway.missions.scene_reading import scene_of
from scenes_for_tests import CROSSING, TWO_BALLS, assess, numbers, result_of


def test_an_empty_scene_is_the_papers_grid_and_free() -> None:
    result = result_of({})
    assert result["grid"]["range_m"] == pytest.approx(np.arange(11.0))
    assert numbers(result["detected"]).shape == (10, 7, 5)
    np.testing.assert_array_equal(numbers(result["visibility"]), 1.0)
    for name in ("detected", "map_base", "map", "intruder", "obstacle", "coated"):
        np.testing.assert_array_equal(numbers(result[name]), 0.0)
    reachability = numbers(result["reachability"])
    assert np.count_nonzero(np.isfinite(reachability)) > 200
    np.testing.assert_array_equal(reachability[np.isfinite(reachability)], 1.0)
    trajectories = numbers(result["trajectories"])
    np.testing.assert_array_equal(trajectories > 0, np.isfinite(reachability))
    assert {space for layer in result["space"] for column in layer for space in column} == {"free"}


@pytest.mark.parametrize(
    ("grid", "range_m", "azimuth_deg"),
    [
        ({"range_m": 20, "layers": 4}, [0, 5, 10, 15, 20], None),
        ({"range_m": [2, 10], "layers": 4}, [2, 4, 6, 8, 10], None),
        ({"range_m": [0, 1, 3, 7]}, [0, 1, 3, 7], None),
        ({"range_edges_m": [0.5, 1, 3, 7], "layers": 3}, [0.5, 1, 3, 7], None),
        ({"range_edges_m": [0, 10]}, [0, 10], None),
        ({"azimuth_deg": [-30, 60], "columns": 3}, None, [-30, 0, 30, 60]),
        ({"azimuth_edges_deg": [-30, -1, 2]}, None, [-30, -1, 2]),
        ({"azimuth_deg": 180, "columns": 4}, None, [-180, -90, 0, 90, 180]),
    ],
)
def test_grids(
    grid: dict[str, Any], range_m: list[float] | None, azimuth_deg: list[float] | None
) -> None:
    read = scene_of("test", {"grid": grid}, Path(), "test")
    if range_m is not None:
        np.testing.assert_allclose(read.scene.grid.range_edges_m, range_m)
    if azimuth_deg is not None:
        np.testing.assert_allclose(np.degrees(read.scene.grid.azimuth_edges_rad), azimuth_deg)
    again = scene_of("test", read.tables, Path(), "test").scene.grid
    for edges, same in zip(read.scene.grid.edges, again.edges, strict=True):
        np.testing.assert_array_equal(edges, same)


def test_simulated_scan_gives_the_known_answers(known_answers: dict[str, Any]) -> None:
    expected = known_answers["lidar_scene"]
    result = result_of({"obstacle": TWO_BALLS, "scan": {"simulate": {}}})
    np.testing.assert_array_equal(numbers(result["hits"]), numbers(expected["hits"]))
    np.testing.assert_allclose(numbers(result["detected"]), numbers(expected["P_OL"]), atol=1e-12)
    np.testing.assert_allclose(numbers(result["visibility"]), numbers(expected["P_V"]), atol=1e-8)
    assert result["scans"][0]["pattern_from"] == "simulated"


def test_listed_beams_are_those_per_cell() -> None:
    grid = scene_of("test", {}, Path(), "test").scene.grid

    def middles(edges_rad: npt.NDArray[np.float64], pieces: int) -> list[float]:
        shares = (np.arange(pieces) + 0.5) / pieces
        return (
            np.degrees(edges_rad[:-1, None] + np.diff(edges_rad)[:, None] * shares).ravel().tolist()
        )

    simulate = {
        "azimuth_deg": middles(grid.azimuth_edges_rad, 20),
        "elevation_deg": middles(grid.elevation_edges_rad, 10),
    }
    listed = result_of({"obstacle": TWO_BALLS, "scan": {"simulate": simulate}})
    per_cell = result_of({"obstacle": TWO_BALLS, "scan": {"simulate": {}}})
    np.testing.assert_array_equal(numbers(listed["hits"]), numbers(per_cell["hits"]))


@pytest.mark.parametrize(
    ("case", "obstacles"),
    [
        ("ball_center", [TWO_BALLS[0]]),
        (
            "line_y",
            [
                {
                    "shape": "line",
                    "position_m": [6, 0, 0],
                    "orientation_deg": [0, 0, 90],
                    "size_m": [4],
                    "radius_m": 0.3,
                }
            ],
        ),
        (
            "cuboid_axis",
            [{"shape": "cuboid", "position_m": [6, 1, 0], "size_m": [2, 2, 2], "radius_m": 0.1}],
        ),
        (
            "U_two_overlapping_balls",
            [
                TWO_BALLS[0],
                {"shape": "ball", "position_m": [5.5, 0.8, 0.3], "radius_m": 1.0},
            ],
        ),
    ],
)
def test_map_gives_the_known_answers(
    known_answers: dict[str, Any], case: str, obstacles: list[dict[str, Any]]
) -> None:
    expected = numbers(known_answers["map_base_probability"][case]["P_OM_B"])
    result = result_of({"obstacle": obstacles})
    error = np.abs(numbers(result["map_base"]) - expected)
    assert error.max() <= 0.03
    assert error.mean() <= 0.004
    np.testing.assert_array_equal(numbers(result["map"]), 0.0)  # all visible: (5.54)
    coated = np.array(result["coated"], dtype=bool)
    assert coated[expected > 0.0].all()
    assert coated.sum() > (expected > 0.0).sum()


def test_intruders_give_the_known_answers(known_answers: dict[str, Any]) -> None:
    expected = known_answers["intruder"]
    intruder = CROSSING | {
        "spread_deg": [15, 11.25],
        "radius_m": 1.0,
        "models": ["line", "body", "spread"],
    }
    result = result_of({"intruder": [intruder], "vehicle_timing": {"speed_mps": 1.0}})
    line, body, spread = (result["intruders"][0][name] for name in ("line", "body", "spread"))
    for name, key in (("P", "P"), ("entry_s", "i_e"), ("leave_s", "i_l"), ("dwell_s", "dwell")):
        np.testing.assert_allclose(numbers(line[name]), numbers(expected["line"][key]), atol=1e-8)
    np.testing.assert_allclose(
        numbers(line["timed"]), numbers(expected["line"]["P_timed_5_5"]), atol=1e-8
    )
    ratio = numbers(expected["body_radius_1"]["volume_ratio_6_10"])
    assert np.abs(numbers(body["P"]) - ratio).max() <= 0.02
    touched = numbers(expected["body_radius_1"]["indicator"])
    np.testing.assert_array_equal(numbers(body["indicator"])[ratio > 1e-6], touched[ratio > 1e-6])
    error = np.abs(numbers(spread["P"]) - numbers(expected["spread"]["P_T_5_23"]))
    assert error.max() <= 0.015
    assert error.mean() <= 0.004
    met = numbers(spread["meeting"])
    assert met.sum() == pytest.approx(11.9268, rel=0.03)
    combined = np.maximum(np.maximum(numbers(line["P"]), numbers(body["P"])), numbers(spread["P"]))
    np.testing.assert_allclose(numbers(result["intruder"]), combined, atol=1e-12)


def test_a_timed_intruder_counts_only_when_the_vehicle_is_there() -> None:
    timed = CROSSING | {"models": ["line"], "timed": True}
    result = result_of({"intruder": [timed], "vehicle_timing": {"speed_mps": 1.0}})
    met = np.argwhere(numbers(result["intruder"]) > 0.0)
    assert met.tolist() == [[6, 4, 2]]
    reach = result_of({"intruder": [timed], "vehicle_timing": {"model": "reach-set"}})
    assert numbers(reach["intruder"]).sum() > 0.0


def test_a_vehicle_turns_the_world_into_its_grid() -> None:
    """The same scene, once in the grid's frame, once in the world with a tilted vehicle."""
    position, attitude_deg = np.array([30.0, -20.0, 50.0]), np.array([0.0, -15.0, 120.0])
    attitude = np.radians(attitude_deg)
    scan = {"simulate": {"obstacles": [0], "seed": 3, "sigma_m": 0.01}}
    intruder = CROSSING | {"spread_deg": 10.0, "models": ["line", "spread"]}
    up = world_from_body(attitude)[2].tolist()
    here = {"obstacle": TWO_BALLS, "scan": scan, "intruder": [intruder | {"up": up}]}
    moved = {
        "vehicle": {"position_m": position.tolist(), "attitude_deg": attitude_deg.tolist()},
        "scan": scan,
        "obstacle": [
            ball
            | {
                "position_m": world_points_from_body([ball["position_m"]], position, attitude)[
                    0
                ].tolist()
            }
            for ball in TWO_BALLS
        ],
        "intruder": [
            intruder
            | {
                "position_m": world_points_from_body([[6, 8, 0]], position, attitude)[0].tolist(),
                "velocity_mps": (world_from_body(attitude) @ [0, -1, 0]).tolist(),
            }
        ],
        "reach_set": {"start_pitch_deg": 0.0},
    }
    one, other = result_of(here), result_of(moved)
    for name in ("hits", "detected", "visibility", "map_base", "intruder", "obstacle", "coated"):
        np.testing.assert_allclose(
            numbers(one[name]), numbers(other[name]), atol=1e-6, err_msg=name
        )
    np.testing.assert_allclose(
        numbers(one["reachability"]), numbers(other["reachability"]), atol=1e-6
    )


def test_the_grid_leaves_out_the_roll_and_the_beams_do_not() -> None:
    def rolled(roll_deg: float, elevation_deg: float) -> dict[str, Any]:
        """A ball to the left, seen by one beam of the rolled vehicle."""
        beam = {"azimuth_deg": [30.0], "elevation_deg": [elevation_deg]}
        vehicle = {"attitude_deg": [roll_deg, 0.0, 90.0]}
        ball = {"shape": "ball", "position_m": [-2.5, 4.33, 0.0], "radius_m": 1.0}
        return result_of({"vehicle": vehicle, "obstacle": [ball], "scan": {"simulate": beam}})

    level, right_up = rolled(0.0, 0.0), rolled(-40.0, 0.0)
    for name in ("map_base", "coated"):
        known = numbers(level[name]) > 0.0
        assert known[:, 5, 2].any()
        assert (numbers(right_up[name]) > 0.0)[known].all()
    np.testing.assert_array_equal(numbers(level["map_base"]), numbers(right_up["map_base"]))
    assert np.argwhere(numbers(level["hits"])).tolist() == [[3, 5, 2]]
    # Its beam, 30 deg to the left, now points 18.7 deg up or down: over the ball, or under it.
    assert not np.any(numbers(right_up["hits"]))
    assert np.argwhere(numbers(right_up["visibility"])[0]).tolist() != [[5, 2]]


def test_a_vehicle_inside_an_obstacle_is_told() -> None:
    ball = {"shape": "ball", "position_m": [0.5, 0, 0], "radius_m": 1.0}
    inside = scene_of("test", {"obstacle": [ball], "scan": {"simulate": {}}}, Path(), "test")
    assert "the vehicle is inside an obstacle" in inside.notes[0]
    outside = scene_of("test", {"obstacle": TWO_BALLS, "scan": {"simulate": {}}}, Path(), "test")
    assert outside.notes == ()


def test_start_pitch_follows_the_vehicle() -> None:
    diving = assess({"vehicle": {"attitude_deg": [0, 14, 0]}})
    assert np.degrees(diving.reach_set.start_pitch_rad) == pytest.approx(14.0), "as it is flown"
    stated = assess({"reach_set": {"start_pitch_deg": 7.0, "method": "primitives"}})
    assert np.degrees(stated.reach_set.start_pitch_rad) == pytest.approx(7.0)


def test_reach_sets_are_tuned() -> None:
    def nodes(**keys: Any) -> int:
        return assess({"reach_set": {"method": "chaotic"} | keys}).reach_set.nodes

    assert nodes(spread=2) < nodes(spread=4)


def test_speed_follows_the_range() -> None:
    far = assess({"grid": {"range_m": 50}})
    assert far.scene.speed_mps == 5.0
    assert far.reach_set.length_m.max() > 45.0
    np.testing.assert_array_equal(far.reach.passed, assess({}).reach.passed)


def test_the_map_can_be_wrong_both_ways() -> None:
    """What is mapped but seen to be absent is free; what is not mapped is detected."""
    absent = assess({"obstacle": TWO_BALLS[:1], "scan": {"simulate": {"obstacles": []}}})
    np.testing.assert_array_equal(absent.cells.rating, 1.0)
    assert absent.cells.evidence.map_base.max() > 0.5
    unmapped = assess({"scan": {"simulate": {"obstacle": TWO_BALLS[:1]}}})
    assert unmapped.cells.evidence.detected.max() == 1.0
    assert unmapped.cells.evidence.map_base.max() == 0.0


def test_columns_without_beams_are_hidden_and_blocked_unless_told_otherwise() -> None:
    simulate = {"azimuth_deg": [0.0], "elevation_deg": [0.0]}
    dark = assess({"scan": {"simulate": simulate}})
    seen = dark.cells.evidence.seen
    assert seen.sum() == 10
    np.testing.assert_array_equal(dark.cells.rating, np.where(seen, 1.0, 0.0))
    assert {s for s, one in zip(dark.space.names, seen, strict=True) if not one} == {"hidden"}
    trusting = assess({"scan": {"simulate": simulate}, "rating": {"unknown_unseen": 0.0}})
    np.testing.assert_array_equal(trusting.cells.rating, 1.0)
