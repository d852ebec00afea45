"""Two processes when things go wrong: who dies, comes back, floods, or does not keep up."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.ros2.bus import LATCHED, SENSOR, STATIC_TF, USUAL, Quality
from clearway.ros2.dds import DdsBus
from clearway.ros2.messages import pack_message, unpack_cdr
from clearway.ros2.told import make_stamp
from repository import REPOSITORY
from ros2_for_tests import DOMAIN, LOOPBACK, cloud, odometry, transform, until
from ros2_guard_bench import twist
from ros2_processes import all_ended, begun

PILLAR = REPOSITORY / "examples" / "ros2" / "pillar.toml"
HERE = DOMAIN + 2
PARAMETERS = f"""
/**:
  ros__parameters:
    mission: {PILLAR}
    act: true
    ground_m: -20.0
    clouds: {{front: {{topic: points}}}}
    set_points: {{velocity: {{topic: cmd_vel, type: Twist}}}}
"""
TWIST = "geometry_msgs/msg/Twist"

pytestmark = pytest.mark.nightly


class Side:
    """The vehicle's and the pilot's side of the topics, told by hand in real time."""

    def __init__(self) -> None:
        self.bus = DdsBus(HERE)
        for topic, kind, quality in (
            ("/odom", "nav_msgs/msg/Odometry", SENSOR),
            ("/points", "sensor_msgs/msg/PointCloud2", SENSOR),
            ("/tf_static", "tf2_msgs/msg/TFMessage", STATIC_TF),
            ("/cmd_vel_in", TWIST, USUAL),
        ):
            self.bus.advertise(topic, kind, quality)
        self.bus.subscribe("/cmd_vel", TWIST, Quality(depth=100))
        self.bus.subscribe("/clearway/decision", "std_msgs/msg/String", LATCHED)
        self.bus.publish("/tf_static", pack_message(transform("lidar", "base_link")))
        shell = np.random.default_rng(1).normal(size=(400, 3))
        self.points = 6.0 * shell / np.linalg.norm(shell, axis=1)[:, None]
        self.commands: list[Any] = []
        self.said: list[dict[str, Any]] = []

    def tell(
        self, seconds: float, wish: Any = None, rate_hz: float = 10.0, odom: bool = True
    ) -> None:
        """Own place, cloud and wish at a rate; take what comes back."""
        until_s = time.monotonic() + seconds
        while time.monotonic() < until_s:
            now = time.time()
            if odom:
                self.bus.publish("/odom", pack_message(odometry(now, speed=0.0)))
                self.bus.publish("/points", pack_message(cloud(now, self.points)))
            if wish is not None:
                self.bus.publish("/cmd_vel_in", pack_message(wish))
            time.sleep(1.0 / rate_hz)
            self.take()

    def take(self) -> None:
        for one in self.bus.take():
            message = unpack_cdr(one.raw, one.type)
            if one.topic == "/cmd_vel":
                self.commands.append(message)
            else:
                self.said.append(json.loads(message.data))

    def is_answered(self, wish: Any, seconds: float = 300.0) -> bool:
        """Whether the node sends anything within a time."""
        end = time.monotonic() + seconds
        before = len(self.commands)
        while time.monotonic() < end and len(self.commands) == before:
            self.tell(0.5, wish)
        return len(self.commands) > before


@pytest.fixture
def side(monkeypatch: pytest.MonkeyPatch) -> Iterator[Side]:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    side = Side()
    yield side
    side.bus.close()


def node(folder: Path, *more: object) -> Any:
    (folder / "p.yaml").write_text(PARAMETERS)
    return begun(
        "-m", "clearway", "guard", folder / "p.yaml", "--domain", HERE, "--json", *more
    )  # fmt: skip


def test_killed_and_begun_anew_it_goes_on(tmp_path: Path, side: Side) -> None:
    """A node that is killed says nothing; the next one needs nothing but what is published."""
    first = node(tmp_path)
    with all_ended(first):
        assert side.is_answered(twist(0.1))
        first.kill()
        first.wait()
        side.take()
        side.commands.clear()
        side.tell(2.0, twist(0.1))
        assert not side.commands
    second = node(tmp_path)
    with all_ended(second):
        assert side.is_answered(twist(0.1)), "with the static transform that was latched"


def test_a_vehicle_that_dies_and_comes_back(tmp_path: Path, side: Side) -> None:
    one = node(tmp_path)
    with all_ended(one):
        assert side.is_answered(twist(0.1))
        side.bus.close()
        time.sleep(5.0)
        assert one.poll() is None
        again = Side()
        try:
            assert again.is_answered(twist(0.1), 60.0)
            one.terminate()
            told = json.loads(one.communicate(timeout=60)[0])
        finally:
            again.bus.close()
    assert one.returncode == 0
    assert told["passed"] > 0


def test_silence_of_the_vehicle_ends_in_a_hold_and_then_in_nothing(
    tmp_path: Path, side: Side
) -> None:
    one = node(tmp_path)
    with all_ended(one):
        assert side.is_answered(twist(0.2))
        side.tell(6.0, twist(0.2), odom=False)
        last, number = side.commands[-1], len(side.commands)
        assert last.linear.x == pytest.approx(0.0, abs=1e-9)
        side.tell(2.0, twist(0.2), odom=False)
        assert len(side.commands) == number


def test_two_of_one_name_are_both_heard(tmp_path: Path, side: Side) -> None:
    """Nothing keeps two nodes of one name apart: both send, and `ros2 node list` warns."""
    first, second = node(tmp_path), node(tmp_path)
    with all_ended(first, second):
        assert side.is_answered(twist(0.1))
        assert until(lambda: (side.tell(0.3, twist(0.1)), side.bus.publishers("/cmd_vel") == 2)[1])
        first.terminate()
        first.communicate(timeout=60)
        side.tell(1.0, twist(0.1))
        side.commands.clear()
        side.tell(2.0, twist(0.1))
        assert side.commands


def test_a_flood_of_commands_does_not_drown_it(tmp_path: Path, side: Side) -> None:
    one = node(tmp_path)
    with all_ended(one):
        assert side.is_answered(twist(0.1))
        before = len(side.commands)
        side.tell(5.0, twist(0.1), rate_hz=500.0)
        assert len(side.commands) - before > 10
        one.terminate()
        told = json.loads(one.communicate(timeout=60)[0])
    assert told["state"] in ("flying", "ageing")


def test_who_does_not_take_what_is_sent_holds_nobody_up(tmp_path: Path, side: Side) -> None:
    """A reliable subscriber that sleeps: its history is kept short, and the node goes on."""
    one = node(tmp_path)
    slow = DdsBus(HERE)
    slow.subscribe("/cmd_vel", TWIST, Quality(depth=1))
    with all_ended(one):
        assert side.is_answered(twist(0.1))
        side.commands.clear()
        side.tell(8.0, twist(0.1))
        assert len(side.commands) > 30
        assert len(slow.take()) <= 1
    slow.close()


def test_time_that_jumps_is_said_and_ends_it(tmp_path: Path, side: Side) -> None:
    one = node(tmp_path)
    with all_ended(one):
        assert side.is_answered(twist(0.1))
        for _ in range(8):
            late = odometry(0.0, speed=0.0)
            late.header.stamp = make_stamp(time.time() - 500.0)
            side.bus.publish("/odom", pack_message(late))
            time.sleep(0.02)
        told = json.loads(one.communicate(timeout=30)[0])
    assert told["state"] == "autopilot restarted"
