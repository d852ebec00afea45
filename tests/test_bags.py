"""Robot recordings: bags of both ROSes and MCAP, their topics, poses and packets, real and made."""

from __future__ import annotations

import builtins
import importlib
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clearway.errors import InputError, MissingExtraError
from clearway.frames import world_from_body
from clearway.io.pointcloud import read_points
from clearway.io.sequences import open_scans
from clearway.io.timed_scans import ScanSequence
from clearway.io.velodyne import CALIBRATIONS, NAMED, model_pattern
from clearway.sensors import named_pattern
from robot_messages import Message, Types, write_bag1, write_bag2, write_bag2_of_mcap, write_mcap

POINTS = np.array([[1.0, 2.0, 3.0], [-4.5, 0.25, 0.0], [10.0, -2.0, 1.5], [7.0, 8.0, -9.0]])
QUARTER_LEFT = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
"""w, x, y, z of 90 degrees to the left."""

Maker = Callable[[Path, list[Message]], Path]


def bag1(folder: Path, messages: list[Message]) -> Path:
    return write_bag1(folder / "made.bag", Types(ros2=False), messages)


def bag2(folder: Path, messages: list[Message]) -> Path:
    return write_bag2(folder / "made", Types(), messages)


def bag2_of_mcap(folder: Path, messages: list[Message]) -> Path:
    return write_bag2_of_mcap(folder / "made", Types(), messages)


def bag2_bare(folder: Path, messages: list[Message]) -> Path:
    whole = bag2(folder, messages)
    (whole / "metadata.yaml").unlink()
    return next(whole.glob("*.db3"))


def bag2_younger(folder: Path, messages: list[Message]) -> Path:
    whole = bag2(folder, messages)
    metadata = whole / "metadata.yaml"
    metadata.write_text(re.sub(r"(?m)^(\s*version: )8", r"\g<1>9", metadata.read_text()))
    return whole


def mcap2(folder: Path, messages: list[Message]) -> Path:
    return write_mcap(folder / "made.mcap", Types(), messages)


def mcap2_plain(folder: Path, messages: list[Message]) -> Path:
    return write_mcap(folder / "made.mcap", Types(), messages, summary=False)


def mcap1(folder: Path, messages: list[Message]) -> Path:
    return write_mcap(folder / "made.mcap", Types(ros2=False), messages)


MAKERS = {
    "ROS 1 bag": bag1,
    "ROS 2 bag": bag2,
    "ROS 2 bag of MCAP": bag2_of_mcap,
    "ROS 2 bag without metadata": bag2_bare,
    "ROS 2 bag of Jazzy": bag2_younger,
    "MCAP": mcap2,
    "MCAP without index": mcap2_plain,
    "MCAP of ROS 1": mcap1,
}


def storage(path: Path) -> Path:
    """The file that holds the messages."""
    return next(p for p in path.iterdir() if p.suffix != ".yaml") if path.is_dir() else path


def types_of(maker: Maker) -> Types:
    return Types(ros2=maker not in (bag1, mcap1))


def clouds(sequence: ScanSequence) -> list[Any]:
    return [scan.read().points_m for scan in sequence]


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


def test_the_old_cloud_and_the_voxels_of_a_real_bag_are_the_same_place(data_dir: Path) -> None:
    from scipy.spatial import cKDTree

    path = data_dir / "maps/voxel/skir.bag"
    sequence = open_scans(path)
    assert "/cloud (sensor_msgs/msg/PointCloud)" in sequence.format
    ((scan,), (voxels,)) = (list(open_scans(path, topic=name)) for name in ("/cloud", "/voxel_map"))
    points, middles = scan.read().points_m, voxels.read().points_m
    assert points.shape == (290_725, 3)
    assert scan.time_s == pytest.approx(1514442808.9677, abs=1e-3)
    assert middles.shape == (50_409, 3)
    # Every occupied voxel has a point of the cloud in it: half its diagonal is 0.087 m.
    assert cKDTree(points).query(middles)[0].max() < 0.087


