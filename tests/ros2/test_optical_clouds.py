"""Clouds of depth cameras on topics: turned once, where TF says how the camera sits."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.base.frames import world_from_body
from clearway.io.poses.pose_track import quaternions_of
from clearway.io.scans.optical import AHEAD_FROM_OPTICAL
from clearway.ros2.clouds import read_cloud_points
from clearway.ros2.messages import damages, make_message, pack_message, unpack_cdr
from ros2_for_tests import BEGAN_S, RosBench, cloud, odometry, transform

CAMERA = "camera_depth_optical_frame"
AT_M = (0.2, 0.0, 0.1)
"""Where the sensor of the bench sits; it looks ahead."""


def wall() -> np.ndarray:
    y, z = np.meshgrid(np.linspace(-1.5, 1.5, 15), np.linspace(-1.5, 1.5, 15))
    return np.stack([np.full(y.size, 5.0), y.ravel(), z.ravel()], axis=-1)


def optical(points_m: np.ndarray) -> np.ndarray:
    """z ahead, x right, y down."""
    return points_m @ AHEAD_FROM_OPTICAL


def mounted(frame: str, turn: np.ndarray) -> Any:
    """TF of a frame where the bench's sensor sits, turned by [3, 3]."""
    message = transform(frame, "base_link", AT_M)
    (one,), (w, x, y, z) = message.transforms, quaternions_of(turn[None])[0].tolist()
    rotation = one.transform.rotation
    rotation.w, rotation.x, rotation.y, rotation.z = w, x, y, z
    return message


def seen_by(bench: RosBench, frame: str, points_m: np.ndarray) -> str:
    """The mode of what is decided on a cloud of a frame; "" where none is used."""
    for tick in range(4):
        now = 0.1 * tick
        bench.bus.tell("/odom", odometry(BEGAN_S + now, (now, 0.0, 0.0)))
        bench.bus.tell("/points", cloud(BEGAN_S + now, points_m, frame))
        bench.tick(now)
    told = bench.sent("/clearway/decision")
    return str(json.loads(told[-1].data)["mode"]) if told else ""


def test_a_wall_before_a_camera_is_avoided_as_one_before_a_lidar() -> None:
    camera, lidar = RosBench(), RosBench()
    camera.bus.tell("/tf_static", mounted(CAMERA, AHEAD_FROM_OPTICAL))
    assert seen_by(lidar, "lidar", wall()) == "avoidance"
    assert seen_by(camera, CAMERA, optical(wall())) == "avoidance"
    ours, theirs = (bench.sent("/clearway/plan")[-1].poses for bench in (camera, lidar))
    for one, other in zip(ours, theirs, strict=True):
        assert one.pose.position.x == pytest.approx(other.pose.position.x, abs=1e-6)
        assert one.pose.position.y == pytest.approx(other.pose.position.y, abs=1e-6)


def test_no_transform_no_cloud(bench: RosBench) -> None:
    """A name says how the axes lie, not where the camera sits."""
    assert seen_by(bench, CAMERA, optical(wall())) == ""
    told = f"{CAMERA!r} comes on neither /tf nor /tf_static"
    assert bench.counts[f"cloud: no transform from {CAMERA!r} to 'base_link': {told}"] == 4


def test_a_camera_that_looks_elsewhere_than_the_mission_says(bench: RosBench) -> None:
    aside = world_from_body([0.0, 0.0, 0.1]) @ AHEAD_FROM_OPTICAL
    bench.bus.tell("/tf_static", mounted(CAMERA, aside))
    assert seen_by(bench, CAMERA, optical(wall())) == ""
    assert bench.counts["cloud: its sensor is mounted elsewhere than the mission says"] == 4


def test_a_mission_that_turns_the_axes_itself_is_told(bench: RosBench) -> None:
    """The frame is called an optical one, but lies as the mission's sensor: z up."""
    bench.bus.tell("/tf_static", mounted(CAMERA, np.eye(3)))
    assert seen_by(bench, CAMERA, optical(wall())) == ""
    (reason,) = [line for line in bench.link.missing() if "optical axes" in line]
    assert "it must say how the camera looks" in reason


def test_optical_points_in_a_frame_of_another_name_are_refused_and_can_be_stated() -> None:
    silent = RosBench()
    assert seen_by(silent, "lidar", optical(wall())) == ""
    (reason,) = [line for line in silent.link.missing() if "no beam" in line]
    assert "`frame` of the cloud" in reason
    stated = RosBench(clouds={"front": {"topic": "points", "frame": "optical"}})
    assert seen_by(stated, "lidar", optical(wall())) == "avoidance"


def test_points_ahead_in_a_frame_of_an_optical_name_can_be_stated() -> None:
    bench = RosBench(clouds={"front": {"topic": "points", "frame": "body"}})
    bench.bus.tell("/tf_static", mounted(CAMERA, AHEAD_FROM_OPTICAL))
    assert seen_by(bench, CAMERA, wall()) == "avoidance"


def test_a_sensor_that_has_looked_ahead_may_see_little_later(bench: RosBench) -> None:
    """Only what stands high is left: no reason to doubt its axes."""
    assert seen_by(bench, "lidar", wall()) == "avoidance"
    high = wall() * [0.1, 1.0, 1.0] + [0.0, 0.0, 8.0]
    bench.bus.tell("/points", cloud(BEGAN_S + 0.4, high))
    bench.tick(0.4)
    assert not bench.link.missing()


@pytest.fixture
def bench() -> RosBench:
    return RosBench()


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_broken_clouds_are_counted_and_the_next_one_is_used(bench: RosBench) -> None:
    rng = np.random.default_rng(5)
    raw = pack_message(cloud(BEGAN_S, wall(), later_s=np.zeros(len(wall()))))
    bench.fly(1)
    for number in range(300):
        broken = bytearray(raw)
        for at in rng.integers(0, 200, 3):
            broken[at] = rng.integers(256)
        bench.bus.tell("/points", bytes(broken[: int(rng.integers(0, len(raw)))]))
        if number % 50 == 49:
            bench.link.hear(0.01)
    shapes: list[dict[str, Any]] = [
        {"point_step": 0}, {"fields": []}, {"width": 2**31}, {"height": 0, "width": 0},
        {"height": 0}, {"data": np.zeros(5, np.uint8)},
    ]  # fmt: skip
    for shape in shapes:
        message = cloud(BEGAN_S + 0.1, wall())
        for name, value in shape.items():
            setattr(message, name, value)
        bench.bus.tell("/points", message)
    bench.link.hear(0.1)
    assert bench.link.topics["/points"].refused >= 290
    assert bench.counts["/points: malformed"] > 250
    assert bench.counts["cloud: empty, which says nothing"] >= 2
    assert seen_by(bench, "lidar", wall()) == "avoidance"


def test_laser_scans_of_any_bytes_are_points_or_malformed() -> None:
    rng, told = np.random.default_rng(6), make_message("sensor_msgs/msg/LaserScan")
    told.ranges = rng.normal(5.0, 3.0, 30).astype(np.float32)
    told.range_max, told.angle_increment = 10.0, 0.1
    raw = pack_message(told)
    for _ in range(500):
        broken = bytearray(raw)
        for at in rng.integers(0, len(raw), 2):
            broken[at] = rng.integers(256)
        try:
            found = read_cloud_points(
                unpack_cdr(bytes(broken), "sensor_msgs/msg/LaserScan"), "LaserScan"
            )
        except damages():
            continue
        assert np.isfinite(found.points_m).all()
