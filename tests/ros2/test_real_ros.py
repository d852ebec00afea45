"""Real ROS 2, where there is one: `CLEARWAY_ROS_PYTHON` names a Python that has rclpy.

As by pip install ros-kilted-rclpy ros-kilted-rmw-fastrtps-cpp ros-kilted-nav-msgs
ros-kilted-sensor-msgs in an environment of its own; ros-jazzy-... for Jazzy.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.ros2.bus import SENSOR
from clearway.ros2.dds import DdsBus
from clearway.ros2.messages import unpacked
from repository import REPOSITORY
from ros2_for_tests import DOMAIN, LOOPBACK
from ros2_processes import all_ended

PYTHON = os.environ.get("CLEARWAY_ROS_PYTHON", "")
PROFILE = REPOSITORY / "examples" / "ros2" / "fast_dds.xml"
ON_LOOPBACK = (
    "<useBuiltinTransports>false</useBuiltinTransports>"
    "<userTransports><transport_id>lo</transport_id></userTransports>"
    "<builtin><initialPeersList><locator><udpv4><address>127.0.0.1</address></udpv4></locator>"
    "</initialPeersList></builtin>"
)
TRANSPORT = (
    "<transport_descriptors><transport_descriptor><transport_id>lo</transport_id><type>UDPv4</type>"
    "<interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList></transport_descriptor>"
    "</transport_descriptors>"
)
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
    pytest.mark.skipif(not PYTHON, reason="CLEARWAY_ROS_PYTHON names no Python with rclpy"),
]


def test_a_node_of_ros_is_heard_with_the_shipped_profile(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    profile = PROFILE.read_text(encoding="utf-8")
    profile = profile.replace("<profiles>", f"<profiles>{TRANSPORT}", 1)
    (tmp_path / "profile.xml").write_text(profile.replace("<rtps>", f"<rtps>{ON_LOOPBACK}", 1))
    surroundings = os.environ | {
        "FASTDDS_DEFAULT_PROFILES_FILE": str(tmp_path / "profile.xml"),
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(tmp_path / "profile.xml"),
        "ROS_DOMAIN_ID": str(DOMAIN + 3),
    }
    surroundings.pop("PYTHONPATH", None)
    bus, heard = DdsBus(DOMAIN + 3), Counter[str]()
    for topic, kind in KINDS.items():
        bus.subscribe(topic, kind, SENSOR)
    talker = subprocess.Popen([PYTHON, "-c", TALKER], env=surroundings, text=True)
    try:
        with all_ended(talker):
            ends = time.monotonic() + 60.0
            while time.monotonic() < ends and min(heard[topic] for topic in KINDS) < 50:
                bus.wait(0.1)
                for came in bus.take():
                    message = unpacked(came.raw, came.type)
                    heard[came.topic] += getattr(message, "width", 2) == 2
        whys = {topic: bus.why_unheard(topic) for topic in KINDS if not heard[topic]}
        assert min(heard[topic] for topic in KINDS) >= 50, (heard, whys)
    finally:
        bus.close()
