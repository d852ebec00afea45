"""Robot recordings: bags of both ROSes and MCAP, their topics and poses, whole and damaged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from absent_packages import without
from clearway.base.errors import InputError, MissingExtraError
from clearway.base.frames import world_from_body
from clearway.io.scans.scan_formats import read_points
from clearway.io.scans.sequences import open_scans
from recordings_for_tests import (
    MAKERS,
    POINTS,
    Maker,
    bag1,
    bag2,
    bag2_bare,
    clouds,
    mcap2,
    storage,
    types_of,
)
from robot_messages import Message, Types, write_bag2

QUARTER_LEFT = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
"""w, x, y, z of 90 degrees to the left."""


@pytest.mark.parametrize("maker", MAKERS.values(), ids=MAKERS)
def test_scans_of_every_container(maker: Maker, tmp_path: Path) -> None:
    types = types_of(maker)
    messages = [
        Message("/points", 100.0 + n, types.cloud2(90.0 + n, "lidar", POINTS + n)) for n in range(3)
    ]
    messages.insert(1, Message("/chatter", 100.5, types.text("hello")))
    sequence = open_scans(maker(tmp_path, messages))
    assert "/points (sensor_msgs/msg/PointCloud2), frame lidar" in sequence.format
    assert [(scan.index, scan.time_s, scan.state) for scan in sequence] == [
        (n, 90.0 + n, None) for n in range(3)
    ]
    for n, points in enumerate(clouds(sequence)):
        np.testing.assert_array_equal(points, POINTS + n)
    assert sequence.mounting is None


def test_a_stamp_that_nobody_set_is_the_time_of_recording(tmp_path: Path) -> None:
    types = Types()
    path = bag2(tmp_path, [Message("/cloud", 50.5, types.cloud(0.0, "", POINTS))])
    sequence = open_scans(path)
    assert [scan.time_s for scan in sequence] == [50.5]
    np.testing.assert_array_equal(clouds(sequence)[0], POINTS)


def test_several_topics_have_to_be_chosen_from(tmp_path: Path) -> None:
    types = Types()
    path = mcap2(
        tmp_path,
        [
            Message("/front", 1.0, types.cloud2(1.0, "front", POINTS)),
            Message("/rear", 1.0, types.cloud2(1.0, "rear", -POINTS)),
            Message("/chatter", 1.0, types.text("hello")),
        ],
    )
    front = r"/front \(sensor_msgs/msg/PointCloud2, 1 messages\)"
    valid = rf"valid: {front}, /rear \(sensor_msgs/msg/PointCloud2, 1 messages\)$"
    with pytest.raises(InputError, match=f"several topics with points: .*--topic.*{valid}"):
        open_scans(path)
    with pytest.raises(InputError, match=f"no points of topic '/chatter'; {valid}"):
        open_scans(path, topic="/chatter")
    np.testing.assert_array_equal(clouds(open_scans(path, topic="/rear"))[0], -POINTS)


def test_a_recording_without_points_lists_what_it_has(tmp_path: Path) -> None:
    path = bag2(tmp_path, [Message("/chatter", 1.0, Types().text("hello"))])
    with pytest.raises(InputError, match=r"no topic with points; it has /chatter \(std_msgs/msg"):
        open_scans(path)


def test_topics_belong_to_bags(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", POINTS)
    with pytest.raises(InputError, match="only bags and MCAP files have topics"):
        open_scans(tmp_path / "a.npy", topic="/points")


def test_missing_returns_are_left_out_and_counted(tmp_path: Path) -> None:
    points = np.vstack([POINTS, np.full((2, 3), np.nan), np.zeros((6, 3))])
    cloud = Types().cloud2(1.0, "lidar", points, height=4, point_step=32)
    scan = read_points(mcap2(tmp_path, [Message("/points", 1.0, cloud)]))
    np.testing.assert_array_equal(scan.points_m, POINTS)
    assert scan.counts == {"not finite": 2, "at the sensor's origin, no return": 6}


def test_a_message_that_contradicts_itself_is_told_by_its_number(tmp_path: Path) -> None:
    types = Types()
    bad = types.cloud2(2.0, "lidar", POINTS, names=("x", "y", "w"))
    path = bag2(tmp_path, [Message("/points", 1.0, types.cloud2(1.0, "lidar", POINTS)),
                           Message("/points", 2.0, bad)])  # fmt: skip
    first, second = open_scans(path)
    assert len(first.read().points_m) == 4
    with pytest.raises(InputError, match=r"made scan 1: damaged .*no field z among x, y, w"):
        second.read()


def moving(types: Types, body: str, sensor: str) -> list[Message]:
    """Two seconds ahead along x at 1 m/s, turned left in the second one."""
    return [
        Message("/tf_static", 9.0, types.transform(0.0, body, sensor, (0.2, 0, 0.5), QUARTER_LEFT)),
        Message("/tf", 10.0, types.transform(10.0, "map", "odom", (5.0, 0.0, 0.0))),
        Message("/tf", 10.1, types.transform(10.0, "odom", body, (0.0, 0.0, 2.0))),
        Message("/tf", 11.0, types.transform(11.0, "odom", body, (1.0, 0.0, 2.0))),
        Message("/tf", 11.9, types.transform(12.0, "odom", body, (2.0, 0.0, 2.0), QUARTER_LEFT)),
        Message("/points", 10.5, types.cloud2(10.5, sensor, POINTS)),
        Message("/points", 11.5, types.cloud2(11.5, sensor, POINTS)),
        Message("/points", 20.0, types.cloud2(20.0, sensor, POINTS)),
    ]  # fmt: skip


@pytest.mark.parametrize("maker", [bag1, bag2, mcap2])
def test_poses_by_transforms(maker: Maker, tmp_path: Path) -> None:
    sequence = open_scans(maker(tmp_path, moving(types_of(maker), "base_link", "lidar")))
    first, second, late = sequence
    assert first.state is not None
    assert second.state is not None
    np.testing.assert_allclose(first.state.position_m, [5.5, 0.0, 2.0])
    np.testing.assert_allclose(first.state.attitude_rad, 0.0, atol=1e-12)
    np.testing.assert_allclose(second.state.position_m, [6.5, 0.0, 2.0])
    np.testing.assert_allclose(second.state.attitude_rad, [0.0, 0.0, np.pi / 4.0], atol=1e-12)
    assert late.state is None
    assert sequence.mounting is not None
    np.testing.assert_allclose(sequence.mounting.position_m, [0.2, 0.0, 0.5])
    np.testing.assert_allclose(sequence.mounting.attitude_rad, [0.0, 0.0, np.pi / 2.0], atol=1e-12)
    assert any("poses of base_link in map by transforms" in note for note in sequence.notes)


def test_without_a_body_the_poses_are_the_sensor_s(tmp_path: Path) -> None:
    sequence = open_scans(bag2(tmp_path, moving(Types(), "frame", "lidar")))
    first = next(iter(sequence))
    assert sequence.mounting is None
    assert first.state is not None
    np.testing.assert_allclose(first.state.position_m, [5.7, 0.0, 2.5])
    np.testing.assert_allclose(first.state.attitude_rad, [0.0, 0.0, np.pi / 2.0], atol=1e-12)


def test_poses_by_odometry(tmp_path: Path) -> None:
    types = Types()
    nose_down = (np.cos(0.1), 0.0, np.sin(0.1), 0.0)
    messages = [
        Message("/tf_static", 1.0, types.transform(0.0, "base_link", "lidar", (0.0, 0.0, 0.3))),
        Message("/odom", 1.0, types.odometry(1.0, (0.0, 0.0, 1.0))),
        Message("/odom", 2.0, types.odometry(2.0, (2.0, 0.0, 1.0), nose_down)),
        Message("/points", 1.5, types.cloud2(1.5, "lidar", POINTS)),
    ]
    sequence = open_scans(mcap2(tmp_path, messages))
    (scan,) = sequence
    assert scan.state is not None
    np.testing.assert_allclose(scan.state.position_m, [1.0, 0.0, 1.0])
    np.testing.assert_allclose(scan.state.attitude_rad, [0.0, 0.1, 0.0], atol=1e-9)
    ahead = world_from_body(scan.state.attitude_rad) @ [1.0, 0.0, 0.0]
    assert ahead[2] < 0.0
    assert sequence.mounting is not None
    np.testing.assert_allclose(sequence.mounting.position_m, [0.0, 0.0, 0.3])
    assert any("poses of /odom" in note for note in sequence.notes)
    assert open_scans(tmp_path / "made.mcap", poses="/odom").notes == sequence.notes
    with pytest.raises(InputError, match="no poses of topic '/nowhere'; valid: /odom"):
        open_scans(tmp_path / "made.mcap", poses="/nowhere")


def test_odometry_alone_leaves_the_lidar_at_the_vehicle(tmp_path: Path) -> None:
    types = Types()
    messages = [
        Message("/odom", 1.0, types.odometry(1.0, (3.0, 0.0, 1.0))),
        Message("/points", 1.0, types.cloud2(1.0, "lidar", POINTS)),
    ]
    sequence = open_scans(bag2(tmp_path, messages))
    assert sequence.mounting is None
    assert any("LiDAR assumed at the place of base_link" in note for note in sequence.notes)


# --- real recordings --------------------------------------------------------------------------


@pytest.mark.nightly
def test_the_old_cloud_and_the_voxels_of_a_real_bag_are_the_same_place(data_dir: Path) -> None:
    from scipy.spatial import cKDTree

    path = data_dir / "maps/voxel/skir.bag"
    sequence = open_scans(path)
    assert "/cloud (sensor_msgs/msg/PointCloud)" in sequence.format
    (scan,), (voxels,) = list(sequence), list(open_scans(path, topic="/voxel_map"))
    points, middles = scan.read().points_m, voxels.read().points_m
    assert points.shape == (290_725, 3)
    assert scan.time_s == pytest.approx(1514442808.9677, abs=1e-3)
    assert middles.shape == (50_409, 3)
    # Every occupied voxel has a point of the cloud in it: half its diagonal is 0.087 m.
    assert cKDTree(points).query(middles)[0].max() < 0.087


# --- damage -----------------------------------------------------------------------------------


@pytest.mark.parametrize("maker", MAKERS.values(), ids=MAKERS)
def test_a_recording_cut_anywhere_is_refused(maker: Maker, tmp_path: Path) -> None:
    types = types_of(maker)
    messages = [
        Message("/points", 1.0 + n, types.cloud2(1.0 + n, "lidar", POINTS)) for n in range(5)
    ]
    whole = maker(tmp_path, messages)
    file = storage(whole)
    content = file.read_bytes()
    for share in np.linspace(0.0, 0.98, 25):
        file.write_bytes(content[: int(share * len(content))])
        with pytest.raises(InputError, match=r"truncated|empty|another format") as told:
            clouds(open_scans(whole))
        assert str(whole) in str(told.value)
    file.write_bytes(content)
    assert len(clouds(open_scans(whole))) == 5


@given(
    name=st.sampled_from(list(MAKERS)),
    changes=st.lists(
        st.tuples(st.floats(0.0, 1.0), st.binary(min_size=1, max_size=4)), min_size=1, max_size=4
    ),
)
@settings(max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damage_is_refused_or_read_over(
    whole_recordings: dict[str, Path], name: str, changes: list[tuple[float, bytes]]
) -> None:
    """Whatever the bytes: an InputError, or scans of numbers."""
    path = whole_recordings[name]
    file = storage(path)
    content = file.read_bytes()
    damaged = bytearray(content)
    for share, other in changes:
        at = int(share * (len(content) - 1))
        damaged[at : at + len(other)] = other
    file.write_bytes(damaged)
    try:
        for points in clouds(open_scans(path)):
            assert np.isfinite(points).all()
    except InputError:
        return
    finally:
        file.write_bytes(content)


@pytest.fixture(scope="module")
def whole_recordings(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A small recording of every kind, with poses."""
    made = {}
    for name, maker in MAKERS.items():
        messages = moving(types_of(maker), "base_link", "lidar")
        made[name] = maker(tmp_path_factory.mktemp("whole"), messages)
    return made


