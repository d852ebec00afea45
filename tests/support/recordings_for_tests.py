"""Small robot recordings of every kind for tests."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from clearway.io.scans.timed_scans import ScanSequence
from robot_messages import Message, Types, write_bag1, write_bag2, write_bag2_of_mcap, write_mcap

POINTS = np.array([[1.0, 2.0, 3.0], [-4.5, 0.25, 0.0], [10.0, -2.0, 1.5], [7.0, 8.0, -9.0]])

Maker = Callable[[Path, list[Message]], Path]


def bag1(folder: Path, messages: list[Message]) -> Path:
    return write_bag1(folder / "made.bag", Types(ros2=False), messages)


def bag2(folder: Path, messages: list[Message]) -> Path:
    return write_bag2(folder / "made", Types(), messages)


def bag2_of_mcap(folder: Path, messages: list[Message]) -> Path:
    return write_bag2_of_mcap(folder / "made", Types(), messages)


def bag2_bare(folder: Path, messages: list[Message]) -> Path:
    whole = bag2(folder, messages)
    (whole / "metadata.yaml").unlink()
    return next(whole.glob("*.db3"))


def bag2_younger(folder: Path, messages: list[Message]) -> Path:
    whole = bag2(folder, messages)
    metadata = whole / "metadata.yaml"
    metadata.write_text(re.sub(r"(?m)^(\s*version: )8", r"\g<1>9", metadata.read_text()))
    return whole


def mcap2(folder: Path, messages: list[Message]) -> Path:
    return write_mcap(folder / "made.mcap", Types(), messages)


def mcap2_plain(folder: Path, messages: list[Message]) -> Path:
    return write_mcap(folder / "made.mcap", Types(), messages, summary=False)


def mcap1(folder: Path, messages: list[Message]) -> Path:
    return write_mcap(folder / "made.mcap", Types(ros2=False), messages)


MAKERS = {
    "ROS 1 bag": bag1,
    "ROS 2 bag": bag2,
    "ROS 2 bag of MCAP": bag2_of_mcap,
    "ROS 2 bag without metadata": bag2_bare,
    "ROS 2 bag of Jazzy": bag2_younger,
    "MCAP": mcap2,
    "MCAP without index": mcap2_plain,
    "MCAP of ROS 1": mcap1,
}


def storage(path: Path) -> Path:
    """The file that holds the messages."""
    return next(p for p in path.iterdir() if p.suffix != ".yaml") if path.is_dir() else path


def types_of(maker: Maker) -> Types:
    return Types(ros2=maker not in (bag1, mcap1))


def clouds(sequence: ScanSequence) -> list[Any]:
    return [scan.read().points_m for scan in sequence]
