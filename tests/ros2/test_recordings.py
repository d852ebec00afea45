"""A recorded bag through the same code as live topics."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.base.errors import InputError
from clearway.live.link.hearing import SessionTerms
from clearway.live.link.loop import Loop
from clearway.live.link.session import Session
from clearway.missions import samples
from clearway.missions.played_scene import play_scene
from clearway.missions.scene_reading import scene_of
from clearway.ros2.bag_bus import BagBus
from clearway.ros2.bus import USUAL
from clearway.ros2.messages import message_types, pack_message
from clearway.ros2.parameters import Names, NodeParameters
from clearway.ros2.ros2_link import Ros2Link
from clearway.studies.samples import SAMPLES
from in_process import clearway
from robot_messages import Message, Types, write_bag2
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
    raws = [(topic, pack_message(message)) for topic, _, message in told]
    with Writer(folder) as writer:
        by_topic = {
            topic: writer.add_connection(topic, kind, typestore=message_types())
            for topic, kind in KINDS.items()
        }
        for (topic, time_s, _), (_, raw) in zip(told, raws, strict=True):
            writer.write(by_topic[topic], round((BEGAN_S + time_s) * 1e9), raw)
    return raws


@pytest.mark.parametrize("command", [("ros2", "robot.yaml"), ("guard", "guarded.yaml")])
@pytest.mark.parametrize("name", ["nope", "nope.mcap", "nope.db3"])
def test_a_recording_that_is_not_there_is_told_before_anything_else(
    command: tuple[str, ...], name: str, tmp_path: Path
) -> None:
    (tmp_path / "robot.yaml").write_text(samples.NODE)
    (tmp_path / "guarded.yaml").write_text(samples.GUARDED)
    done = clearway(*command, "--bag", name, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.strip() == f"{name}: cannot be read: No such file or directory"


def test_a_recording_brings_what_was_recorded_in_its_order(tmp_path: Path) -> None:
    raws = recorded(tmp_path / "bag")
    bus = BagBus(tmp_path / "bag")
    for topic, kind in KINDS.items():
        bus.subscribe(topic, kind, USUAL)
    came, batches = [], 0
    while not bus.ended:
        bus.wait(1.0)
        came += bus.take()
        assert not bus.take(), "once for each wait"
        batches += 1
    bus.close()
    assert [(one.topic, one.raw) for one in came] == raws
    assert batches == 5


def test_a_topic_of_another_type_is_named(tmp_path: Path) -> None:
    recorded(tmp_path / "bag")
    with pytest.raises(InputError, match="is nav_msgs/msg/Odometry in the recording"):
        BagBus(tmp_path / "bag").subscribe("/odom", "geometry_msgs/msg/PoseStamped", USUAL)


def flown_at_a_ball(folder: Path, moments: int) -> Path:
    """A bag of a vehicle that flies at a ball 8 m ahead, beside another; a scan a second."""
    types, told = Types(), []
    directions = np.random.default_rng(3).normal(size=(400, 3))
    ball = 0.5 * directions / np.linalg.norm(directions, axis=1)[:, None]
    for n in range(moments):
        at = 100.0 + n
        places = np.array([[8.0 - n, 0.1, 0.0], [7.0 - n, -3.0, 1.0]])
        points = (places[:, None] + ball).reshape(-1, 3)
        told.append(Message("/odom", at, types.odometry(at, (float(n), 0.02 * n, 2.0))))
        told.append(Message("/points", at, types.cloud2(at, "base_link", points)))
    return write_bag2(folder, types, told)


def test_the_node_decides_on_a_recording_as_assess_does(tmp_path: Path) -> None:
    bag = flown_at_a_ball(tmp_path / "bag", 6)
    scene = scene_of("a test", {"scan": {"file": str(bag)}}, Path(), "bag")
    assessed = [played.decision for _, played in play_scene(scene).scans]
    again = play_scene(scene)
    given = {
        "mission": "none.toml",
        "map_frame": "odom",
        "use_sim_time": True,
        "clouds": {again.lidar.name: {"topic": "points"}},
        "own": {"topic": "odom"},
    }
    terms, bus = SessionTerms(speedup=None), BagBus(bag)
    session = Session(again.system, again.lidar, terms, Counter())
    parameters = NodeParameters.model_validate(given)
    lidars = {again.lidar.name: again.lidar}
    link = Ros2Link(bus, session, parameters, Names(), lidars, None)
    node = []
    Loop(link, session, 0.1).run(
        lambda _elapsed, _outcome: bus.ended,
        lambda outcome: node.append(outcome.flight) if outcome.flight is not None else None,
    )
    bus.close()
    assert len(node) == len(assessed) == 6
    for one, other in zip(node, assessed, strict=True):
        assert one.time_s == other.time_s
        assert one.movements == other.movements
        assert one.mode is other.mode
        assert one.explanation == other.explanation
        assert np.array_equal(one.decision.path_m, other.decision.path_m)
        assert one.decision.choice.clearance_m == other.decision.choice.clearance_m
    assert len({tuple(one.movements) for one in node}) > 1, "there was something to decide"
    assert link.topics["/points"].rate_hz == pytest.approx(1.0), "by the times of the recording"


def test_a_broken_page_of_a_recording_is_a_malformed_message(tmp_path: Path) -> None:
    """As live: counted, and what comes after it is heard."""
    from rosbags.rosbag2 import Writer

    kind, clouds = "sensor_msgs/msg/PointCloud2", []
    for n in range(5):
        clouds.append(cloud(BEGAN_S + n, np.full((1500, 3), 1.5 + n)))
    with Writer(tmp_path / "bag") as writer:
        points = writer.add_connection("/points", kind, typestore=message_types())
        for n, one in enumerate(clouds):
            writer.write(points, round((BEGAN_S + n) * 1e9), pack_message(one))
    file = next((tmp_path / "bag").glob("*.db3"))
    content = bytearray(file.read_bytes())
    at = content.index(clouds[2].data[12_000:12_024].tobytes())
    content[at : at + 5000] = bytes(5000)
    file.write_bytes(content)
    bus = BagBus(tmp_path / "bag")
    bus.subscribe("/points", kind, USUAL)
    raws = []
    while not bus.ended:
        bus.wait(0.0)
        raws += [one.raw for one in bus.take()]
    bus.close()
    assert raws == [pack_message(one) if n != 2 else b"" for n, one in enumerate(clouds)]


@pytest.mark.parametrize("command", [("ros2", "robot.yaml"), ("guard", "guarded.yaml")])
def test_a_recording_that_is_played_back_is_told_as_that_by_one_clock(
    command: tuple[str, ...], tmp_path: Path
) -> None:
    for one in SAMPLES:
        if one.name in ("robot.yaml", "guarded.yaml", "robot-mission.toml", "commanded"):
            one.write(tmp_path / one.name, np.random.default_rng(1))
    done = clearway(*command, "--bag", "commanded", cwd=tmp_path)
    assert "0.0 s is 2026-01-01 00:00:00 UTC" in done.stderr
    assert "\n0.0 s  flying; " in done.stderr
    assert "17672" not in done.stderr, "seconds since 1970"
    if command[0] == "ros2":
        assert "reached    played back, not flown" in done.stdout
        assert "NO" not in done.stdout