def test_the_files_of_a_ros2_bag_are_one_recording(tmp_path: Path) -> None:
    types = Types()
    for n in range(2):
        part = write_bag2(
            tmp_path / f"part{n}",
            types,
            [Message(f"/points{n}", 1.0 + n, types.cloud2(1.0 + n, "lidar", POINTS + n))] * 2,
        )
        (tmp_path / "bag").mkdir(exist_ok=True)
        next(part.glob("*.db3")).rename(tmp_path / f"bag/bag_{n}.db3")
    sequence = open_scans(tmp_path / "bag", topic="/points1")
    assert [scan.time_s for scan in sequence] == [2.0, 2.0]
    np.testing.assert_array_equal(clouds(sequence)[0], POINTS + 1)
    (tmp_path / "bag/other.mcap").touch()
    with pytest.raises(InputError, match=r"several recordings in it.*bag_0\.db3, .*other\.mcap"):
        open_scans(tmp_path / "bag")
    (tmp_path / "bag/metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 9\n  relative_file_paths:\n"
        "    - bag_1.db3\n    - bag_2.db3\n"
    )
    with pytest.raises(InputError, match=r"no file with messages in it \(bag_2\.db3\)"):
        open_scans(tmp_path / "bag")
    (tmp_path / "bag/metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 9\n  relative_file_paths: [bag_0.db3.zstd]\n"
    )
    with pytest.raises(InputError, match=r"no file with messages in it \(bag_0\.db3\.zstd\)"):
        open_scans(tmp_path / "bag")