def test_velodyne_packets_against_their_truth(data_dir: Path) -> None:
    from scipy.spatial import cKDTree

    scans = list(open_scans(data_dir / "lidar/bag/vlp16_rosbag2"))
    assert len(scans) == 4
    last = scans[-1].read()
    assert last.points_m.shape == (14_816, 3)
    truth = read_points(data_dir / "lidar/pcd/vlp16_1673400472138016708.pcd").points_m
    assert len(truth) == 14_831
    for these, those in ((last.points_m, truth), (truth, last.points_m)):
        apart = cKDTree(those).query(these)[0]
        assert np.median(apart) < 0.006
        assert apart.max() < 0.07
    assert last.pattern is not None
    assert last.pattern.name == "vlp16"
    assert scans[0].time_s == pytest.approx(1673400471.7378, abs=1e-3)
    file = data_dir / "lidar/bag/vlp16_rosbag2/1673400471837873222_0.db3"
    assert [scan.time_s for scan in open_scans(file)] == [scan.time_s for scan in scans]


def test_lost_packets_are_no_evidence_of_free_space(data_dir: Path) -> None:
    """Of a real scan, packets 40 to 70 are lost: 31 of 151 parts of the turn."""
    pytest.importorskip("velodyne_decoder")
    from clearway.io.bag import open_bag
    from clearway.io.velodyne import VelodyneDecoder

    path = data_dir / "lidar/bag/vlp16_rosbag2"
    decoder = VelodyneDecoder(path)
    with open_bag(path) as bag:
        scan = bag.decoded(next(bag.messages(["/velodyne_packets"])))
    whole = decoder.cloud(scan, "whole")
    assert whole.complete
    assert whole.notes == ()
    scan.packets = scan.packets[:40] + scan.packets[71:]
    part = decoder.cloud(scan, "part")
    assert not part.complete
    assert part.notes == ("packets of 75 deg are missing",)
    assert part.pattern is not None
    assert part.pattern.beams == pytest.approx(28_800 * (1.0 - 75.0 / 360.0), rel=0.01)
    azimuth = np.arctan2(part.points_m[:, 1], part.points_m[:, 0])
    gone = np.setdiff1d(
        np.round(np.degrees(np.unique(named_pattern("vlp16").azimuth_rad))),
        np.round(np.degrees(np.unique(part.pattern.azimuth_rad))),
    )
    assert len(gone) == pytest.approx(74, abs=1)
    assert not np.isin(np.round(np.degrees(azimuth)), gone[2:-2]).any()


@pytest.mark.parametrize("model", [*CALIBRATIONS, *NAMED])
def test_beams_of_velodynes_by_name(model: str) -> None:
    pytest.importorskip("velodyne_decoder")
    pattern = model_pattern(model)
    assert pattern is not None
    lasers = len(np.unique(np.round(pattern.elevation_rad, 9)))
    assert lasers == {"VLS128": 128, "AlphaPrime": 128}.get(
        model, 32 if model in ("HDL32E", "VLP32A", "VLP32B", "VLP32C") else 16
    )
    assert pattern.beams % lasers == 0


def test_a_velodyne_whose_units_differ_has_no_beams_by_name() -> None:
    assert model_pattern("HDL64E_S2") is None


