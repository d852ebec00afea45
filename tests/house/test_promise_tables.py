"""The tables at the head of the pages on live flight say what the shipped set-ups fly."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.live.preflight.escape_plan import EscapePlan
from clearway.mavlink.distances import LEVEL_RAD
from clearway.mavlink.setup import sensor_of
from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.ros2.parameter_file import read_parameters
from clearway.ros2.setup import NodeSetup
from repository import REPOSITORY

BLIND, LEVEL_SCAN = "lidar = []\n", "azimuth_deg = {}\nelevation_deg = [0]"
MAPPED = '[map]\ncomplete = true\n[safety]\nescape = "mapped"'
SPAN = "[safety]\nobstacles_span_m = {}"


def rows(page: str, name: str) -> list[list[str]]:
    """Cells of the table between two marks, without its head."""
    text = (REPOSITORY / "docs" / page).read_text(encoding="utf-8")
    found = re.search(rf"<!-- {name}:begin -->\n(.*?)<!-- {name}:end -->", text, re.DOTALL)
    assert found, f"{page} has no {name}"
    lines = found[1].strip().splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def over_mavlink(folder: Path, change: Callable[[str], str], fan_deg: float = 0.0) -> EscapePlan:
    path = folder / "mavlink.toml"
    path.write_text(
        change((REPOSITORY / "examples/missions/mavlink.toml").read_text(encoding="utf-8"))
    )
    file = read_mission_file(str(path))
    setup = prepare(file)
    sensor = sensor_of(file, setup, math.radians(fan_deg))
    return replace(setup, sensors=() if sensor is None else (sensor,)).escape


def over_ros2(folder: Path, change: Callable[[str], str]) -> EscapePlan:
    for name in ("params.yaml", "pillar.toml"):
        text = (REPOSITORY / "examples/ros2" / name).read_text(encoding="utf-8")
        (folder / name).write_text(change(text) if name == "pillar.toml" else text)
    parameters = read_parameters(folder / "params.yaml")
    if "lidar = []" in (folder / "pillar.toml").read_text():
        parameters = parameters.model_copy(update={"clouds": {}})
    return NodeSetup.of(parameters, lambda _: None).flight.escape


def spanning(text: str, span_m: str) -> str:
    return text.replace("[safety]", SPAN.format(span_m))


def level_scan(text: str) -> str:
    angles = np.arange(-179.5, 180.0).tolist()
    return text.replace("beams_per_cell = [20, 10]", LEVEL_SCAN.format(angles))


def without_lidar(text: str) -> str:
    return BLIND + re.sub(r"\[\[lidar\]\]\n(.+\n)+", "", text)


@pytest.mark.parametrize(("number", "flown"), [
    (0, lambda at: over_mavlink(at, str)),
    (1, lambda at: over_mavlink(at, lambda text: spanning(text, "[0, 10]"))),
    (2, lambda at: over_mavlink(at, str, 30.0)),
    (3, lambda at: over_mavlink(at, lambda text: BLIND + text)),
    (4, lambda at: over_mavlink(at, lambda text: BLIND + text.replace("[safety]", MAPPED))),
])  # fmt: skip
def test_over_mavlink(number: int, flown: Callable[[Path], EscapePlan], tmp_path: Path) -> None:
    table = rows("mavlink.md", "escapes")
    assert len(table) == 5
    assert table[number][2] == f"`{flown(tmp_path).flown}`"


@pytest.mark.parametrize(("number", "flown"), [
    (0, lambda at: over_ros2(at, str)),
    (1, lambda at: over_ros2(at, level_scan)),
    (2, lambda at: over_ros2(at, lambda text: spanning(level_scan(text), "[-5, 5]"))),
    (3, lambda at: over_ros2(at, without_lidar)),
])  # fmt: skip
def test_on_ros2(number: int, flown: Callable[[Path], EscapePlan], tmp_path: Path) -> None:
    table = rows("ros2.md", "escapes")
    assert len(table) == 4
    assert table[number][2] == f"`{flown(tmp_path).flown}`"


def test_how_far_a_tilted_ring_shows_is_what_the_page_says() -> None:
    """A beam leaves the heights that obstacles span where it has risen by half of them."""
    for span, *told in rows("mavlink.md", "tilt"):
        for tilt_deg, shown in zip((0.0, 8.0, 15.0, 20.0), told, strict=True):
            away_m = float(span.split()[0]) / math.tan(math.radians(tilt_deg) + LEVEL_RAD)
            assert shown == f"{away_m:.1f} m"
