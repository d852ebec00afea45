"""Robot recordings: the same flight along the lane as a bag of ROS 1, of ROS 2, and as MCAP."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from clearway.io.samples.made_world import SPEED_MPS, place_at, sweep

POINTS = "/front/points"
ODOMETRY = "/odom"
COMMANDS = "/cmd_vel_in"
MOUNTING = "/tf_static"
COMMANDED_FROM_M = 10.0
COMMANDED_S = 3.5
COMMAND_S = 0.1
"""Of the recording in which somebody commands: where it begins, ahead of the house, how long it is,
and how often a command comes."""
SCANS = 6
PERIOD_S = 0.5
BEGIN_S = 1_767_225_600
"""2026-01-01T00:00:00Z."""
LIVOX = {
    "CustomPoint": "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\n"
    "uint8 reflectivity\nuint8 tag\nuint8 line",
    "CustomMsg": "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\n"
    "uint8[3] rsvd\nlivox_ros_driver2/CustomPoint[] points",
}


class Robot:
    """Messages as one of the two generations of ROS has them."""

    def __init__(self, ros2: bool, livox: bool = False) -> None:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self.ros2, self._livox = ros2, livox
        self.store = get_typestore(Stores.ROS2_HUMBLE if ros2 else Stores.ROS1_NOETIC)
        for name, text in LIVOX.items() if livox else ():
            self.store.register(get_types_from_msg(text, f"livox_ros_driver2/msg/{name}"))

    def _header(self, time_s: float, frame: str) -> Any:
        of, seconds = self.store.types, int(time_s)
        stamp = of["builtin_interfaces/msg/Time"](seconds, round((time_s - seconds) * 1e9))
        return of["std_msgs/msg/Header"](*(() if self.ros2 else (0,)), stamp, frame)

    def cloud(self, time_s: float, points: Any) -> Any:
        """sensor_msgs/PointCloud2 of [n, 3] as float32."""
        of = self.store.types
        field = of["sensor_msgs/msg/PointField"]
        data = np.frombuffer(points.astype("<f4").tobytes(), dtype=np.uint8)
        fields = [field(name, 4 * n, 7, 1) for n, name in enumerate("xyz")]
        return of["sensor_msgs/msg/PointCloud2"](
            self._header(time_s, "lidar"), 1, len(points), fields, False, 12, len(data), data, True
        )

    def livox(self, time_s: float, points: Any) -> Any:
        """livox_ros_driver2/CustomMsg of [n, 3]: one line after the other, within 0.1 s."""
        of = self.store.types
        one = of["livox_ros_driver2/msg/CustomPoint"]
        told = [
            one(int(1e8 * n / len(points)), *map(float, place), 20, 0x10, n % 4)
            for n, place in enumerate(points)
        ]
        unused = np.zeros(3, dtype=np.uint8)
        return of["livox_ros_driver2/msg/CustomMsg"](
            self._header(time_s, "lidar"), round(time_s * 1e9), len(told), 1, unused, told
        )

    def odometry(self, time_s: float, place_m: Any) -> Any:
        """nav_msgs/Odometry: level, along x."""
        of = self.store.types
        vector = of["geometry_msgs/msg/Vector3"]
        pose = of["geometry_msgs/msg/Pose"](
            of["geometry_msgs/msg/Point"](*map(float, place_m)),
            of["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
        )
        twist = of["geometry_msgs/msg/Twist"](vector(SPEED_MPS, 0.0, 0.0), vector(0.0, 0.0, 0.0))
        unknown = np.zeros(36)
        return of["nav_msgs/msg/Odometry"](
            self._header(time_s, "odom"),
            "base_link",
            of["geometry_msgs/msg/PoseWithCovariance"](pose, unknown),
            of["geometry_msgs/msg/TwistWithCovariance"](twist, unknown),
        )

    def make_mounting(self, time_s: float) -> Any:
        """tf2_msgs/TFMessage: the LiDAR in the middle of the body."""
        of = self.store.types
        transform = of["geometry_msgs/msg/Transform"](
            of["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0),
            of["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
        )
        stamped = of["geometry_msgs/msg/TransformStamped"]
        return of["tf2_msgs/msg/TFMessage"](
            [stamped(self._header(time_s, "base_link"), "lidar", transform)]
        )

    def command(self) -> Any:
        """geometry_msgs/Twist: straight ahead."""
        vector = self.store.types["geometry_msgs/msg/Vector3"]
        ahead, still = vector(SPEED_MPS, 0.0, 0.0), vector(0.0, 0.0, 0.0)
        return self.store.types["geometry_msgs/msg/Twist"](ahead, still)

    def make_commanded(self, rng: np.random.Generator) -> Iterator[tuple[str, int, str, bytes]]:
        """As `flight`: own positions, commands and scans of one who is flown straight at the
        house."""
        yield self._write(MOUNTING, BEGIN_S, self.make_mounting(BEGIN_S))
        every = round(PERIOD_S / COMMAND_S)
        for index in range(round(COMMANDED_S / COMMAND_S)):
            after_s = COMMAND_S * index
            time_s = BEGIN_S + after_s
            place = place_at(COMMANDED_FROM_M / SPEED_MPS + after_s)
            if index % every == 0:
                yield self._write(POINTS, time_s, self.cloud(time_s, sweep(rng, place)))
            yield self._write(ODOMETRY, time_s, self.odometry(time_s, place))
            yield self._write(COMMANDS, time_s, self.command())

    def _write(self, topic: str, time_s: float, value: Any) -> tuple[str, int, str, bytes]:
        write = self.store.serialize_cdr if self.ros2 else self.store.serialize_ros1
        kind = value.__msgtype__
        return topic, round(time_s * 1e9), kind, bytes(write(value, kind))

    def flight(self, rng: np.random.Generator) -> Iterator[tuple[str, int, str, bytes]]:
        """(topic, nanoseconds, type, serialised) in the order of time; the legs are seen too."""
        scan = self.livox if self._livox else self.cloud
        for index in range(SCANS):
            after_s = PERIOD_S * index
            time_s, place = BEGIN_S + after_s, place_at(after_s)
            for topic, value in (
                (ODOMETRY, self.odometry(time_s, place)),
                (POINTS, scan(time_s, sweep(rng, place, legs=True))),
            ):
                yield self._write(topic, time_s, value)


def write_bag(path: Path, rng: np.random.Generator) -> None:
    """A ROS 1 bag."""
    from rosbags.rosbag1 import Writer

    with Writer(path) as writer:
        _write(writer, Robot(ros2=False), rng)


def write_bag2(path: Path, rng: np.random.Generator) -> None:
    """The folder of a ROS 2 bag (SQLite)."""
    from rosbags.rosbag2 import Writer

    with Writer(path) as writer:
        _write(writer, Robot(ros2=True), rng)


def write_bag2_packed(path: Path, rng: np.random.Generator) -> None:
    """The same with its file packed by zstd."""
    _write_packed(path, rng, "FILE")


def write_bag2_messages(path: Path, rng: np.random.Generator) -> None:
    """The same with its messages packed by zstd, one by one."""
    _write_packed(path, rng, "MESSAGE")


def _write_packed(path: Path, rng: np.random.Generator, mode: str) -> None:
    from rosbags.rosbag2 import Writer

    writer = Writer(path)
    writer.set_compression(Writer.CompressionMode[mode], Writer.CompressionFormat.ZSTD)
    with writer:
        _write(writer, Robot(ros2=True), rng)


def write_livox(path: Path, rng: np.random.Generator) -> None:
    """A ROS 1 bag of Livox's own messages."""
    from rosbags.rosbag1 import Writer

    with Writer(path) as writer:
        _write(writer, Robot(ros2=False, livox=True), rng)


