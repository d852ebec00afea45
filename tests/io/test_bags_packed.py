"""Livox's own messages, and ROS 2 bags packed by zstd: the same scans as without."""

from __future__ import annotations

import resource
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.io.samples import recordings
from clearway.io.scans import zstd
from clearway.io.scans.livox_message import points_of_livox
from clearway.io.scans.sequences import open_scans

pytest.importorskip("rosbags")


def scans_of(path: Path) -> list[np.ndarray]:
    return [scan.read().points_m for scan in open_scans(path)]


def made(path: Path, write) -> Path:
    write(path, np.random.default_rng(3))
    return path


@pytest.fixture(scope="module")
def flight(tmp_path_factory) -> list[np.ndarray]:
    return scans_of(made(tmp_path_factory.mktemp("plain") / "flight", recordings.write_bag2))


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("livox.bag", recordings.write_livox),
        ("livox", recordings.write_livox2),
        ("packed", recordings.write_bag2_packed),
        ("messages", recordings.write_bag2_messages),
    ],
)
def test_the_same_scans_in_another_form(name, write, flight, tmp_path):
    sequence = open_scans(made(tmp_path / name, write))
    assert [scan.state is None for scan in sequence] == [False] * len(flight)
    for one, other in zip(sequence, flight, strict=True):
        np.testing.assert_array_equal(one.read().points_m, other)


def livox(count: int, ros2: bool, order: str = "<") -> bytes:
    """A message of `count` points, by its definition."""
    text = b"lidar\0" if ros2 else b"lidar"
    head = b"" if ros2 else struct.pack(f"{order}I", 7)
    head += struct.pack(f"{order}III", 1, 2, len(text)) + text
    if ros2:
        head += bytes(-len(head) % 8)
    head += struct.pack(f"{order}QIB3xI", 10**9, count, 1, count)
    points = [struct.pack(f"{order}IfffBBB", n, n, 2 * n, -n, 9, 0, 1) for n in range(count)]
    body = b"\0".join(points) if ros2 else b"".join(points)
    return (bytes((0, order == "<", 0, 0)) if ros2 else b"") + head + body


@pytest.mark.parametrize(("ros2", "order"), [(False, "<"), (True, "<"), (True, ">")])
@pytest.mark.parametrize("count", [0, 1, 5])
def test_points_lie_where_the_definition_says(count, ros2, order):
    points = points_of_livox(livox(count, ros2, order), ros2)
    n = np.arange(count, dtype=float)
    np.testing.assert_array_equal(points, np.stack([n, 2 * n, -n], axis=1))


@pytest.mark.parametrize("ros2", [False, True])
def test_a_message_that_is_cut_off_is_refused(ros2):
    whole = livox(5, ros2)
    for length in range(20, len(whole)):
        with pytest.raises((ValueError, struct.error)):
            points_of_livox(whole[:length], ros2)


def test_packed_files_without_metadata_of_later_versions_and_alone(flight, tmp_path):
    bag = made(tmp_path / "bag", recordings.write_bag2_packed)
    (file,) = bag.glob("*.zstd")
    metadata = (bag / "metadata.yaml").read_text()
    (bag / "metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 9\n  relative_file_paths:\n"
        f"    - {file.name.removesuffix('.zstd')}\n  compression_mode: FILE\n"
    )
    np.testing.assert_array_equal(scans_of(bag)[-1], flight[-1])
    (bag / "metadata.yaml").unlink()
    np.testing.assert_array_equal(scans_of(bag)[0], flight[0])
    np.testing.assert_array_equal(scans_of(file)[0], flight[0])
    assert "zstd" in metadata
    alone = tmp_path / "points.pcd.zstd"
    alone.write_bytes(file.read_bytes())
    with pytest.raises(InputError, match=r"no file of a bag; valid: \.db3 or \.mcap before \.zstd"):
        scans_of(alone)


def test_packed_files_that_are_cut_off_damaged_or_too_large(tmp_path, monkeypatch):
    bag = made(tmp_path / "bag", recordings.write_bag2_packed)
    (file,) = bag.glob("*.zstd")
    whole = file.read_bytes()
    file.write_bytes(whole[:-100])
    with pytest.raises(InputError, match=r"truncated: the zstd data end after"):
        scans_of(bag)
    file.write_bytes(whole[:40] + b"\xff" * 40 + whole[80:])
    with pytest.raises(InputError, match=r"bag.*zstd"):
        scans_of(bag)
    file.write_bytes(whole)
    monkeypatch.setattr(zstd, "MOST_FILE_BYTES", 1000)
    monkeypatch.setattr(zstd, "MOST_RATIO", 0)
    with pytest.raises(InputError, match="unpacks to more than 1,000 bytes"):
        scans_of(bag)


def test_a_message_that_unpacks_without_end_is_refused(monkeypatch):
    from zstandard import ZstdCompressor

    monkeypatch.setattr(zstd, "MOST_MESSAGE_BYTES", 1000)
    assert zstd.unpack_message(ZstdCompressor().compress(bytes(1000))) == bytes(1000)
    with pytest.raises(ValueError, match="more than 1,000 bytes"):
        zstd.unpack_message(ZstdCompressor().compress(bytes(10**6)))


def test_a_message_takes_the_memory_that_it_needs():
    """A reader has 700 MB in all: no message takes as much as the largest may unpack to."""
    from zstandard import ZstdCompressor

    packed = ZstdCompressor().compress(bytes(10**6))
    tracemalloc.start()
    try:
        assert zstd.unpack_message(packed) == bytes(10**6)
        assert tracemalloc.get_traced_memory()[1] < 10**7
    finally:
        tracemalloc.stop()


def test_a_full_disk_of_temporary_files_is_no_damage(tmp_path, monkeypatch):
    path = made(tmp_path / "packed", recordings.write_bag2_packed)
    most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, most[1]))
    try:
        with pytest.raises(
            InputError, match=r"cannot be unpacked into .*File too large; let TMPDIR"
        ):
            open_scans(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, most)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "absent"))
    with pytest.raises(InputError, match="TMPDIR: cannot be written: No such file"):
        open_scans(path)
