"""The node in real ROS 2: its parameters, its states, and what it sends in which of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from repository import REPOSITORY
from ros2_processes import all_ended
from ros_pythons import NO_ROS, PYTHONS, begun_in_ros

MISSION = """
[mission]
name = "straight"
waypoints_m = [[24.0, 0.0, 0.0]]

[vehicle]
kind = "inertialess"
speed_mps = 1.0

[safety]
margin_m = 0.6

[[lidar]]
name = "front"
beams_per_cell = [20, 10]
max_range_m = 10.0
"""
PARAMETERS = """
/**:
  ros__parameters:
    mission: mission.toml
    act: true
    rate: 10
    autostart: false
    ground_m: -20.0
    clouds.front.topic: points
    set_points: {led: {topic: led, type: Twist, frame: map}}
"""
CLIENT = REPOSITORY / "tests" / "support" / "ros_client.py"
pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(not PYTHONS, reason=NO_ROS),
]


@pytest.fixture(params=PYTHONS)
def told(request: Any, tmp_path: Path) -> dict[str, Any]:
    """What a client saw that took the node through its states, and the node's exit status."""
    return seen_of(tmp_path, request.param, PARAMETERS)


def seen_of(folder: Path, python: str, parameters: str, *client_words: str) -> dict[str, Any]:
    (folder / "mission.toml").write_text(MISSION)
    (folder / "params.yaml").write_text(parameters)
    words = ("-m", "clearway", "ros2", folder / "params.yaml", "--backend", "rclpy")
    node, client = begun_in_ros(python, *words), begun_in_ros(python, CLIENT, *client_words)
    with all_ended(node, client):
        found: dict[str, Any] = json.loads(client.communicate(timeout=180)[0])
        node.communicate(timeout=60)
        return found | {"status": node.returncode}


def test_set_points_come_while_it_is_active_alone(told: dict[str, Any]) -> None:
    assert told["began"] == told["ended"] == "unconfigured"
    for transition in ("configured", "activated", "deactivated", "again", "cleaned", "shut_down"):
        assert told[transition], transition
    assert told["sent_inactive"] == 0
    assert told["sent_active"] > 20
    assert told["flown_m"] > 1.0
    assert told["speed_after"] == 0.0, "it is told to hold"
    assert told["sent_after"] == 0
    assert told["sent_again"] > 5
    assert told["status"] == 0
    names = set(told["parameters"])
    assert {"mission", "act", "clouds.front.reliable", "set_points.led.topic", "own.topic"} <= names
    assert told["values"] == [10.0, "led"], "an integer of the file is a number"
    assert told["set"] == [True, ""]
    assert told["set_too_fast"][0] is False
    assert "less than or equal to 100" in told["set_too_fast"][1]
    assert told["set_late"][0] is False
    assert "read when the node is configured" in told["set_late"][1]


@pytest.mark.parametrize("python", PYTHONS)
@pytest.mark.parametrize("line", ["", "    autostart: true\n"], ids=["default", "true"])
def test_with_autostart_it_leads_without_being_asked(
    tmp_path: Path, python: str, line: str
) -> None:
    parameters = PARAMETERS.replace("    autostart: false\n", line)
    told = seen_of(tmp_path, python, parameters, "--looks-on")
    assert told["state"] == "active"
    assert told["sent"] > 20
    assert told["flown_m"] > 1.0
    assert told["shut_down"]
    assert told["status"] == 0


@pytest.mark.parametrize("python", PYTHONS)
def test_with_autostart_what_cannot_be_configured_ends_it(tmp_path: Path, python: str) -> None:
    (tmp_path / "params.yaml").write_text(PARAMETERS.replace("    autostart: false\n", ""))
    words = ("-m", "clearway", "ros2", tmp_path / "params.yaml", "--backend", "rclpy")
    node = begun_in_ros(python, *words)  # There is no mission.toml.
    with all_ended(node):
        node.communicate(timeout=60)
        assert node.returncode == 2
