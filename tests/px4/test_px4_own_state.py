"""PX4's estimate as own motion: frames, validity, jumps, and where the local frame lies."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the packages of [ros2]")

from clearway.base.frames import FloatArray, geodetic_from_enu
from clearway.px4.own_state import NO_ORIGIN, NO_POSE, Px4OwnState
from clearway.ros2.messages import make_message
from px4_for_tests import MISSION, Px4Bench

ORIGIN = np.array([52.0, 4.3, 10.0])


def odometry(
    q: Any = (1.0, 0.0, 0.0, 0.0), velocity: Any = (1.0, 0.0, 0.0), frame: int = 1, **more: Any
) -> Any:
    fields = {
        "timestamp": 5_000_000, "timestamp_sample": 4_990_000, "pose_frame": 1,
        "velocity_frame": frame, "position": np.array([2.0, 3.0, -4.0], np.float32),
        "q": np.array(q, np.float32), "velocity": np.array(velocity, np.float32),
    }  # fmt: skip
    return make_message("px4_msgs/msg/VehicleOdometry", **(fields | more))


def local(**more: Any) -> Any:
    good = dict.fromkeys(
        ("xy_valid", "z_valid", "v_xy_valid", "v_z_valid", "heading_good_for_control"), True
    )
    return make_message("px4_msgs/msg/VehicleLocalPosition", **(good | more))


def turned(axis: int, angle_rad: float) -> FloatArray:
    """Quaternion w, x, y, z."""
    q = np.zeros(4)
    q[0], q[1 + axis] = math.cos(angle_rad / 2), math.sin(angle_rad / 2)
    return q


def test_places_and_speeds_are_east_north_up() -> None:
    motion = Px4OwnState(None, Counter()).take_odometry(odometry(), with_attitude=True)
    assert motion is not None
    assert motion.time_s == pytest.approx(4.99)
    assert motion.position_m.tolist() == [3.0, 2.0, 4.0]
    assert motion.velocity_mps.tolist() == [0.0, 1.0, 0.0], "north"
    assert motion.heading_rad == pytest.approx(0.5 * math.pi)


def test_a_heading_east_points_along_x() -> None:
    east = odometry(turned(2, 0.5 * math.pi), (2.0, 0.0, 0.0), frame=3)
    motion = Px4OwnState(None, Counter()).take_odometry(east, with_attitude=True)
    assert motion is not None
    assert motion.heading_rad == pytest.approx(0.0, abs=1e-6)
    assert motion.velocity_mps == pytest.approx([2.0, 0.0, 0.0], abs=1e-6), "ahead of the body"


def test_a_nose_up_is_a_negative_pitch() -> None:
    up = odometry(turned(1, math.radians(10.0)))
    own = Px4OwnState(None, Counter())
    motion = own.take_odometry(up, with_attitude=True)
    assert motion is not None
    assert motion.attitude_rad is not None
    assert np.degrees(motion.attitude_rad) == pytest.approx([0.0, -10.0, 90.0], abs=1e-4)
    level = own.take_odometry(up, with_attitude=False)
    assert level is not None
    assert level.attitude_rad is None
    assert math.degrees(level.tilt_rad) == pytest.approx(10.0, abs=1e-4)


WRONG = {
    "another frame": {"pose_frame": 2},
    "no velocity frame": {"frame": 0},
    "not a number": {"position": np.array([np.nan, 0.0, 0.0], np.float32)},
    "no attitude": {"q": (np.nan, 0.0, 0.0, 0.0)},
    "a velocity without end": {"velocity": (np.inf, 0.0, 0.0)},
}


@pytest.mark.parametrize("what", WRONG)
def test_what_is_no_state_is_counted(what: str) -> None:
    counts = Counter[str]()
    assert (
        Px4OwnState(None, counts).take_odometry(odometry(**WRONG[what]), with_attitude=True) is None
    )
    assert counts == {NO_POSE: 1}


@pytest.mark.parametrize(
    ("field", "word"),
    [("xy_valid", "position"), ("z_valid", "height"), ("heading_good_for_control", "heading")],
)
def test_what_is_not_valid_is_named(field: str, word: str) -> None:
    own = Px4OwnState(None, Counter())
    assert "not told" in own.flaw
    own.take_local(local())
    assert own.flaw == ""
    own.take_local(local(**{field: False}))
    assert own.flaw == f"PX4's {word} is not valid"


@pytest.mark.parametrize(
    "counter", ["xy_reset_counter", "z_reset_counter", "heading_reset_counter"]
)
def test_each_jump_is_noticed(counter: str) -> None:
    own = Px4OwnState(None, Counter())
    own.take_local(local(**{counter: 3}))
    assert own.resets == 0, "what was before is no news"
    own.take_local(local(**{counter: 4}))
    assert own.resets == 1
    own.take_odometry(odometry(reset_counter=0), with_attitude=False)
    own.take_odometry(odometry(reset_counter=255), with_attitude=False)
    assert own.resets == 2, "counters wrap"


def test_the_world_is_the_missions_place_on_earth() -> None:
    counts = Counter[str]()
    own = Px4OwnState(ORIGIN, counts)
    assert own.take_odometry(odometry(), with_attitude=False) is None
    assert counts == {NO_ORIGIN: 1}
    there = geodetic_from_enu(np.array([100.0, -50.0, 5.0]), ORIGIN)
    told = {"ref_lat": there[0], "ref_lon": there[1], "ref_alt": there[2]}
    own.take_local(local(**told))
    assert own.world_from_local_m is None, "not said to be global"
    own.take_local(local(xy_global=True, z_global=True, **told))
    motion = own.take_odometry(odometry(), with_attitude=False)
    assert motion is not None
    assert motion.position_m == pytest.approx([103.0, -48.0, 9.0], abs=1e-3)
    own.take_local(local(xy_global=True, z_global=True, **(told | {"ref_alt": there[2] + 1.0})))
    assert own.resets == 1, "its frame has moved"


def test_set_points_go_out_in_px4s_frame(tmp_path: Path) -> None:
    """PX4 began 30 m east and 40 m north of the mission's origin, and flies as if it had not."""
    placed = MISSION.replace("[mission]", "[mission]\norigin_geodetic = [52.0, 4.3, 0.0]")
    shift, flown = np.array([30.0, 40.0, 0.0]), []
    for off_m in (np.zeros(3), shift):
        bench = Px4Bench(tmp_path, "1.17", mission=placed)
        bench.px4._origin = geodetic_from_enu(off_m, np.array([52.0, 4.3, 0.0]))
        bench.px4._shift_m = -off_m  # What it tells, from the truth of the mission's world.
        assert bench.until(bench.flies)
        bench.step(100)
        assert bench.flies()
        flown.append(bench.px4.truth.position_m)
    assert bench.link.place.world_from_local_m == pytest.approx(shift, abs=0.01)
    assert flown[0][0] > 6.0
    assert flown[1] == pytest.approx(flown[0], abs=0.05)
