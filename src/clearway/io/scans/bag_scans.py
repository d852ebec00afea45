"""Scans of a robot recording: which topic, its messages as clouds, its poses."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from clearway.base.errors import InputError
from clearway.base.frames import FloatArray
from clearway.base.suggest import did_you_mean
from clearway.io.foreign_errors import COMPLAINTS, damage_told
from clearway.io.poses.bag_poses import BagPoses, poses_of_bag
from clearway.io.scans.bag import Bag, RawMessage, Topic
from clearway.io.scans.cloud_message import (
    Header,
    points_of_cloud,
    points_of_cloud2,
    points_of_voxels,
    read_message_header,
)
from clearway.io.scans.livox_message import TYPES as LIVOX
from clearway.io.scans.livox_message import points_of_livox
from clearway.io.scans.open_bag import open_bag
from clearway.io.scans.pointcloud import PointCloud, clean_cloud
from clearway.io.scans.timed_scans import NO_POSES, ScanSequence, TimedScan
from clearway.io.scans.velodyne import VelodyneDecoder

CLOUD2 = "sensor_msgs/msg/PointCloud2"
CLOUD = "sensor_msgs/msg/PointCloud"
PACKETS = "velodyne_msgs/msg/VelodyneScan"
VOXELS = "planning_ros_msgs/msg/VoxelMap"
SCANS = (CLOUD2, CLOUD, PACKETS, *LIVOX)
LOOKED_AT = 100
"""Messages in search of a sound one."""
POINTS = (*SCANS, VOXELS)
"""Types with points; a map of voxels is only taken where it is asked for, or alone."""


def bag_scans(path: Path, topic: str | None = None, poses: str | None = None) -> ScanSequence:
    """The scans of a topic of a .bag, a ROS 2 bag's folder or .db3, or an .mcap.

    poses: topic of odometry or poses; by default the first one, else the transforms. Raises
    InputError listing the valid topics where there is none, or several and none is chosen.
    """
    with open_bag(path) as bag:
        chosen = _choose_topic(path, bag.topics, topic)
        frame = _find_frame(path, bag, chosen)
        where = poses_of_bag(path, bag, frame, poses)
        kind = f"{bag.kind}, {chosen.name} ({chosen.type}), frame {frame or 'unnamed'}"

    def scans() -> Iterator[TimedScan]:
        with open_bag(path) as bag:
            reader = _reader(path, bag, chosen)
            for index, message in enumerate(bag.messages([chosen.name])):
                yield _scan(path, index, message, frame, reader, where)

    notes = tuple(f"{path}: {note}" for note in where.notes)
    span = NO_POSES if where.track is None else f"{len(where.track.time_s)} poses"
    return ScanSequence(str(path), kind, scans, where.mounting, notes, span, frame)


def _choose_topic(path: Path, topics: tuple[Topic, ...], name: str | None) -> Topic:
    """The topic asked for, or the only one with scans."""
    known = [topic for topic in topics if topic.type in POINTS]
    if name is not None:
        known = [topic for topic in known if topic.name == name]
    elif len(known) > 1:
        known = [topic for topic in known if topic.type in SCANS]
    if len(known) == 1:
        return known[0]
    there = [topic for topic in topics if topic.type in POINTS]
    if name is not None:
        cause = f"no points of topic {name!r}{did_you_mean(name, [one.name for one in there])}"
    elif there:
        cause = "several topics with points: choose one (--topic, `topic` of [scan])"
    else:
        cause = "no topic with points"
        if any("ouster" in topic.type and "Packet" in topic.type for topic in topics):
            cause += (
                "; it holds raw packets of an Ouster LiDAR: save them as such (`ouster-cli source "
                "BAG save FILE.pcap`), or play them through its driver and record its points"
            )
    valid = "; valid: " + _list_topics(there) if there else "; it has " + _list_topics(topics)
    raise InputError(str(path), cause + valid)


def _list_topics(topics: tuple[Topic, ...] | list[Topic]) -> str:
    return (
        ", ".join(f"{one.name} ({one.type}, {one.messages} messages)" for one in topics) or "none"
    )


def _reader(path: Path, bag: Bag, topic: Topic) -> Callable[[RawMessage], PointCloud]:
    """How messages of a topic become clouds."""
    if topic.type == PACKETS:
        decoder = VelodyneDecoder(path)
        return lambda message: decoder.cloud(bag.decoded(message), _name(path, message))
    readers: dict[str, Callable[[RawMessage], FloatArray]] = {
        CLOUD2: lambda message: points_of_cloud2(bag.decoded(message)),
        CLOUD: lambda message: points_of_cloud(message.raw, message.ros2),
        VOXELS: lambda message: points_of_voxels(bag.decoded(message)),
        **dict.fromkeys(LIVOX, lambda message: points_of_livox(message.raw, message.ros2)),
    }
    points_of = readers[topic.type]
    return lambda message: PointCloud(
        points_of(message), None, None, "metres", _name(path, message)
    )


def _find_frame(path: Path, bag: Bag, topic: Topic) -> str:
    """The frame of the first message that can be read; of damaged ones only if all first ones are.

    Noise may look like a header, hardly ever like a cloud.
    """
    reader, frames, found = _reader(path, bag, topic), [], 0
    for message in bag.messages([topic.name]):
        found += 1
        header = _header(message)
        if header is not None:
            with suppress(InputError), damage_told(path, message.type):
                reader(message)
                return header.frame
            frames.append(header.frame)
        if frames and found >= LOOKED_AT:
            break
    if frames:
        return frames[0]
    if not found:
        raise InputError(str(path), f"no message of topic {topic.name} in it")
    raise InputError(
        str(path), f"damaged or truncated: none of the {found} messages of {topic.name} can be read"
    )


def _scan(
    path: Path,
    index: int,
    message: RawMessage,
    frame: str,
    reader: Callable[[RawMessage], PointCloud],
    poses: BagPoses,
) -> TimedScan:
    """A scan of a message, which may be damaged or of another frame: reading it tells."""
    header = _header(message)
    time_s = message.logged_s if header is None else header.time_s or message.logged_s

    def read() -> PointCloud:
        source = f"{path} scan {index}"
        if header is None:
            raise InputError(source, f"damaged message ({message.damage or 'no header'})")
        if header.frame and frame and header.frame.lstrip("/") != frame.lstrip("/"):
            other = f"its frame is {header.frame!r}, that of the first one {frame!r}"
            raise InputError(source, other)
        with damage_told(source, message.type):
            return clean_cloud(reader(message))

    return TimedScan(index, time_s, None if poses.track is None else poses.track.at(time_s), read)


def _header(message: RawMessage) -> Header | None:
    """The header of a message; None where it is damaged."""
    try:
        return None if message.damage else read_message_header(message.raw, message.ros2)
    except COMPLAINTS:
        return None


def _name(path: Path, message: RawMessage) -> str:
    return f"{path} {message.topic}"
