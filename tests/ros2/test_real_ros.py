"""Nodes of real ROS 2, of each distribution that is there, heard without ROS."""

from __future__ import annotations

import time
from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.ros2.bus import SENSOR
from clearway.ros2.dds import DdsBus
from clearway.ros2.messages import unpack_cdr
from clearway.ros2.rclpy_bus import PROFILES
from repository import REPOSITORY
from ros2_for_tests import LOOPBACK
from ros2_processes import all_ended
from ros_pythons import NO_ROS, PYTHONS, ROS_DOMAIN, begun_in_ros

PROFILE = REPOSITORY / "examples" / "ros2" / "fast_dds.xml"
PEERS = (
    "<builtin><initialPeersList><locator><udpv4><address>127.0.0.1</address></udpv4></locator>"
    "</initialPeersList></builtin>"
)
WHITE_LIST = "<interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList>"
KINDS = {"/odom": "nav_msgs/msg/Odometry", "/points": "sensor_msgs/msg/PointCloud2"}
TALKER = """
import time, rclpy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import PointCloud2, PointField
rclpy.init()
node = rclpy.create_node("talker")
odom = node.create_publisher(Odometry, "/odom", 10)
points = node.create_publisher(PointCloud2, "/points", 10)
for number in range(300):
    told = Odometry()
    told.header.frame_id, told.pose.pose.position.x = "map", float(number)
    odom.publish(told)
    cloud = PointCloud2(header=told.header, width=2, height=1, point_step=12, row_step=24)
    cloud.data = bytes(24)
    cloud.fields = [
        PointField(name=axis, offset=4 * at, datatype=7, count=1) for at, axis in enumerate("xyz")
    ]
    points.publish(cloud)
    time.sleep(0.05)
"""

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(not PYTHONS, reason=NO_ROS),
]


@pytest.mark.parametrize("python", PYTHONS)
def test_a_node_of_ros_is_heard_with_the_shipped_profile(
    python: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    profile = PROFILE.read_text(encoding="utf-8")
    profile = profile.replace("<type>UDPv4</type>", f"<type>UDPv4</type>{WHITE_LIST}")
    profile = profile.replace("<rtps>", f"<rtps>{PEERS}", 1)
    (tmp_path / "profile.xml").write_text(profile)
    given = dict.fromkeys(PROFILES, str(tmp_path / "profile.xml"))
    bus, heard = DdsBus(ROS_DOMAIN), Counter[str]()
    for topic, kind in KINDS.items():
        bus.subscribe(topic, kind, SENSOR)
    talker = begun_in_ros(python, "-c", TALKER, **given)
    try:
        with all_ended(talker):
            ends = time.monotonic() + 60.0
            while time.monotonic() < ends and min(heard[topic] for topic in KINDS) < 50:
                bus.wait(0.1)
                for came in bus.take():
                    message = unpack_cdr(came.raw, came.type)
                    heard[came.topic] += getattr(message, "width", 2) == 2
        whys = {topic: bus.why_unheard(topic) for topic in KINDS if not heard[topic]}
        assert min(heard[topic] for topic in KINDS) >= 50, (heard, whys)
    finally:
        bus.close()
