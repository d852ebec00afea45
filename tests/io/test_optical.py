"""Axes of cameras: turned once, by their name or by whoever states them, and never twice."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import clearway as cw
from clearway.base.errors import InputError
from clearway.base.frames import world_from_body
from clearway.io.poses.pose_track import quaternions_of
from clearway.io.scans.optical import AHEAD_FROM_OPTICAL, is_optical, turn_points
from clearway.io.scans.scan_formats import read_points
from clearway.io.scans.sequences import open_scans
from clearway.missions.scene_reading import scene_of
from clearway.sensors import Mounting
from recordings_for_tests import bag1, bag2, mcap2, storage, types_of
from robot_messages import Message, Types

CAMERA = "camera_depth_optical_frame"
LOOKS_AHEAD = tuple(quaternions_of(AHEAD_FROM_OPTICAL[None])[0].tolist())
"""w, x, y, z of a camera's optical axes that look along x."""


def wall(ahead_m: float = 6.0) -> np.ndarray:
    """Returns of a wall across the way, higher than it is deep, x ahead."""
    y, z = np.meshgrid(np.linspace(-2.0, 2.0, 25), np.linspace(-1.0, 1.5, 15))
    return np.stack([np.full(y.size, ahead_m), y.ravel(), z.ravel()], axis=-1)


def optical(points_m: np.ndarray) -> np.ndarray:
    """The same points with a camera's axes."""
    return points_m @ AHEAD_FROM_OPTICAL


def body_points(sequence: Any) -> np.ndarray:
    """Points of the first scan in the frame of the vehicle."""
    scan = next(iter(sequence))
    mounting = sequence.mounting or Mounting()
    turned: np.ndarray = scan.read().points_m @ mounting.body_from_sensor.T
    return turned + mounting.position_m


@given(arrays(np.float64, (7, 3), elements=st.floats(-1e3, 1e3)))
def test_turning_is_a_rotation_that_turns_back_to_the_last_bit(points: np.ndarray) -> None:
    np.testing.assert_array_equal(turn_points(optical(points)), points)
    np.testing.assert_array_equal(turn_points(points), points @ AHEAD_FROM_OPTICAL.T)
    assert np.linalg.det(AHEAD_FROM_OPTICAL) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("frame", "named"),
    [
        (CAMERA, True), ("/zed_left_camera_optical_frame", True), ("kinect_depth_optical", True),
        ("Camera_Optical_Frame", True), ("camera_optical_frame_2", True), ("lidar", False),
        ("camera_link", False), ("optical_flow_link", False), ("", False), ("velodyne", False),
    ],
)  # fmt: skip
def test_names_of_optical_frames(frame: str, named: bool) -> None:
    assert is_optical(frame) is named


@pytest.mark.parametrize("maker", [bag1, bag2, mcap2])
def test_a_camera_without_transforms_is_turned_by_its_name(maker: Any, tmp_path: Path) -> None:
    types = types_of(maker)
    path = maker(tmp_path, [Message("/points", 1.0, types.cloud2(1.0, CAMERA, optical(wall())))])
    sequence = open_scans(path)
    np.testing.assert_allclose(body_points(sequence), wall(), atol=1e-6)
    (note,) = next(iter(sequence)).read().notes
    assert "turned from optical axes" in note
    assert "--frame body leaves them" in note
    as_it_stands = body_points(open_scans(path, frame="body"))
    np.testing.assert_allclose(as_it_stands, optical(wall()), atol=1e-6)
    np.testing.assert_allclose(read_points(storage(path)).points_m, wall(), atol=1e-6)
    with pytest.raises(InputError, match="frame 'ned': valid: auto, body, optical"):
        open_scans(path, frame="ned")  # type: ignore[arg-type]


def test_a_lidar_is_never_turned_unasked(tmp_path: Path) -> None:
    path = mcap2(tmp_path, [Message("/points", 1.0, Types().cloud2(1.0, "velodyne", wall()))])
    np.testing.assert_array_equal(body_points(open_scans(path)), wall().astype(np.float32))


