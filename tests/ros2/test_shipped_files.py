"""What is shipped for ROS users, as far as it can be read without ROS and Docker."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from ruamel.yaml import YAML

from clearway.cli import ros2_node
from clearway.ros2.messages import ADDED
from clearway.ros2.parameter_file import read_parameters
from repository import REPOSITORY
from ros_pythons import PYTHONS

FOLDER = REPOSITORY / "examples" / "ros2"
NODES = FOLDER / "clearway_ros" / "clearway_ros" / "nodes.py"
COLCONS = [Path(python).parent for python in PYTHONS]


@pytest.mark.parametrize("name", ["params.yaml", "guard.yaml"])
def test_parameters_are_read(name: str) -> None:
    given = read_parameters(FOLDER / name)
    assert given.mission.exists()
    assert given.act is False


@pytest.mark.nightly
def test_colcon_builds_the_package(tmp_path: Path) -> None:
    colcon = next((found for at in COLCONS if (found := at / "colcon").exists()), None)
    if colcon is None:
        pytest.skip("no colcon beside the Pythons of CLEARWAY_ROS_PYTHON: make nightly installs it")
    shutil.copytree(FOLDER / "clearway_ros", tmp_path / "src" / "clearway_ros")
    path = f"{colcon.parent}{os.pathsep}{os.environ['PATH']}"
    subprocess.run([colcon, "build"], cwd=tmp_path, env=os.environ | {"PATH": path}, check=True)
    installed = tmp_path / "install" / "clearway_ros"
    assert {one.name for one in (installed / "lib" / "clearway_ros").iterdir()} == {
        "clearway", "guard"
    }  # fmt: skip
    share = installed / "share"
    assert (share / "ament_index" / "resource_index" / "packages" / "clearway_ros").exists()
    assert (share / "clearway_ros" / "launch" / "clearway.launch.py").exists()
    given = read_parameters(share / "clearway_ros" / "config" / "params.yaml")
    assert given.mission.exists()


def test_entry_points_are_functions_that_there_are() -> None:
    names = re.findall(
        r"^from clearway.cli.ros2_node import (.*)$", NODES.read_text(), re.MULTILINE
    )
    assert names
    assert all(callable(getattr(ros2_node, name)) for name in names[0].split(", "))
    ast.parse((FOLDER / "clearway_ros" / "launch" / "clearway.launch.py").read_text())


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
