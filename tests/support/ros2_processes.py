"""Nodes and robots in processes of their own, on the loopback interface."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from repository import REPOSITORY
from ros2_for_tests import DOMAIN, LOOPBACK
from ros_pythons import SUPPORT, begun_in_ros

ENVIRONMENT = os.environ | {
    "CYCLONEDDS_URI": LOOPBACK,
    "PYTHONPATH": os.pathsep.join([str(REPOSITORY / "src"), str(SUPPORT)]),
}


def begun(*words: object) -> subprocess.Popen[str]:
    """Python with these words in a process of its own."""
    return subprocess.Popen(
        [sys.executable, *(str(word) for word in words)],
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )


@contextmanager
def all_ended(*processes: subprocess.Popen[str]) -> Iterator[None]:
    """Whatever happens, none of them is left behind."""
    try:
        yield
    finally:
        for one in processes:
            one.kill()
            one.wait()
            if one.stdout is not None:
                one.stdout.close()


class FlownApart(NamedTuple):
    """A robot and a node that led it, from two processes."""

    node: dict[str, Any]
    robot: dict[str, Any]
    status: int


def flown_apart(
    folder: Path,
    mission: str,
    parameters: str,
    command: str,
    steps: int,
    *more: object,
    kind: str = "PositionTarget",
    ros: str | None = None,
) -> FlownApart:
    """A mission (TOML) flown by a simulated robot and led over DDS; more: options of the node.

    command: guard has somebody command the robot straight at its goal, and takes Twist. kind: of
    the set-points. ros: a Python with rclpy, which both are run by.
    """
    (folder / "m.toml").write_text(mission)
    (folder / "p.yaml").write_text(parameters)
    at = DOMAIN if ros is None else "rclpy"
    robot_words: list[object] = [SUPPORT / "ros2_robot.py", folder / "m.toml", at, steps]
    robot_words += ["Twist", "pilot"] if command == "guard" else [kind]
    node_words = ["-m", "clearway", command, folder / "p.yaml", "--json", *more]
    if ros is None:
        robot, node = begun(*robot_words), begun(*node_words, "--domain", DOMAIN)
    else:
        robot = begun_in_ros(ros, *robot_words)
        node = begun_in_ros(ros, *node_words, "--backend", "rclpy")
    with all_ended(robot, node):
        flown = json.loads(robot.communicate(timeout=1200)[0])
        if command == "guard":
            node.terminate()
        told = json.loads(node.communicate(timeout=60)[0])
        return FlownApart(told, flown, node.returncode)
