"""Missions led from another process: as safe as in one."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from repository import REPOSITORY
from ros2_processes import flown_apart

PILLAR = (REPOSITORY / "examples" / "ros2" / "pillar.toml").read_text()
HEAD, _ = PILLAR.split("[[obstacle]]")
TRUNK = """
[[obstacle]]
shape = "line"
position_m = [{x}, {y}, 0.0]
size_m = [30.0]
radius_m = 0.3
orientation_deg = [0.0, 90.0, 0.0]
"""
TRUNKS = [(5.0, 0.4), (7.5, -1.9), (9.0, 2.4), (11.5, 0.2), (14.0, -2.2), (15.5, 1.6), (18.5, -0.3)]
INTRUDER = """
[traffic]
spawn = "world"

[[intruder]]
name = "CROSSING"
appears_s = 0.0
position_m = [12.0, -12.0, 0.0]
velocity_mps = [0.0, 1.0, 0.0]
radius_m = 0.5
"""
WORLDS = {
    "pillar": PILLAR,
    "forest": HEAD + "".join(TRUNK.format(x=x, y=y) for x, y in TRUNKS),
    "intruder": HEAD + INTRUDER,
}
PARAMETERS = """
/**:
  ros__parameters:
    mission: m.toml
    act: true
    use_sim_time: true
    ground_m: -20.0
    clouds: {front: {topic: points}}
    traffic: {adsb: {topic: adsb, type: TransponderReport}}
    set_points: {target: {topic: target, type: PositionTarget}}
"""
MARGIN_M = 0.6

pytestmark = pytest.mark.nightly


@pytest.mark.parametrize("world", WORLDS)
def test_it_arrives_and_keeps_its_margin(tmp_path: Path, world: str) -> None:
    mission = WORLDS[world].replace('name = "pillar"', f'name = "{world}"')
    mission = mission.replace(
        "[mission]\n", "[mission]\norigin_geodetic = [52.0, 4.3, 10.0]\n"
    )  # fmt: skip
    flown = flown_apart(tmp_path, mission, PARAMETERS, "ros2", 900, "--end-on-arrival")
    assert flown.status == 0
    assert flown.node["reached"]
    assert flown.robot["nearest_m"] >= MARGIN_M - 0.05
    assert flown.robot["nearest_intruder_m"] >= MARGIN_M - 0.05
