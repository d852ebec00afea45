"""Recordings with bytes broken amid them: packed chunks, pages, and whatever one message holds."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import clearway as cw
from clearway.base.errors import InputError
from clearway.io.scans.sequences import open_scans
from clearway.io.scans.usable import LeftOut
from recordings_for_tests import (
    MAKERS,
    POINTS,
    Maker,
    bag1,
    bag2,
    bag2_bare,
    clouds,
    storage,
    types_of,
)
from robot_messages import Message, Types


def spoiled(content: bytes, at: int, count: int) -> bytes:
    noise = np.random.default_rng(at).bytes(count)
    return content[:at] + noise + content[at + count :]


def packed_bag1(folder: Path, messages: list[Message]) -> Path:
    """A ROS 1 bag of chunks that are packed."""
    from rosbags.rosbag1 import Writer

    types, path = Types(ros2=False), folder / "made.bag"
    writer = Writer(path)
    writer.set_compression(Writer.CompressionFormat.BZ2)
    writer.chunk_threshold = 20_000
    with writer:
        known = writer.add_connection(
            "/points", messages[0].value.__msgtype__, typestore=types.store
        )
        for message in messages:
            data = types.serialised(message.value)
            writer.write(known, round(1e9 * message.time_s), data)
    return path


def chunks_of_mcap(folder: Path, messages: list[Message]) -> Path:
    """An MCAP file of several chunks."""
    from mcap.writer import CompressionType, Writer

    types, path = Types(), folder / "made.mcap"
    kind = messages[0].value.__msgtype__
    text, _ = types.store.generate_msgdef(kind, ros_version=2)
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=20_000, compression=CompressionType.ZSTD)
        writer.start("ros2")
        schema = writer.register_schema(kind, "ros2msg", str(text).encode())
        channel = writer.register_channel("/points", "cdr", schema)
        for message in messages:
            at_ns = round(1e9 * message.time_s)
            writer.add_message(channel, at_ns, types.serialised(message.value), at_ns)
        writer.finish()
    return path


@pytest.mark.parametrize("maker", [packed_bag1, chunks_of_mcap])
def test_a_broken_chunk_is_read_past(maker: Maker, tmp_path: Path) -> None:
    """Noise where one chunk is: what it held is counted, all else comes in its order."""
    types, rng = Types(ros2=maker is not packed_bag1), np.random.default_rng(1)
    many = [rng.normal(5.0, 1.0, (700, 3)).astype(np.float32) for _ in range(12)]
    messages = [
        Message("/points", 1.0 + n, types.cloud2(1.0 + n, "lidar", points))
        for n, points in enumerate(many)
    ]
    path = maker(tmp_path, messages)
    content = path.read_bytes()
    for share in (0.3, 0.45, 0.6):
        path.write_bytes(spoiled(content, int(share * len(content)), 400))
        left_out, found = LeftOut(), []
        for scan in open_scans(path):
            cloud = left_out.read(scan)
            if cloud is not None:
                found.append(scan.index)
                np.testing.assert_array_equal(cloud.points_m, many[round(scan.time_s) - 1])
        assert 6 <= len(found) < 12
        assert left_out.counts == {"damaged": 12 - len(found)}
    assert found == sorted(found)


@pytest.mark.parametrize("maker", [bag2, bag2_bare])
def test_messages_packed_by_zstd_may_be_broken(maker: Maker, tmp_path: Path) -> None:
    import sqlite3
    from contextlib import closing

    from zstandard import ZstdCompressor

    types = Types()
    messages = [
        Message("/points", 1.0 + n, types.cloud2(1.0 + n, "lidar", POINTS)) for n in range(3)
    ]
    path = maker(tmp_path, messages)
    with closing(sqlite3.connect(storage(path))) as base, base:
        for number, data in base.execute("SELECT id, data FROM messages").fetchall():
            small = ZstdCompressor().compress(data)
            small = small if number != 2 else small[: len(small) // 2]
            base.execute("UPDATE messages SET data = ? WHERE id = ?", (small, number))
    if path.is_dir():
        metadata = path / "metadata.yaml"
        text = metadata.read_text().replace("compression_mode: ''", "compression_mode: MESSAGE")
        metadata.write_text(text)
    scans = cw.read_scans(path)
    assert [scan.index for scan in scans] == [0, 2]
    assert scans.left_out == {"damaged": 1}


@given(
    name=st.sampled_from(list(MAKERS)),
    number=st.integers(0, 14),
    how=st.sampled_from(["cut", "noise", "bytes"]),
    seed=st.integers(0, 2**20),
)
@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_one_message_holds_all_others_are_read(
    tmp_path_factory: pytest.TempPathFactory, name: str, number: int, how: str, seed: int
) -> None:
    """A cloud, an own place or a transform of any bytes, in every kind of recording."""
    maker, rng = MAKERS[name], np.random.default_rng(seed)
    types = types_of(maker)
    messages = []
    for n in range(5):
        time_s = 1.0 + n
        messages += [
            Message("/odom", time_s, types.odometry(time_s, (float(n), 0.0, 2.0))),
            Message("/tf", time_s, types.transform(time_s, "base_link", "lidar", (0.0, 0.0, 0.1))),
            Message("/points", time_s, types.cloud2(time_s, "lidar", POINTS)),
        ]
    path = maker(tmp_path_factory.mktemp("one"), messages)
    raw = types.serialised(messages[number].value)
    other = bytearray(raw)
    if how == "bytes":
        for at in rng.integers(0, len(raw), 3):
            other[at] = rng.integers(256)
    else:
        start = int(rng.integers(0, len(raw))) if how == "cut" else 0
        other[start:] = rng.bytes(len(raw) - start)
    _overwrite(storage(path), raw, bytes(other))
    left_out, found = LeftOut(), 0
    for scan in open_scans(path):
        cloud = left_out.read(scan)
        found += cloud is not None
        assert cloud is None or np.isfinite(cloud.points_m).all()
    assert found >= 4
    assert found + sum(left_out.counts.values()) == 5


def _overwrite(file: Path, raw: bytes, other: bytes) -> None:
    """Other bytes in the place of a message, if it stands in the file as it is."""
    content = file.read_bytes()
    if content.count(raw) == 1:
        file.write_bytes(content.replace(raw, other))


def test_own_places_that_are_broken_are_counted(tmp_path: Path) -> None:
    types, places = Types(ros2=False), [(float(n), 0.0, 2.0) for n in range(3)]
    told = [types.odometry(1.0 + n, place) for n, place in enumerate(places)]
    messages = [Message("/odom", 1.0 + n, one) for n, one in enumerate(told)]
    messages += [
        Message("/points", 1.0 + n, types.cloud2(1.0 + n, "lidar", POINTS)) for n in range(3)
    ]
    path, raw = bag1(tmp_path, messages), types.serialised(told[1])
    frame_at, endless = 12, struct.pack("<I", 2**31)
    _overwrite(path, raw, raw[:frame_at] + endless + raw[frame_at + 4 :])
    sequence = open_scans(path)
    assert len(clouds(sequence)) == 3
    assert any("1 damaged messages of /odom left out" in note for note in sequence.notes)
    first, amid, last = sequence
    assert amid.state is None
    for scan, place in ((first, places[0]), (last, places[2])):
        assert scan.state is not None
        np.testing.assert_allclose(scan.state.position_m, place)


@pytest.mark.parametrize("maker", [bag2, bag2_bare])
def test_a_broken_page_of_a_database_is_read_past(maker: Maker, tmp_path: Path) -> None:
    """As a bad sector of a disk leaves it: zeros amid one message."""
    types, rng = Types(), np.random.default_rng(1)
    many = [rng.normal(5.0, 1.0, (2000, 3)).astype(np.float32) for _ in range(12)]
    path = maker(
        tmp_path,
        [
            Message("/points", 1.0 + n, types.cloud2(1.0 + n, "lidar", points))
            for n, points in enumerate(many)
        ],
    )
    file = storage(path)
    at = file.read_bytes().index(many[4][1000:1100].tobytes())
    content = bytearray(file.read_bytes())
    content[at : at + 5000] = bytes(5000)
    file.write_bytes(content)
    scans = cw.read_scans(path)
    found = {scan.index: scan.points_m for scan in scans}
    assert sorted(found) == [n for n in range(12) if n != 4]
    assert scans.left_out == {"damaged": 1}
    for n, points in found.items():
        np.testing.assert_array_equal(points, many[n])


def test_fewer_messages_than_the_metadata_promise_are_refused(tmp_path: Path) -> None:
    types = Types()
    messages = [
        Message("/points", 1.0 + n, types.cloud2(1.0 + n, "lidar", POINTS)) for n in range(3)
    ]
    metadata = bag2(tmp_path, messages) / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("message_count: 3", "message_count: 4"))
    with pytest.raises(InputError, match=r"truncated: 4 messages promised by metadata\.yaml, 3 "):
        open_scans(tmp_path / "made")