def write_livox2(path: Path, rng: np.random.Generator) -> None:
    """A ROS 2 bag of them."""
    from rosbags.rosbag2 import Writer

    with Writer(path) as writer:
        _write(writer, Robot(ros2=True, livox=True), rng)


def write_commanded(path: Path, rng: np.random.Generator) -> None:
    """A ROS 2 bag of a vehicle that somebody flies at the house."""
    from rosbags.rosbag2 import Writer

    robot = Robot(ros2=True)
    with Writer(path) as writer:
        _write_all(writer, robot, robot.make_commanded(rng))


def _write(writer: Any, robot: Robot, rng: np.random.Generator) -> None:
    _write_all(writer, robot, robot.flight(rng))


def _write_all(writer: Any, robot: Robot, messages: Iterable[tuple[str, int, str, bytes]]) -> None:
    known: dict[str, Any] = {}
    for topic, time_ns, kind, data in messages:
        if topic not in known:
            known[topic] = writer.add_connection(topic, kind, typestore=robot.store)
        writer.write(known[topic], time_ns, data)


def write_mcap_sample(path: Path, rng: np.random.Generator) -> None:
    """MCAP of ROS 2 messages."""
    from mcap.writer import CompressionType, Writer

    robot = Robot(ros2=True)
    with path.open("wb") as file:
        writer: Any = Writer(file, compression=CompressionType.ZSTD)
        writer.start("ros2", "clearway sample")
        channels: dict[str, int] = {}
        for topic, time_ns, kind, data in robot.flight(rng):
            if topic not in channels:
                text, _ = robot.store.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", text.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic], time_ns, data, time_ns)
        writer.finish()
