"""Sequences of scans: KITTI's files, folders, which scan is meant, poses of files, playback."""

from __future__ import annotations

import os
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.avoidance.plan.planner import Planner
from clearway.base.errors import ClearwayError, InputError
from clearway.base.frames import attitude_from_rotation, world_from_body
from clearway.base.grid import AvoidanceGrid
from clearway.base.state import State
from clearway.io.poses.bag_poses import _deviations
from clearway.io.poses.pose_file import read_poses
from clearway.io.poses.pose_track import convert_quaternion, pose_track, quaternions_of, slerp
from clearway.io.scans.pointcloud import PointCloud
from clearway.io.scans.scan_formats import read_points
from clearway.io.scans.sequences import open_scans
from clearway.io.scans.timed_scans import ScanSequence, TimedScan, scan_at
from clearway.live import AvoidanceSystem
from clearway.live.playback import Moment, mission_along, play
from clearway.reach.store import ReachLibrary
from clearway.sensors import BeamPattern, Lidar, Scan
from clearway.vehicle.automaton import MovementAutomaton

POINTS = np.array([[1.0, 2.0, 3.0], [-4.5, 0.25, 0.5], [10.0, -2.0, 1.5]])


def write_bin(path: Path, points: np.ndarray, more: int = 1) -> Path:
    """A scan as KITTI writes it, `more` values after x, y, z."""
    np.column_stack([points, np.full((len(points), more), 0.5)]).astype("<f4").tofile(path)
    return path


def test_kitti_and_nuscenes_scans(tmp_path: Path) -> None:
    assert read_points(write_bin(tmp_path / "000000.bin", POINTS)).points_m.tolist() == (
        POINTS.tolist()
    )
    path = write_bin(tmp_path / "LIDAR_TOP.pcd.bin", POINTS, more=2)
    np.testing.assert_array_equal(read_points(path).points_m, POINTS)


@pytest.mark.parametrize("kept", [1, 10, 17, 47])
def test_a_cut_kitti_scan_is_refused(tmp_path: Path, kept: int) -> None:
    path = write_bin(tmp_path / "a.bin", POINTS)
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(InputError, match=f"truncated.*: {kept} bytes are no whole number of poin"):
        read_points(path)


def test_a_kitti_scan_of_nowhere_is_refused(tmp_path: Path) -> None:
    os.truncate(write_bin(tmp_path / "a.bin", POINTS), 0)
    with pytest.raises(InputError, match="empty"):
        read_points(tmp_path / "a.bin")
    write_bin(tmp_path / "a.bin", np.zeros((5, 3)))
    with pytest.raises(InputError, match=r"no usable point .*5 at the sensor's origin, no return"):
        read_points(tmp_path / "a.bin")


# --- folders ----------------------------------------------------------------------------------


def test_a_folder_in_the_order_of_its_numbers(tmp_path: Path) -> None:
    for number in (10, 9, 100):
        write_bin(tmp_path / f"scan_{number}.bin", POINTS + number)
    (tmp_path / "notes.md").write_text("not a scan")
    sequence = open_scans(tmp_path)
    assert sequence.format == "folder of 3 .bin"
    assert [scan.time_s for scan in sequence] == pytest.approx([0.0, 0.1, 0.2])
    assert any("taken as 0.1 s apart" in note for note in sequence.notes)
    for scan, number in zip(sequence, (9, 10, 100), strict=True):
        np.testing.assert_array_equal(scan.read().points_m, POINTS + number)


@pytest.mark.parametrize(
    ("place", "text", "times"),
    [
        ("velodyne/times.txt", "0.5\n0.75\n", [0.5, 0.75]),
        ("times.txt", "0.000000e+00\n1.036224e-01\n\n", [0.0, 0.1036224]),
        (
            "timestamps.txt",
            "2011-09-26 13:02:25.594360375\n2011-09-26 13:02:25.697957544\n",
            [1317042145.594360375, 1317042145.697957544],
        ),
    ],
)
def test_times_beside_or_in_the_folder(
    tmp_path: Path, place: str, text: str, times: list[float]
) -> None:
    folder = tmp_path / "velodyne"
    folder.mkdir()
    for number in range(2):
        write_bin(folder / f"{number:06}.bin", POINTS)
    (tmp_path / place).write_text(text)
    assert [scan.time_s for scan in open_scans(folder)] == pytest.approx(times, abs=1e-6)


