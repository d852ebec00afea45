"""What is shipped for ROS users, as far as it can be read without ROS and Docker."""

from __future__ import annotations

import ast
import sys
import types
from collections import Counter
from typing import Any
from xml.etree import ElementTree

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from ruamel.yaml import YAML
from typer.main import get_command

from clearway.cli.app import app
from clearway.ros2.bus import LATCHED, SENSOR
from clearway.ros2.messages import ADDED
from clearway.ros2.parameter_file import read_parameters
from clearway.ros2.rclpy_bus import RclpyBus
from repository import REPOSITORY

FOLDER = REPOSITORY / "examples" / "ros2"


def commands() -> dict[str, Any]:
    found: dict[str, Any] = get_command(app).commands  # type: ignore[attr-defined]
    return found


@pytest.mark.parametrize("name", ["params.yaml", "guard.yaml"])
def test_parameters_are_read(name: str) -> None:
    given = read_parameters(FOLDER / name)
    assert given.mission.exists()
    assert given.act is False


def test_the_launch_file_begins_a_command_that_there_is() -> None:
    tree = ast.parse((FOLDER / "clearway.launch.py").read_text())
    compile(tree, "clearway.launch.py", "exec")
    words = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)]
    assert "clearway" in words
    assert "ros2" in words
    options = {name for one in commands()["ros2"].params for name in one.opts}
    assert {word for word in words if str(word).startswith("--")} <= options


def test_compose_starts_what_the_dockerfile_builds() -> None:
    compose = YAML(typ="safe").load((FOLDER / "compose.yaml").read_text())
    service = compose["services"]["clearway"]
    root = (FOLDER / service["build"]["context"]).resolve()
    dockerfile = root / service["build"]["dockerfile"]
    assert dockerfile == FOLDER / "Dockerfile"
    assert service["network_mode"] == "host", "discovery by multicast"
    assert {volume.split(":")[0] for volume in service["volumes"]} >= set(compose["volumes"])
    lines = [line.split() for line in dockerfile.read_text().splitlines()]
    assert ["ENTRYPOINT", '["clearway",', '"ros2"]'] in lines
    extras = next(line for line in dockerfile.read_text().splitlines() if "pip install" in line)
    assert "[ros2," in extras
    assert (root / "constraints.txt").exists()


def test_our_message_is_the_one_that_is_read() -> None:
    package = ElementTree.parse(FOLDER / "clearway_msgs" / "package.xml").getroot()
    assert package.findtext("name") == "clearway_msgs"
    for name, text in ADDED.items():
        if not name.startswith("clearway_msgs"):
            continue
        file = FOLDER / "clearway_msgs" / "msg" / f"{name.rsplit('/', 1)[1]}.msg"
        shipped = [line.split("#")[0].split() for line in file.read_text().splitlines()]
        read = [line.split() for line in text.splitlines()]
        assert [line for line in shipped if line] == [line for line in read if line]
        assert f"msg/{file.name}" in (FOLDER / "clearway_msgs" / "CMakeLists.txt").read_text()


class StandIn:
    """Of rclpy, as its sources of Humble have it: as much as is used."""

    def __init__(self) -> None:
        self.ready: list[tuple[Any, bytes]] = []
        self.asked: list[tuple[Any, ...]] = []
        self.sent: list[tuple[str, bytes]] = []
        self.counts = Counter[str]()

    def init(self, *, args: Any = None, signal_handler_options: Any = None) -> None:
        self.asked.append(("init", args, signal_handler_options))

    def create_node(self, name: str, *, namespace: str | None = None) -> Any:
        self.asked.append(("node", name, namespace))
        return self

    def get_fully_qualified_name(self) -> str:
        return "/robot/clearway"

    def create_subscription(
        self, kind: Any, topic: str, callback: Any, qos: Any, *, raw: bool
    ) -> None:
        self.asked.append(("hears", kind, topic, vars(qos), raw))
        self.callback = callback

    def create_publisher(self, kind: Any, topic: str, qos: Any) -> Any:
        self.asked.append(("tells", kind, topic, vars(qos)))
        stand_in = self

        class Publisher:
            def publish(self, message: Any) -> None:
                assert isinstance(message, bytes), "serialised"
                stand_in.sent.append((topic, message))

        return Publisher()

    def spin_once(self, node: Any, *, timeout_sec: float | None = None) -> None:
        assert node is self
        assert timeout_sec is not None, "it would wait for ever"
        if self.ready:
            callback, raw = self.ready.pop(0)
            callback(raw)

    def count_publishers(self, topic: str) -> int:
        return len(topic)

    def destroy_node(self) -> None:
        self.asked.append(("destroyed",))

    def try_shutdown(self) -> None:
        self.asked.append(("shut down",))


def test_topics_by_rclpy_as_far_as_a_stand_in_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    """rclpy itself cannot be had here: this shows the calls, not that ROS takes them."""
    rclpy = StandIn()
    policies = {"RELIABLE": 1, "BEST_EFFORT": 2, "TRANSIENT_LOCAL": 3, "VOLATILE": 4}
    modules: dict[str, Any] = {
        "rclpy": rclpy,
        "rclpy.qos": types.SimpleNamespace(
            QoSProfile=types.SimpleNamespace,
            ReliabilityPolicy=types.SimpleNamespace(**policies),
            DurabilityPolicy=types.SimpleNamespace(**policies),
        ),
        "rclpy.signals": types.SimpleNamespace(SignalHandlerOptions=types.SimpleNamespace(NO=0)),
        "sensor_msgs.msg": types.SimpleNamespace(PointCloud2="cloud"),
        "std_msgs.msg": types.SimpleNamespace(String="string"),
    }
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    bus = RclpyBus("clearway", "/robot")
    assert rclpy.asked == [("init", [], 0), ("node", "clearway", "/robot")]
    bus.subscribe("/points", "sensor_msgs/msg/PointCloud2", SENSOR)
    bus.advertise("/said", "std_msgs/msg/String", LATCHED)
    assert rclpy.asked[2:] == [
        ("hears", "cloud", "/points", {"depth": 5, "reliability": 2, "durability": 4}, True),
        ("tells", "string", "/said", {"depth": 1, "reliability": 1, "durability": 3}),
    ]
    rclpy.ready = [(rclpy.callback, b"one"), (rclpy.callback, bytearray(b"two"))]
    assert [one.raw for one in bus.take()] == [b"one", b"two"]
    assert not bus.take()
    assert bus.publish("/said", b"raw")
    assert rclpy.sent == [("/said", b"raw")]
    bus.wait(0.1)
    bus.close()
    assert rclpy.asked[-2:] == [("destroyed",), ("shut down",)]
