"""Robot recordings made for tests: ROS 1 and ROS 2 bags and MCAP files with chosen messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from clearway.io.scans.cloud_message import FIELD_TYPES

Stamp = tuple[int, int]
IDENTITY = (1.0, 0.0, 0.0, 0.0)
NUMBERS = {name: number for number, name in FIELD_TYPES.items()}


class Message(NamedTuple):
    """One message to record."""

    topic: str
    time_s: float
    value: Any


def cloud2(
    points: Any,
    *,
    types: Sequence[str] = ("f4", "f4", "f4"),
    offsets: Sequence[int] = (0, 4, 8),
    point_step: int = 12,
    height: int = 1,
    row_padding: int = 0,
    big_endian: bool = False,
    names: Sequence[str] = ("x", "y", "z"),
) -> SimpleNamespace:
    """What a sensor_msgs/PointCloud2 of [n, 3] says, in any layout."""
    points = np.asarray(points)
    order = ">" if big_endian else "<"
    layout = np.dtype(
        {
            "names": list(names),
            "formats": [order + kind for kind in types],
            "offsets": list(offsets),
            "itemsize": point_step,
        }
    )
    table = np.full(len(points) * point_step, 0xAB, dtype=np.uint8).view(layout)
    for column, name in enumerate(names):
        table[name] = points[:, column]
    width = len(points) // height
    rows = table.view(np.uint8).reshape(height, width * point_step)
    padding = np.full((height, row_padding), 0xCD, dtype=np.uint8)
    return SimpleNamespace(
        height=height,
        width=width,
        fields=[
            SimpleNamespace(name=name, offset=offset, datatype=NUMBERS[kind], count=1)
            for name, offset, kind in zip(names, offsets, types, strict=True)
        ],
        is_bigendian=big_endian,
        point_step=point_step,
        row_step=width * point_step + row_padding,
        data=np.concatenate([rows, padding], axis=1).ravel(),
    )


class Types:
    """Messages of ROS 1 or ROS 2 as rosbags makes them."""

    def __init__(self, ros2: bool = True) -> None:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self.ros2 = ros2
        self.store = get_typestore(Stores.ROS2_HUMBLE if ros2 else Stores.ROS1_NOETIC)
        if not ros2:
            words = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(words, "tf2_msgs/msg/TFMessage"))
        self._of = self.store.types

    def stamp(self, time_s: float) -> Any:
        seconds = int(time_s)
        return self._of["builtin_interfaces/msg/Time"](seconds, round((time_s - seconds) * 1e9))

    def header(self, time_s: float, frame: str) -> Any:
        sequence = () if self.ros2 else (0,)
        return self._of["std_msgs/msg/Header"](*sequence, self.stamp(time_s), frame)

    def cloud2(self, time_s: float, frame: str, points: Any, **layout: Any) -> Any:
        like = cloud2(points, **layout)
        field = self._of["sensor_msgs/msg/PointField"]
        return self._of["sensor_msgs/msg/PointCloud2"](
            self.header(time_s, frame),
            like.height,
            like.width,
            [field(one.name, one.offset, one.datatype, one.count) for one in like.fields],
            like.is_bigendian,
            like.point_step,
            like.row_step,
            like.data,
            False,
        )

    def cloud(self, time_s: float, frame: str, points: Any) -> Any:
        point = self._of["geometry_msgs/msg/Point32"]
        rows = [point(*map(float, row)) for row in points]
        return self._of["sensor_msgs/msg/PointCloud"](self.header(time_s, frame), rows, [])

    def _pose(self, position: Sequence[float], turn: Sequence[float]) -> Any:
        w, x, y, z = turn
        return self._of["geometry_msgs/msg/Pose"](
            self._of["geometry_msgs/msg/Point"](*position),
            self._of["geometry_msgs/msg/Quaternion"](x, y, z, w),
        )

    def odometry(
        self,
        time_s: float,
        position: Sequence[float],
        turn: Sequence[float] = IDENTITY,
        variances: Sequence[float] = (0.0,) * 6,
    ) -> Any:
        """variances: of x, y, z and of the turns about them."""
        zero = self._of["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
        twist = self._of["geometry_msgs/msg/Twist"](zero, zero)
        covariance = np.diag(np.asarray(variances, dtype=np.float64)).ravel()
        return self._of["nav_msgs/msg/Odometry"](
            self.header(time_s, "odom"),
            "base_link",
            self._of["geometry_msgs/msg/PoseWithCovariance"](
                self._pose(position, turn), covariance
            ),
            self._of["geometry_msgs/msg/TwistWithCovariance"](twist, covariance),
        )

    def transform(
        self,
        time_s: float,
        parent: str,
        child: str,
        position: Sequence[float],
        turn: Sequence[float] = IDENTITY,
    ) -> Any:
        w, x, y, z = turn
        one = self._of["geometry_msgs/msg/TransformStamped"](
            self.header(time_s, parent),
            child,
            self._of["geometry_msgs/msg/Transform"](
                self._of["geometry_msgs/msg/Vector3"](*position),
                self._of["geometry_msgs/msg/Quaternion"](x, y, z, w),
            ),
        )
        return self._of["tf2_msgs/msg/TFMessage"]([one])

    def text(self, words: str) -> Any:
        return self._of["std_msgs/msg/String"](words)

    def serialised(self, value: Any) -> bytes:
        write = self.store.serialize_cdr if self.ros2 else self.store.serialize_ros1
        return bytes(write(value, value.__msgtype__))


def write_bag1(path: Path, types: Types, messages: Sequence[Message]) -> Path:
    """A ROS 1 bag."""
    from rosbags.rosbag1 import Writer

    with Writer(path) as writer:
        _write(writer, types, messages)
    return path


def write_bag2(folder: Path, types: Types, messages: Sequence[Message]) -> Path:
    """The folder of a ROS 2 bag."""
    from rosbags.rosbag2 import Writer

    with Writer(folder) as writer:
        _write(writer, types, messages)
    return folder


def _write(writer: Any, types: Types, messages: Sequence[Message]) -> None:
    connections: dict[str, Any] = {}
    for topic, time_s, value in messages:
        if topic not in connections:
            connections[topic] = writer.add_connection(
                topic, value.__msgtype__, typestore=types.store
            )
        writer.write(connections[topic], round(time_s * 1e9), types.serialised(value))


def write_mcap(path: Path, types: Types, messages: Sequence[Message], summary: bool = True) -> Path:
    """An MCAP file of ROS 2 or ROS 1 messages."""
    from mcap.writer import CompressionType, IndexType, Writer

    with path.open("wb") as file:
        writer = Writer(
            file,
            compression=CompressionType.ZSTD,
            index_types=IndexType.ALL if summary else IndexType.NONE,
            repeat_channels=summary,
            repeat_schemas=summary,
            use_statistics=summary,
            use_summary_offsets=summary,
        )
        writer.start("ros2" if types.ros2 else "ros1")
        channels: dict[str, int] = {}
        for topic, time_s, value in messages:
            if topic not in channels:
                name = value.__msgtype__ if types.ros2 else value.__msgtype__.replace("/msg/", "/")
                text, _ = types.store.generate_msgdef(
                    value.__msgtype__, ros_version=2 if types.ros2 else 1
                )
                kind = "ros2msg" if types.ros2 else "ros1msg"
                schema = writer.register_schema(name, kind, text.encode())
                encoding = "cdr" if types.ros2 else "ros1"
                channels[topic] = writer.register_channel(topic, encoding, schema)
            time_ns = round(time_s * 1e9)
            writer.add_message(channels[topic], time_ns, types.serialised(value), time_ns)
        writer.finish()
    return path


METADATA = """\
rosbag2_bagfile_information:
  version: 8
  storage_identifier: mcap
  duration: {{nanoseconds: 1}}
  starting_time: {{nanoseconds_since_epoch: 0}}
  message_count: {total}
  topics_with_message_count:
{topics}
  compression_format: ""
  compression_mode: ""
  relative_file_paths: [bag_0.mcap]
  custom_data: ~
  ros_distro: jazzy
"""
TOPIC = """\
    - topic_metadata: {{name: {name}, type: {kind}, serialization_format: cdr,
        offered_qos_profiles: [], type_description_hash: ""}}
      message_count: {count}"""


def write_bag2_of_mcap(folder: Path, types: Types, messages: Sequence[Message]) -> Path:
    """The folder of a ROS 2 bag that keeps its messages in an MCAP file."""
    folder.mkdir()
    write_mcap(folder / "bag_0.mcap", types, messages)
    counts = Counter((topic, value.__msgtype__) for topic, _, value in messages)
    topics = "\n".join(
        TOPIC.format(name=name, kind=kind, count=count) for (name, kind), count in counts.items()
    )
    (folder / "metadata.yaml").write_text(METADATA.format(total=len(messages), topics=topics))
    return folder
