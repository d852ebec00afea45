"""Pythons that have real rclpy, where there are any: `CLEARWAY_ROS_PYTHON` names them."""

from __future__ import annotations

import os
import subprocess

from repository import REPOSITORY
from ros2_for_tests import DOMAIN

SUPPORT = REPOSITORY / "tests" / "support"
PYTHONS = [one for one in os.environ.get("CLEARWAY_ROS_PYTHON", "").split(os.pathsep) if one]
"""One of each distribution, as `make nightly` sets them up."""
NO_ROS = "CLEARWAY_ROS_PYTHON names no Python with rclpy: make nightly sets two up"
ROS_DOMAIN = DOMAIN + 3


def begun_in_ros(python: str, *words: object, **more: str) -> subprocess.Popen[str]:
    """Begin a process of ROS on this machine alone; more: of its environment."""
    surroundings = os.environ | {
        "ROS_DOMAIN_ID": str(ROS_DOMAIN),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "PYTHONPATH": os.pathsep.join([str(REPOSITORY / "src"), str(SUPPORT)]),
    }
    return subprocess.Popen(
        [python, *(str(word) for word in words)],
        env=surroundings | more,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
