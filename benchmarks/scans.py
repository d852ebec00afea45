"""Speed of reading scans: 100,000 points of each format, beside the library that decodes it."""

from __future__ import annotations

import os
import struct
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.table import Benchmark, Row, Target
from benchmarks.timing import in_words, timed
from clearway.io.scans.scan_formats import read_points
from clearway.io.scans.sequences import open_scans

POINTS = 100_000
ALLOWED_S = 0.1
"""Beyond the library's own time, for 100,000 points."""
DATA = Path(
    os.environ.get("CLEARWAY_DATA", Path(__file__).resolve().parents[2] / "shared" / "data")
)
OUSTER = "lidar/ouster/OS-1-128_v2.3.0_1024x10_lb_n3"

Reading = tuple[Callable[[], object], Callable[[], object]]
"""Ours, and the library alone."""


def scattered() -> Any:
    """[n, 3] float32 within 100 m."""
    rng = np.random.default_rng(0)
    return rng.uniform(-50.0, 50.0, (POINTS, 3)).astype(np.float32)


@contextmanager
def pcd() -> Iterator[Reading]:
    from pypcd4 import PointCloud

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scan.pcd"
        PointCloud.from_points(scattered(), ("x", "y", "z"), (np.float32,) * 3).save(path)
        yield lambda: read_points(path), lambda: PointCloud.from_path(path)


@contextmanager
def las() -> Iterator[Reading]:
    import laspy

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tile.laz"
        data = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
        data.x, data.y, data.z = scattered().T.astype(np.float64)
        data.write(str(path))
        yield lambda: read_points(path), lambda: laspy.read(path).xyz


@contextmanager
def kitti() -> Iterator[Reading]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scan.bin"
        np.column_stack([scattered(), np.zeros(POINTS)]).astype("<f4").tofile(path)
        yield lambda: read_points(path), lambda: np.fromfile(path, "<f4")


def _cloud(types: Any) -> tuple[str, bytes]:
    """A serialised PointCloud2 as drivers write it: x, y, z, intensity."""
    of = types.types
    field = of["sensor_msgs/msg/PointField"]
    header = of["std_msgs/msg/Header"](of["builtin_interfaces/msg/Time"](1, 0), "lidar")
    data = np.column_stack([scattered(), np.zeros(POINTS)]).astype("<f4")
    fields = [field(name, 4 * n, 7, 1) for n, name in enumerate(("x", "y", "z", "intensity"))]
    name = "sensor_msgs/msg/PointCloud2"
    message = of[name](
        header, 1, POINTS, fields, False, 16, 16 * POINTS, data.view(np.uint8).ravel(), True
    )
    return name, bytes(types.serialize_cdr(message, name))


@contextmanager
def ros2_bag() -> Iterator[Reading]:
    from rosbags.highlevel import AnyReader
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_HUMBLE)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bag"
        name, raw = _cloud(types)
        with Writer(path) as writer:
            writer.write(writer.add_connection("/points", name, typestore=types), 1, raw)

        def library() -> None:
            with AnyReader([path], default_typestore=types) as reader:
                for connection, _, data in reader.messages():
                    reader.deserialize(data, connection.msgtype)

        yield lambda: read_points(path / "bag.db3"), library


@contextmanager
def mcap_file() -> Iterator[Reading]:
    from mcap.reader import make_reader
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    types = get_typestore(Stores.ROS2_HUMBLE)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scan.mcap"
        name, raw = _cloud(types)
        definition, _ = types.generate_msgdef(name, ros_version=2)
        with path.open("wb") as file:
            writer = Writer(file)
            writer.start("ros2")
            schema = writer.register_schema(name, "ros2msg", definition.encode())
            writer.add_message(writer.register_channel("/points", "cdr", schema), 1, raw, 1)
            writer.finish()

        def library() -> None:
            with path.open("rb") as file:
                for schema, _, message in make_reader(file).iter_messages():
                    store = get_typestore(Stores.EMPTY)
                    assert schema is not None
                    store.register(get_types_from_msg(schema.data.decode(), schema.name))
                    store.deserialize_cdr(message.data, schema.name)

        yield lambda: read_points(path), library