@pytest.mark.parametrize(
    ("name", "returns", "times_s"),
    [
        (
            "OS-1-128_v2.3.0_1024x10_lb_n3",
            (107_647, 107_357, 107_532),
            (991.587, 991.687, 991.787),
        ),
        ("OS-0-128-U1_v2.3.0_1024x10", (97_299,), (1462.559,)),
    ],
)
def test_ouster_packets(
    data_dir: Path, name: str, returns: tuple[int, ...], times_s: tuple[float, ...]
) -> None:
    pytest.importorskip("ouster.sdk")
    scans = list(open_scans(data_dir / f"lidar/ouster/{name}.pcap"))
    found = [scan.read() for scan in scans]
    assert tuple(len(cloud.points_m) for cloud in found) == returns
    assert [scan.time_s for scan in scans] == pytest.approx(times_s, abs=1e-3)
    ranges = np.linalg.norm(found[0].points_m, axis=1)
    nearest, farthest = (1.26, 216.8) if name.startswith("OS-1") else (0.24, 128.5)
    assert ranges.min() == pytest.approx(nearest, abs=0.05)
    assert ranges.max() == pytest.approx(farthest, abs=0.1)
    pattern = found[0].pattern
    assert pattern is not None
    assert pattern.beams == 128 * 1024
    assert pattern.max_range_m >= ranges.max()
    # Returns lie on the beams of the metadata: the beams' origins are centimetres off the middle.
    far = found[0].points_m[ranges > 10.0][::500]
    cosines = (far / np.linalg.norm(far, axis=1, keepdims=True)) @ pattern.directions.T
    assert np.degrees(np.arccos(np.clip(cosines.max(axis=1), -1, 1))).max() < 0.3


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
    with pytest.raises(InputError, match=r"bag_0\.db3\.zstd: packed by zstd; unpack"):
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


def test_a_capture_that_ends_in_a_packet_is_read_as_far_as_it_goes(
    data_dir: Path, tmp_path: Path
) -> None:
    pytest.importorskip("ouster.sdk")
    name = "OS-1-128_v2.3.0_1024x10"
    content = (data_dir / f"lidar/ouster/{name}_lb_n3.pcap").read_bytes()
    (tmp_path / "cut.pcap").write_bytes(content[: 6 * len(content) // 10])
    with pytest.raises(InputError, match=r"no metadata beside it: .* needs cut\.json.*: none"):
        open_scans(tmp_path / "cut.pcap")
    shutil.copy(data_dir / f"lidar/ouster/{name}.json", tmp_path / "cut.json")
    sequence = open_scans(tmp_path / "cut.pcap")
    assert any("cut off inside packet 133" in note for note in sequence.notes)
    whole, part = (scan.read() for scan in sequence)
    assert whole.complete
    assert len(whole.points_m) == 107_647
    assert not part.complete
    assert part.notes == ("208 of 1024 columns are missing",)
    # What did not come is no evidence of free space.
    assert part.pattern is not None
    assert part.pattern.beams == 128 * 816


@pytest.mark.parametrize("kept", [0, 10, 2000])
def test_damaged_ouster_metadata(data_dir: Path, tmp_path: Path, kept: int) -> None:
    pytest.importorskip("ouster.sdk")
    name = "OS-0-128-U1_v2.3.0_1024x10"
    shutil.copy(data_dir / f"lidar/ouster/{name}.pcap", tmp_path)
    content = (data_dir / f"lidar/ouster/{name}.json").read_bytes()
    (tmp_path / f"{name}.json").write_bytes(content[:kept])
    with pytest.raises(InputError, match=r"json: damaged or truncated Ouster metadata"):
        open_scans(tmp_path / f"{name}.pcap")


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


def test_packets_without_their_decoder_name_the_extra(
    data_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without(monkeypatch, "velodyne_decoder")
    with pytest.raises(MissingExtraError, match=r"clearway\[lidar\]"):
        next(iter(open_scans(data_dir / "lidar/bag/vlp16_rosbag2")))


def without(monkeypatch: pytest.MonkeyPatch, package: str) -> None:
    """Let a package be absent."""
    plain_import, plain_module = builtins.__import__, importlib.import_module

    def checked(name: str) -> None:
        if name.split(".")[0] == package:
            raise ImportError(name)

    def no_import(name: str, *args: Any, **kwargs: Any) -> Any:
        checked(name)
        return plain_import(name, *args, **kwargs)

    def no_module(name: str, package: str | None = None) -> Any:
        checked(name)
        return plain_module(name, package)

    monkeypatch.setattr(builtins, "__import__", no_import)
    monkeypatch.setattr("clearway.io.ouster.import_module", no_module)