def test_messages_packed_one_by_one(tmp_path: Path) -> None:
    import sqlite3
    from contextlib import closing

    from zstandard import ZstdCompressor

    types = Types()
    path = bag2_bare(tmp_path, [Message("/points", 1.0, types.cloud2(1.0, "lidar", POINTS))])
    with closing(sqlite3.connect(path)) as base, base:
        (data,) = base.execute("SELECT data FROM messages").fetchone()
        base.execute("UPDATE messages SET data = ?", (ZstdCompressor().compress(data),))
    np.testing.assert_array_equal(clouds(open_scans(path))[0], POINTS)


def test_mcap_whose_index_names_no_channels_and_its_checksums(tmp_path: Path) -> None:
    from mcap.writer import CompressionType, Writer

    types = Types()
    message = types.cloud2(1.0, "lidar", POINTS)
    text, _ = types.store.generate_msgdef(message.__msgtype__, ros_version=2)
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(
            file,
            compression=CompressionType.NONE,
            repeat_channels=False,
            repeat_schemas=False,
        )
        writer.start("ros2")
        schema = writer.register_schema(message.__msgtype__, "ros2msg", text.encode())
        channel = writer.register_channel("/points", "cdr", schema)
        writer.add_message(channel, 10**9, types.serialised(message), 10**9)
        writer.finish()
    path = tmp_path / "a.mcap"
    np.testing.assert_array_equal(clouds(open_scans(path))[0], POINTS)
    sound = np.float32(POINTS[2, 0]).tobytes()
    path.write_bytes(path.read_bytes().replace(sound, np.float32(POINTS[2, 0] + 1).tobytes()))
    with pytest.raises(InputError, match="CRCValidationError"):
        clouds(open_scans(path))


@pytest.mark.parametrize(
    ("name", "package", "extra"),
    [
        ("a.bag", "rosbags", "lidar"),
        ("a.mcap", "mcap", "lidar"),
        ("a.pcap", "ouster", "ouster"),
    ],
)
def test_missing_package_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, package: str, extra: str
) -> None:
    (tmp_path / name).write_bytes(b"something")
    without(monkeypatch, package)
    with pytest.raises(MissingExtraError, match=rf"clearway\[{extra}\]"):
        open_scans(tmp_path / name)
