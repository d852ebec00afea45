"""Two processes on the loopback interface: topics over DDS, a flight, and who dies."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from repository import REPOSITORY
from ros2_for_tests import DOMAIN, LOOPBACK, RosBench, cloud, until
from ros2_processes import SUPPORT, begun

pytestmark = pytest.mark.realtime

PILLAR = REPOSITORY / "examples" / "ros2" / "pillar.toml"
PARAMETERS = f"""
/**:
  ros__parameters:
    mission: {PILLAR}
    act: true
    use_sim_time: true
    ground_m: -20.0
    clouds: {{front: {{topic: points}}}}
    set_points: {{target: {{topic: target, type: PositionTarget}}}}
"""


@pytest.fixture
def loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)


@pytest.mark.usefixtures("loopback")
def test_clouds_arrive_whole_from_another_process() -> None:
    from clearway.ros2.bus import SENSOR, USUAL
    from clearway.ros2.dds import DdsBus
    from clearway.ros2.messages import unpack_cdr

    kind = "sensor_msgs/msg/PointCloud2"
    bus = DdsBus(DOMAIN)
    bus.subscribe("/loose", kind, SENSOR)
    bus.subscribe("/sure", kind, USUAL)
    talker = begun(SUPPORT / "ros2_cloud_talker.py", DOMAIN, 2000, 20, 2)
    try:
        came = []
        end = time.monotonic() + 60.0
        while time.monotonic() < end and talker.poll() is None:
            bus.wait(0.05)
            came += bus.take()
        sure = [unpack_cdr(one.raw, kind) for one in came if one.topic == "/sure"]
        assert [int(one.header.frame_id) for one in sure] == list(range(0, 40, 2))
        assert all(one.width == 2000 and len(one.data) == 48000 for one in sure)
    finally:
        talker.kill()
        talker.communicate()
        bus.close()


@pytest.mark.usefixtures("loopback")
def test_latched_topics_reach_those_who_come_later() -> None:
    from clearway.ros2.bus import LATCHED
    from clearway.ros2.dds import DdsBus
    from clearway.ros2.messages import make_message, pack_message, unpack_cdr

    first, later = DdsBus(DOMAIN), DdsBus(DOMAIN)
    try:
        first.advertise("/said", "std_msgs/msg/String", LATCHED)
        first.publish("/said", pack_message(make_message("std_msgs/msg/String", data="early")))
        later.subscribe("/said", "std_msgs/msg/String", LATCHED)
        came: list = []
        assert until(lambda: came.extend(later.take()) or came)
        assert unpack_cdr(came[0].raw, came[0].type).data == "early"
        assert later.publishers("/said") == 1
    finally:
        first.close()
        later.close()


@pytest.mark.nightly
def test_a_flight_past_a_pillar_led_from_another_process(tmp_path: Path) -> None:
    (tmp_path / "p.yaml").write_text(PARAMETERS)
    robot = begun(SUPPORT / "ros2_robot.py", PILLAR, DOMAIN, 700, "PositionTarget")
    node = begun(
        "-m", "clearway", "ros2", tmp_path / "p.yaml", "--domain", DOMAIN, "--end-on-arrival",
        "--duration", 400, "--json",
    )  # fmt: skip
    try:
        told = json.loads(node.communicate(timeout=500)[0])
        track = np.array(json.loads(robot.communicate(timeout=60)[0])["track"])
        status = node.returncode
    finally:
        for one in (robot, node):
            one.kill()
            one.wait()
            assert one.stdout is not None
            one.stdout.close()
    assert status == 0, told
    assert told["reached"]
    clear = np.hypot(track[:, 0] - 12.0, track[:, 1] - 0.3) - 0.8
    assert clear.min() >= 0.6 - 0.05


def test_a_cloud_of_a_hundred_thousand_is_taken_quickly_enough_to_keep_up() -> None:
    """No time is asserted: only that all of several in one tick are used, the newest last."""
    bench = RosBench()
    bench.fly(2)
    points = np.random.default_rng(2).uniform(4.0, 9.0, (100_000, 3))
    for late in (0.0, 0.02, 0.04):
        bench.bus.tell("/points", cloud(1_700_000_000.15 + late, points))
    bench.fly(1, begins=2)
    assert bench.link.topics["/points"].refused == 0