@pytest.mark.parametrize("tilt_deg", [0.0, 20.0])
@pytest.mark.parametrize("odometry", [False, True])
def test_where_transforms_say_how_it_sits_they_turn_it_and_the_name_does_not_again(
    tmp_path: Path, tilt_deg: float, odometry: bool
) -> None:
    """A camera 0.3 m ahead, tilted down: by `base_link` to its optical frame, as robots tell it."""
    types, down = Types(), world_from_body([0.0, np.radians(tilt_deg), 0.0])
    turn = quaternions_of((down @ AHEAD_FROM_OPTICAL)[None])[0]
    seen = (wall() - [0.3, 0.0, 0.0]) @ down
    messages = [
        Message("/tf_static", 1.0, types.transform(0.0, "base_link", CAMERA, (0.3, 0, 0), turn)),
        Message("/points", 1.0, types.cloud2(1.0, CAMERA, optical(seen))),
    ]
    if odometry:
        messages.append(Message("/odom", 1.0, types.odometry(1.0, (0.0, 0.0, 2.0))))
    sequence = open_scans(mcap2(tmp_path, messages))
    np.testing.assert_allclose(body_points(sequence), wall(), atol=1e-5)
    assert sequence.mounting is not None
    expected = [0.0, np.radians(tilt_deg), 0.0]
    np.testing.assert_allclose(sequence.mounting.attitude_rad, expected, atol=1e-6)


def test_poses_of_an_optical_frame_are_those_of_what_it_looks_at(tmp_path: Path) -> None:
    """Visual odometry tells where the optical frame is: level, looking left, in a map with z up."""
    types, left = Types(), world_from_body([0.0, 0.0, np.pi / 2.0])
    turn = quaternions_of((left @ AHEAD_FROM_OPTICAL)[None])[0]
    messages = [
        Message("/tf", 1.0 + n, types.transform(1.0 + n, "map", CAMERA, (0.0, n, 2.0), turn))
        for n in (0.0, 0.5)
    ]
    messages.append(Message("/points", 1.2, types.cloud2(1.2, CAMERA, optical(wall()))))
    (scan,) = open_scans(mcap2(tmp_path, messages))
    assert scan.state is not None
    np.testing.assert_allclose(scan.state.attitude_rad, [0.0, 0.0, np.pi / 2.0], atol=1e-6)
    np.testing.assert_allclose(scan.read().points_m, wall(), atol=1e-6)


def test_odometry_of_an_optical_frame(tmp_path: Path) -> None:
    types = Types()
    odometry = types.odometry(1.0, (1.0, 2.0, 3.0), LOOKS_AHEAD)
    odometry.child_frame_id = CAMERA
    messages = [
        Message("/odom", 1.0, odometry),
        Message("/points", 1.0, types.cloud2(1.0, CAMERA, optical(wall()))),
    ]
    sequence = open_scans(mcap2(tmp_path, messages))
    (scan,) = sequence
    assert scan.state is not None
    np.testing.assert_allclose(scan.state.attitude_rad, 0.0, atol=1e-6)
    np.testing.assert_allclose(body_points(sequence), wall(), atol=1e-6)


def test_packets_have_x_ahead_whatever_their_frame_is_called(data_dir: Path) -> None:
    path = data_dir / "lidar/bag/vlp16_rosbag2"
    if not path.is_dir():
        pytest.skip("needs data: a bag of a Velodyne")
    as_told = next(iter(open_scans(path))).read()
    stated = next(iter(open_scans(path, frame="optical"))).read()
    np.testing.assert_array_equal(stated.points_m, as_told.points_m)
    with pytest.raises(InputError, match="packets of a sensor tell their axes"):
        cw.read_scan(path, frame="optical")


# --- clouds of which nobody says how they lie ------------------------------------------------


def test_real_sweeps_of_lidars_are_taken_as_they_are(data_dir: Path) -> None:
    files = sorted((data_dir / "lidar/pcd").glob("*.pcd"))
    if not files:
        pytest.skip("needs data: sweeps as PCD files")
    for file in files:
        scan = cw.read_scan(file)
        np.testing.assert_array_equal(scan.points_m, read_points(file).points_m)
        assert not any("axes" in note for note in scan.notes)