def velodyne_packets() -> list[bytes]:
    """A VLP-16 in a round room: packets of 12 blocks of two firings, until there are 100,000."""
    packets = []
    returns = b"".join(struct.pack("<HB", 2500 + 10 * n, 100) for n in range(32))
    for number in range(POINTS // 384 + 1):
        blocks = b"".join(
            struct.pack("<HH", 0xEEFF, (number * 480 + 40 * block) % 36_000) + returns
            for block in range(12)
        )
        packets.append(blocks + struct.pack("<IBB", number * 1_330, 0x37, 0x22))
    return packets


@contextmanager
def velodyne() -> Iterator[Reading]:
    import velodyne_decoder
    from rosbags.highlevel import AnyReader
    from rosbags.rosbag2 import Writer

    from clearway.io.scans.bag import ros2_types

    types = ros2_types()
    of = types.types
    stamp = of["builtin_interfaces/msg/Time"](1, 0)
    packet, name = of["velodyne_msgs/msg/VelodynePacket"], "velodyne_msgs/msg/VelodyneScan"
    scan = of[name](
        of["std_msgs/msg/Header"](stamp, "velodyne"),
        [packet(stamp, np.frombuffer(data, np.uint8)) for data in velodyne_packets()],
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bag"
        with Writer(path) as writer:
            connection = writer.add_connection("/packets", name, typestore=types)
            writer.write(connection, 1, bytes(types.serialize_cdr(scan, name)))

        def library() -> None:
            decoder = velodyne_decoder.ScanDecoder(velodyne_decoder.Config())
            with AnyReader([path], default_typestore=types) as reader:
                for connection, _, data in reader.messages():
                    found: Any = reader.deserialize(data, connection.msgtype)
                    decoder.decode(
                        velodyne_decoder.PacketVector(
                            [velodyne_decoder.VelodynePacket(1.0, p.data) for p in found.packets]
                        )
                    )

        assert len(read_points(path / "bag.db3").points_m) >= POINTS
        yield lambda: read_points(path / "bag.db3"), library


@contextmanager
def ouster() -> Iterator[Reading]:
    import ouster.sdk
    from ouster.sdk import core

    path = DATA / f"{OUSTER}.pcap"
    if not path.is_file():
        raise FileNotFoundError(path)
    opened: Any = ouster.sdk

    def library() -> None:
        source = opened.open_source(str(path))
        points_of = core.XYZLut(source.sensor_info[0])
        for frames in source:
            points_of(frames[0].field("RANGE"))

    yield lambda: [scan.read() for scan in open_scans(path)], library


FORMATS: dict[str, tuple[str, Callable[[], Any], float]] = {
    "PCD": ("binary PCD, beside pypcd4", pcd, 1.0),
    "LAZ": ("LAZ, beside laspy", las, 1.0),
    "KITTI": ("KITTI .bin, beside numpy.fromfile", kitti, 1.0),
    "ROS 2 bag": ("PointCloud2 in a ROS 2 bag, beside rosbags", ros2_bag, 1.0),
    "MCAP": ("PointCloud2 in an MCAP file, beside mcap and rosbags", mcap_file, 1.0),
    "Velodyne": ("Velodyne packets in a ROS 2 bag, beside rosbags and velodyne-decoder", velodyne,
                 1.0),
    "Ouster": ("three sweeps of an Ouster OS-1-128, beside ouster-sdk", ouster, 3.2),
}  # fmt: skip
"""By name: in words, how to make it, and how many times 100,000 points there are."""


def reading(name: str) -> Callable[[bool], Row]:
    """One format read, and what is spent beyond the library."""

    def measure(quick: bool) -> Row:
        words, make, amount = FORMATS[name]
        try:
            with make() as (ours, library):
                own = timed(library, quick)
                all_of_it = timed(ours, quick)
        except FileNotFoundError as absent:
            return Row(words, "no data", f"needs {absent}")
        beyond = (all_of_it.median_s - own.median_s) / amount
        return Row(
            f"100,000 points of {words}" if amount == 1.0 else f"{words}, 322,536 points",
            in_words(all_of_it.median_s),
            all_of_it.spread,
            Target(f"<= {in_words(ALLOWED_S)} beyond the library", beyond <= ALLOWED_S),
            f"the library alone {in_words(own.median_s)}, "
            f"{max(0.0, beyond) * 1e3:.1f} ms beyond it for 100,000 points, "
            f"{all_of_it.median_s / own.median_s:.1f} x its time",
        )

    return measure


BENCHMARKS = tuple(
    Benchmark(f"scans, {name}", reading(name), headline=name == "ROS 2 bag") for name in FORMATS
)
