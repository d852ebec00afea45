"""Against an independent implementation of DDS: Fast DDS in C++, both ways."""

from __future__ import annotations

import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.ros2.bus import SENSOR, USUAL
from clearway.ros2.clouds import read_cloud_points
from clearway.ros2.dds import DdsBus
from clearway.ros2.messages import pack_message, unpack_cdr
from clearway.ros2.told import path_message
from repository import REPOSITORY
from ros2_for_tests import DOMAIN, LOOPBACK, cloud, odometry, until
from ros2_processes import all_ended

SOURCE = REPOSITORY / "tests" / "ros2" / "fast_dds" / "fast_dds.cpp"
HEADER = Path("/usr/include/fastdds/dds/domain/DomainParticipant.hpp")
KINDS = {
    "/points": ("sensor_msgs/msg/PointCloud2", SENSOR),
    "/odom": ("nav_msgs/msg/Odometry", USUAL),
    "/path": ("nav_msgs/msg/Path", USUAL),
}
COUNT, POINTS = 20, 20_000

pytestmark = pytest.mark.nightly


@pytest.fixture(scope="module")
def fast_dds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if shutil.which("g++") is None or not HEADER.exists():
        pytest.skip("needs g++ and libfastrtps-dev, libfastcdr-dev")
    program = tmp_path_factory.mktemp("fast_dds") / "fast_dds"
    words = ["g++", "-std=c++17", "-O1", "-o", str(program), str(SOURCE), "-lfastrtps", "-lfastcdr"]
    subprocess.run(words, check=True, capture_output=True)
    return program


@pytest.fixture
def bus(monkeypatch: pytest.MonkeyPatch) -> Iterator[DdsBus]:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    bus = DdsBus(DOMAIN + 1)
    yield bus
    bus.close()


def begun(program: Path, *words: object) -> subprocess.Popen[str]:
    command = [str(program), *map(str, words)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def test_what_it_says_is_understood(fast_dds: Path, bus: DdsBus) -> None:
    for topic, (kind, quality) in KINDS.items():
        bus.subscribe(topic, kind, quality)
    talker, came = begun(fast_dds, "talk", DOMAIN + 1, COUNT, POINTS), []
    with all_ended(talker):
        end = time.monotonic() + 120.0
        while talker.poll() is None and time.monotonic() < end:
            bus.wait(0.05)
            came += [(one.topic, unpack_cdr(one.raw, one.type)) for one in bus.take()]
    by_topic = {topic: [m for at, m in came if at == topic] for topic in KINDS}
    told = {topic: [m.header.stamp.sec for m in ms] for topic, ms in by_topic.items()}
    assert told["/odom"] == told["/path"] == list(range(1, COUNT + 1)), "reliable"
    assert len(told["/points"]) >= COUNT // 2, "best effort"
    points = read_cloud_points(by_topic["/points"][-1], "PointCloud2").points_m
    assert points.shape == (POINTS, 3)
    assert points[-1].tolist() == [POINTS - 1.0, 2.0, 3.0]
    odom = by_topic["/odom"][4]
    assert (odom.pose.pose.position.x, odom.child_frame_id) == (5.0, "base_link")
    assert odom.twist.twist.linear.x == 1.0
    assert [pose.pose.position.x for pose in by_topic["/path"][4].poses] == [5.0, 6.0]


def test_what_we_say_is_understood_by_it(fast_dds: Path, bus: DdsBus) -> None:
    for topic, (kind, quality) in KINDS.items():
        bus.advertise(topic, kind, quality)
    listener = begun(fast_dds, "hear", DOMAIN + 1, 25)
    with all_ended(listener):
        assert until(lambda: all(bus.subscribers(topic) for topic in KINDS), 20.0)
        time.sleep(1.0)
        points = np.random.default_rng(3).uniform(1.0, 9.0, (POINTS, 3))
        for number in range(1, COUNT + 1):
            bus.publish("/points", pack_message(cloud(float(number), points)))
            bus.publish("/odom", pack_message(odometry(float(number), (0.5, 0.0, 0.0))))
            ways = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
            bus.publish("/path", pack_message(path_message(ways, float(number), "map")))
            time.sleep(0.1)
        lines = [line.split() for line in listener.communicate(timeout=60)[0].splitlines()]
    told = {name: [line[1:] for line in lines if line[0] == name] for name in ("odom", "path")}
    numbers = [str(number) for number in range(1, COUNT + 1)]
    assert told["odom"] == [["map", number, "base_link", "0.5"] for number in numbers]
    assert told["path"] == [["map", number, "3", "0"] for number in numbers]
    clouds = [line for line in lines if line[0] == "points"]
    assert len(clouds) >= COUNT // 2
    assert all(line[1] == "lidar" and line[3] == str(POINTS) for line in clouds)