def test_names_of_seconds_and_nanoseconds(tmp_path: Path) -> None:
    for name in ("1700000000.900000000.bin", "1700000001.100000000.bin"):
        write_bin(tmp_path / name, POINTS)
    sequence = open_scans(tmp_path)
    assert [scan.time_s for scan in sequence] == pytest.approx([1_700_000_000.9, 1_700_000_001.1])
    assert any("times of the names" in note for note in sequence.notes)


def test_names_that_are_nanoseconds(data_dir: Path) -> None:
    sequence = open_scans(data_dir / "lidar/pcd")
    assert [scan.time_s for scan in sequence] == pytest.approx(
        [1585897255.376374245, 1673400472.138016708], abs=1e-6
    )
    assert scan_at(sequence, 1).read().points_m.shape == (14_831, 3)


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({}, r"needs files of one kind, found none; valid: \.pcd"),
        ({"1.bin": b"", "2.npy": b""}, r"found 1 \.bin, 1 \.npy"),
        ({"first.bin": b""}, "no number in the name of first.bin"),
        ({"1.bin": b"", "2.bin": b"", "times.txt": b"1\n"}, "1 times for 2 scans"),
        ({"1.bin": b"", "times.txt": b"noon\n"}, "line 1: 'noon' is neither seconds nor a date"),
    ],
)
def test_bad_folders(tmp_path: Path, files: dict[str, bytes], message: str) -> None:
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message):
        open_scans(tmp_path)


def test_a_damaged_scan_of_a_folder_is_named(tmp_path: Path) -> None:
    write_bin(tmp_path / "1.bin", POINTS)
    (tmp_path / "2.bin").write_bytes(b"123")
    first, second = open_scans(tmp_path)
    assert len(first.read().points_m) == 3
    with pytest.raises(InputError, match=r"2\.bin: truncated"):
        second.read()


# --- which one --------------------------------------------------------------------------------


def made(*times_s: float) -> ScanSequence:
    """A sequence whose scans have nothing in them."""
    empty = PointCloud(np.zeros((0, 3)), None, None, "metres", "made")

    def scans() -> Iterator[TimedScan]:
        for index, time_s in enumerate(times_s):
            yield TimedScan(index, time_s, None, lambda: empty)

    return ScanSequence("made", "made", scans)


@pytest.mark.parametrize(
    ("at", "index"), [(0, 0), (2, 2), ("1", 1), ("0s", 0), ("0.14s", 1), ("0.16s", 2), ("0.6s", 2)]
)
def test_a_scan_by_number_or_time(at: int | str, index: int) -> None:
    assert scan_at(made(100.0, 100.1, 100.2), at).index == index


