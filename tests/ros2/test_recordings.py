"""A recorded bag through the same code as live topics."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.base.errors import InputError
from clearway.ros2.bag_bus import BagBus
from clearway.ros2.bus import USUAL
from clearway.ros2.messages import message_types, packed
from ros2_for_tests import BEGAN_S, cloud, odometry, transform

KINDS = {
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/odom": "nav_msgs/msg/Odometry",
    "/points": "sensor_msgs/msg/PointCloud2",
}


def recorded(folder: Path) -> list[tuple[str, bytes]]:
    """A bag of five moments; what is in it, in order."""
    from rosbags.rosbag2 import Writer

    told = [("/tf_static", 0.0, transform("lidar", "base_link", (0.2, 0.0, 0.1)))]
    for tick in range(5):
        now = 0.1 * tick
        told.append(("/points", now, cloud(BEGAN_S + now, [(5.0, 4.0, 0.0)])))
        told.append(("/odom", now + 0.001, odometry(BEGAN_S + now, (now, 0.0, 0.0))))
    raws = [(topic, packed(message)) for topic, _, message in told]
    with Writer(folder) as writer:
        by_topic = {
            topic: writer.add_connection(topic, kind, typestore=message_types())
            for topic, kind in KINDS.items()
        }
        for (topic, time_s, _), (_, raw) in zip(told, raws, strict=True):
            writer.write(by_topic[topic], round((BEGAN_S + time_s) * 1e9), raw)
    return raws


def test_a_recording_brings_what_was_recorded_in_its_order(tmp_path: Path) -> None:
    raws = recorded(tmp_path / "bag")
    bus = BagBus(tmp_path / "bag")
    for topic, kind in KINDS.items():
        bus.subscribe(topic, kind, USUAL)
    came, batches = [], 0
    while not bus.ended:
        came += bus.take()
        batches += 1
    bus.close()
    assert [(one.topic, one.raw) for one in came] == raws
    assert batches == 5


def test_a_topic_of_another_type_is_named(tmp_path: Path) -> None:
    recorded(tmp_path / "bag")
    with pytest.raises(InputError, match="is nav_msgs/msg/Odometry in the recording"):
        BagBus(tmp_path / "bag").subscribe("/odom", "geometry_msgs/msg/PoseStamped", USUAL)