@pytest.mark.parametrize("angles", [(110.0, 70.0), (87.0, 58.0), (57.0, 43.0)])
def test_a_file_of_a_depth_camera_is_refused_until_somebody_says(
    tmp_path: Path, angles: tuple[float, float]
) -> None:
    """Fields of view of usual cameras, on a wall and a floor."""
    half = np.tan(np.radians(angles) / 2.0)
    y, z = np.meshgrid(np.linspace(-half[0], half[0], 40), np.linspace(-half[1], half[1], 30))
    rays = np.stack([np.ones(y.size), y.ravel(), z.ravel()], axis=-1)
    down = np.minimum(rays[:, 2], -1e-9)
    seen = rays * np.minimum(6.0, -1.5 / down)[:, None]
    np.save(tmp_path / "cloud.npy", optical(seen))
    with pytest.raises(InputError, match=r"within 65 deg of \+z.*--frame optical.*--frame body"):
        cw.read_scan(tmp_path / "cloud.npy")
    turned = cw.read_scan(tmp_path / "cloud.npy", frame="optical")
    np.testing.assert_allclose(turned.points_m, seen)
    as_it_stands = cw.read_scan(tmp_path / "cloud.npy", frame="body")
    np.testing.assert_allclose(as_it_stands.points_m, optical(seen))
    np.save(tmp_path / "ahead.npy", seen)
    np.testing.assert_array_equal(cw.read_scan(tmp_path / "ahead.npy").points_m, seen)


@given(st.integers(0, 10_000), st.floats(-30.0, 0.0), st.floats(5.0, 89.0))
def test_no_sweep_with_beams_about_the_horizon_is_taken_for_a_camera(
    tmp_path_factory: pytest.TempPathFactory, seed: int, low_deg: float, high_deg: float
) -> None:
    """Rings and domes, in rooms and outside, with x ahead, y left and z up."""
    rng, folder = np.random.default_rng(seed), tmp_path_factory.getbasetemp()
    azimuth = rng.uniform(-np.pi, np.pi, 600)
    elevation = np.radians(rng.uniform(low_deg, high_deg, 600))
    level = np.cos(elevation)
    rays = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=-1)
    half = np.array([rng.uniform(1.0, 30.0), rng.uniform(1.0, 30.0), rng.uniform(1.0, 10.0)])
    points = rays * np.min(half / np.maximum(np.abs(rays), 1e-9), axis=1)[:, None]
    np.save(folder / "room.npy", points)
    np.testing.assert_array_equal(cw.read_scan(folder / "room.npy").points_m, points)


def test_a_sensor_that_looks_up_is_not_taken_for_a_camera(tmp_path: Path) -> None:
    """Rings on a ceiling, as a LiDAR of a dome sees it: nobody can be sure, so it is only said."""
    angle, radius = np.meshgrid(np.linspace(-np.pi, np.pi, 200), np.linspace(0.2, 4.0, 12))
    rings = np.stack(
        [radius * np.cos(angle), radius * np.sin(angle), np.full(angle.shape, 3.0)], -1
    )
    np.save(tmp_path / "ceiling.npy", rings.reshape(-1, 3))
    seen = read_scene_notes(tmp_path / "ceiling.npy")
    assert any("all points lie above" in note and "--frame optical" in note for note in seen)
    stated = read_scene_notes(tmp_path / "ceiling.npy", "body")
    assert not any("--frame" in note for note in stated)


def read_scene_notes(path: Path, frame: str = "auto") -> tuple[str, ...]:
    tables = {"scan": {"file": str(path), "frame": frame}}
    return scene_of("test", tables, path.parent, "scene").notes


def test_a_name_that_the_points_contradict_is_asked_about(tmp_path: Path) -> None:
    """A LiDAR's full turn in a frame that is called a camera's."""
    angle = np.linspace(-np.pi, np.pi, 400)
    turn = np.stack([8.0 * np.cos(angle), 8.0 * np.sin(angle), 0.2 * np.sin(9 * angle)], axis=-1)
    path = mcap2(tmp_path, [Message("/points", 1.0, Types().cloud2(1.0, CAMERA, turn))])
    with pytest.raises(InputError, match=r"lie behind the camera too.*--frame body"):
        cw.read_scan(path)
    np.testing.assert_allclose(cw.read_scan(path, frame="body").points_m, turn, atol=1e-6)


def test_a_sensor_that_transforms_say_looks_up_is_believed(tmp_path: Path) -> None:
    """A LiDAR whose x looks up: nothing in its own frame is odd."""
    types, up = Types(), quaternions_of(world_from_body([0.0, -np.pi / 2.0, 0.0])[None])[0]
    messages = [
        Message("/tf_static", 1.0, types.transform(0.0, "base_link", "lidar", (0, 0, 0), up)),
        Message("/points", 1.0, types.cloud2(1.0, "lidar", wall())),
    ]
    scan = cw.read_scan(mcap2(tmp_path, messages))
    np.testing.assert_allclose(scan.points_m, wall(), atol=1e-6)