@pytest.mark.parametrize(
    ("times", "at", "message"),
    [
        ((1.0, 2.0), 2, "no scan number 2; it has 2, numbered 0 to 1"),
        ((), 0, "no scan number 0; it has 0$"),
        ((), "1s", "no scan in it"),
        ((1.0, 2.0), "1.6s", "no scan at 1.6 s; it has 2 in 1 s"),
        ((1.0, 2.0, 3.0), "1e99s", "no scan at 1e\\+99 s; it has 3 in 2 s"),
        ((1.0, 2.0), "noon", "at 'noon': valid: the number of a scan from 0, or seconds"),
        ((1.0, 2.0), "-1", "valid: the number"),
        ((1.0, 2.0), "nans", "valid: the number"),
        ((1.0, 2.0), "1.5", "valid: the number"),
    ],
)
def test_scans_that_are_not_there(times: tuple[float, ...], at: int | str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        scan_at(made(*times), at)


# --- poses ------------------------------------------------------------------------------------

ANGLE = st.floats(-3.0, 3.0)


@given(st.tuples(ANGLE, st.floats(-1.5, 1.5), ANGLE), st.floats(-3.0, 3.0), st.floats(0.0, 1.0))
def test_interpolation_turns_evenly_about_one_axis(
    start: tuple[float, float, float], turn: float, share: float
) -> None:
    """Law: at a share of the time, the body has turned by that share of the angle."""
    about = world_from_body([0.0, 0.0, 1.0]) @ world_from_body(start)

    def turned(part: float) -> np.ndarray:
        return world_from_body([0.0, 0.0, part * turn]) @ about

    both = quaternions_of(np.array([turned(0.0), turned(1.0)]))
    np.testing.assert_allclose(
        convert_quaternion(slerp(both[0], both[1], share)), turned(share), atol=1e-6
    )


def test_no_pose_in_gaps_and_far_from_the_ends() -> None:
    level = np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    track = pose_track("t", np.array([0.0, 0.8, 5.0]), np.eye(3), level)
    held = {time_s: track.at(time_s) for time_s in (-1.5, -0.5, 0.4, 0.8, 2.0, 5.5, 6.5)}
    assert [time_s for time_s, state in held.items() if state is None] == [-1.5, 2.0, 6.5]
    state = held[0.4]
    assert state is not None
    np.testing.assert_allclose(state.position_m, [0.5, 0.5, 0.0])
    assert state.time_s == 0.4


def test_poses_that_are_none_are_left_out_and_said() -> None:
    quaternion = np.array([[1.0, 0, 0, 0], [0, 0, 0, 0], [2.0, 0, 0, 0], [np.nan, 0, 0, 0]])
    quaternion = np.vstack([quaternion, quaternion[0]])
    position_m = np.zeros((5, 3))
    position_m[4, 1] = -1e308
    track = pose_track("t", np.array([1.0, 2.0, 1.0, 3.0, 4.0]), position_m, quaternion)
    assert track.time_s.tolist() == [1.0]
    assert track.notes == (
        "4 poses left out: not finite, beyond 1e+09 m or 1e+11 s, or told twice",
    )


def test_a_track_hands_on_how_sure_its_poses_are() -> None:
    level = np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    stds = np.array([[0.1, 0.02], [9.0, 9.0], [0.4, 0.01]])
    place = np.zeros((3, 3))
    place[1] = np.nan
    track = pose_track("t", np.array([0.0, 0.4, 0.8]), place, level, deviations=stds)
    state = track.at(0.3)
    assert state is not None
    assert (state.position_std_m, state.attitude_std_rad) == (0.4, 0.02)


@pytest.mark.parametrize(
    ("variances", "stds"),
    [
        ((0.04, 0.09, 0.01, 0.0, 0.0004, 0.0001), (0.3, 0.02)),
        ((0.0,) * 6, (0.0, 0.0)),
        ((-1.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0)),
        ((0.04, 0.04, 1e6, 1e6, np.nan, 0.0001), (0.2, 0.01)),
    ],
)
def test_covariances_of_odometry_become_standard_deviations(variances, stds) -> None:
    told = _deviations(np.diag(variances).ravel().tolist())
    assert told == pytest.approx(stds)
    assert _deviations(None) == (0.0, 0.0)


def test_tables_of_angles_and_of_quaternions_agree(tmp_path: Path) -> None:
    (tmp_path / "angles.csv").write_text(
        "time,x,y,z,roll,pitch,yaw\n1.0, 1,2,3, 10,-20,30\n# done\n2.0, 2,2,3, 10,-20,30\n"
    )
    q = quaternions_of(world_from_body(np.radians([[10.0, -20.0, 30.0]])))[0]
    turn = f"{q[1]} {q[2]} {q[3]} {q[0]}"
    (tmp_path / "tum.txt").write_text(f"1.0 1 2 3 {turn}\n2.0 2 2 3 {turn}\n")
    for name in ("angles.csv", "tum.txt"):
        poses = read_poses(tmp_path / name)
        assert poses.span == "2 poses, from 1.000 to 2.000 s"
        state = poses.at(7, 1.5)
        assert state is not None
        np.testing.assert_allclose(state.position_m, [1.5, 2.0, 3.0])
        np.testing.assert_allclose(np.degrees(state.attitude_rad), [10.0, -20.0, 30.0])


@pytest.mark.parametrize(
    "text",
    [
        "time,yaw,pitch,roll,x,y,z\n1.0,30,-20,10,1,2,3\n2.0,30,-20,10,2,2,3\n",
        "x y z roll_rad pitch_rad yaw_rad time speed\n"
        "1 2 3 0.17453292519943295 -0.3490658503988659 0.5235987755982988 1.0 7\n"
        "2 2 3 0.17453292519943295 -0.3490658503988659 0.5235987755982988 2.0 7\n",
        "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
        "q_RS_y [], q_RS_z []\n"
        "{0}000000000,1,2,3,{w},{x},{y},{z}\n{1}000000000,2,2,3,{w},{x},{y},{z}\n",
        "# timestamp tx ty tz qx qy qz qw\n"
        "{0}000 1 2 3 {x} {y} {z} {w}\n{1}000 2 2 3 {x} {y} {z} {w}\n",
    ],
)
def test_a_header_says_which_column_is_which(tmp_path: Path, text: str) -> None:
    w, x, y, z = quaternions_of(world_from_body(np.radians([[10.0, -20.0, 30.0]])))[0]
    start = 1_700_000_000 if "{0}" in text else 1
    (tmp_path / "way.csv").write_text(
        text.format(start, start + 1, w=w, x=x, y=y, z=z) if "{0}" in text else text
    )
    state = read_poses(tmp_path / "way.csv").at(7, start + 0.5)
    assert state is not None
    np.testing.assert_allclose(state.position_m, [1.5, 2.0, 3.0])
    np.testing.assert_allclose(np.degrees(state.attitude_rad), [10.0, -20.0, 30.0])


CALIBRATION = "P0: 1 2 3\nTr: 0 -1 0 0  0 0 -1 -0.1  1 0 0 -0.3\n"


@pytest.mark.parametrize("calibration", [None, CALIBRATION])
def test_kitti_poses_of_the_camera_become_the_lidar_s(
    tmp_path: Path, calibration: str | None
) -> None:
    """The camera drives 2 m ahead (its z) and turns 90 deg to the right (about its y, down)."""
    (tmp_path / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n" + "0 0 1 0 0 1 0 0 -1 0 0 2\n")
    if calibration is not None:
        (tmp_path / "calib.txt").write_text(calibration)
    poses = read_poses(tmp_path / "poses.txt")
    start, end = poses.at(0, 0.0), poses.at(1, 0.1)
    assert start is not None
    assert end is not None
    np.testing.assert_allclose(start.vector, 0.0, atol=1e-12)
    np.testing.assert_allclose(end.attitude_rad, [0.0, 0.0, -np.pi / 2.0], atol=1e-12)
    # With Tr, the LiDAR is 0.3 m behind the camera: it swings to the left of where that was.
    expected = [2.0, 0.0, 0.0] if calibration is None else [2.3, 0.3, 0.0]
    np.testing.assert_allclose(end.position_m, expected, atol=1e-12)
    assert poses.at(2, 0.2) is None
    assert ("no calib.txt" in poses.notes[0]) == (calibration is None)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        ("time,x,y,z\n", r"no pose in it; valid: time,x,y,z,roll,pitch,yaw"),
        ("1,2,3\n", "line 1: 3 values"),
        ("1,2,3,4,5,6,7\n1,2,3,4,5,6\n", "line 2: 6 values"),
        ("1,2,3,4,5,6,7\n1,2,x,4,5,6,7\n", "line 2: '1,2,x,4,5,6,7' is no row of numbers"),
        ("nan,2,3,4,5,6,7\n", "no usable pose"),
        ("1,2,3,4,5,6,1e308\n", "no usable pose"),
        ("time,yaw,pitch,roll,x,y,z\n1,2,3\n", "line 2: 3 values"),
        ("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 2 0 0 0 0 1 0\n", "pose 1: its first 3 x 3 numbers"),
        ("1 0 0 nan 0 1 0 0 0 0 1 0\n", "pose 0: its first 3 x 3 numbers are no rotation"),
    ],
)
def test_bad_files_of_poses(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "poses.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        read_poses(tmp_path / "poses.csv")


def test_poses_of_a_file_for_scans_of_a_folder(tmp_path: Path) -> None:
    scans = tmp_path / "scans"
    scans.mkdir()
    for number in range(3):
        write_bin(scans / f"{number}.bin", POINTS)
    (tmp_path / "poses.csv").write_text("0,0,0,0,0,0,0\n0.2,2,0,0,0,0,0\n")
    sequence = open_scans(scans, poses=tmp_path / "poses.csv")
    states = [scan.state for scan in sequence]
    assert [None if s is None else s.position_m[0] for s in states] == pytest.approx([0, 1, 2])
    assert sequence.poses == "2 poses, from 0.000 to 0.200 s"
    with pytest.raises(InputError, match=r"absent\.csv: cannot be read: no such file of poses"):
        open_scans(scans, poses=tmp_path / "absent.csv")


def test_a_rotation_survives_the_quaternion() -> None:
    attitude = np.array([[0.3, -0.2, 1.0], [-2.0, 1.2, 3.0], [0.0, 0.0, np.pi]])
    turned = [convert_quaternion(q) for q in quaternions_of(world_from_body(attitude))]
    np.testing.assert_allclose(attitude_from_rotation(turned), attitude, atol=1e-12)


# --- playback ---------------------------------------------------------------------------------


def way(*places: tuple[float, float]) -> list[State]:
    return [State(np.array([x, y, 5.0]), time_s=float(n)) for n, (x, y) in enumerate(places)]


def test_waypoints_on_the_recorded_way() -> None:
    mission = mission_along(way((0, 0), (4, 0), (9, 0), (14, 0), (14, 6), (14, 13)), 10.0, 1.5)
    np.testing.assert_allclose(mission.waypoints_m, [[14, 0, 5], [14, 13, 5], [114, 13, 5]])
    still = mission_along(way((3, 3), (3.2, 3)), 10.0, 1.5)
    np.testing.assert_allclose(still.waypoints_m, [[103.2, 3, 5]])
    with pytest.raises(ClearwayError, match="at least one"):
        mission_along([], 10.0, 1.5)


def test_playing_sees_and_decides_at_every_moment() -> None:
    automaton = MovementAutomaton.plane(1.0, 15.0)
    grid = AvoidanceGrid.uniform()
    planner = Planner.of(ReachLibrary.load_or_build(automaton, grid))
    lidar = Lidar("l", BeamPattern.per_cell(grid, 4, elevations_per_cell=4, max_range_m=10.0))
    wall = np.stack(np.meshgrid([4.0], np.linspace(-1, 1, 30), np.linspace(-1, 1, 30)), -1)
    wall = wall.reshape(-1, 3)
    states = [State(np.array([0.5 * n, 0.0, 5.0]), time_s=10.0 + n) for n in range(4)]
    scans = [np.zeros((0, 3)), wall, wall - [0.5, 0, 0], wall - [1.0, 0, 0]]
    moments = [
        Moment(state, Scan(points, state.time_s, sensor="l"))
        for state, points in zip(states, scans, strict=True)
    ]
    system = AvoidanceSystem(planner, mission_along(states[:1], 10.0, 1.5), lidars=(lidar,))
    played = list(play(system, moments))
    assert [one.hits for one in played] == [0, 900, 900, 900]
    assert played[0].nearest_m == np.inf
    assert played[1].nearest_m == pytest.approx(np.linalg.norm(wall, axis=1).min())
    assert played[1].decision.mode == "avoidance"
    assert all(one.decision.decision.choice.clearance_m >= 0.6 for one in played[:2])
    assert [one.decision.time_s for one in played] == [10.0, 11.0, 12.0, 13.0]
    assert played[0].planned is None
    for before, one in pairwise(played):
        flown = before.decision.decision.path_m
        off = np.linalg.norm(flown - one.planned.position_m, axis=1)
        assert off.min() < 0.05, "on the path decided a second before"
