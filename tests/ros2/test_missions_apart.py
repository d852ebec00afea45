"""Missions led from another process: as safe as in one."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from repository import REPOSITORY
from ros2_processes import flown_apart
from ros_pythons import NO_ROS, PYTHONS

PILLAR = (REPOSITORY / "examples" / "ros2" / "pillar.toml").read_text()
PILLAR = PILLAR.replace('kind = "inertialess"', 'kind = "multirotor"')
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
    clouds: {{front: {{topic: points}}}}
    set_points: {{target: {{topic: target, type: {kind}}}}}
"""
TRAFFIC = "    traffic: {adsb: {topic: adsb, type: TransponderReport}}\n"
KINDS = ("Twist", "PositionTarget", "TrajectorySetpoint")
MARGIN_M = 0.6
MOST_RATIO = 1.5
"""Of the longest of three flights to the shortest: one lets an intruder by, another passes it."""

pytestmark = pytest.mark.nightly


@pytest.mark.parametrize("world", WORLDS)
def test_missions_arrive_alike_by_each_kind_of_set_point(tmp_path: Path, world: str) -> None:
    mission = WORLDS[world].replace('name = "pillar"', f'name = "{world}"')
    mission = mission.replace(
        "[mission]\n", "[mission]\norigin_geodetic = [52.0, 4.3, 10.0]\n"
    )  # fmt: skip
    seconds = []
    for kind in KINDS:
        parameters = PARAMETERS.format(kind=kind) + TRAFFIC
        flown = flown_apart(
            tmp_path, mission, parameters, "ros2", 900, "--end-on-arrival", kind=kind
        )
        robot = flown.robot
        nearest = min(robot["nearest_m"], robot["nearest_intruder_m"])
        print(f"| {world}, {kind} | {robot['arrived']} | {nearest:.2f} m | {robot['seconds']} s |")
        assert flown.status == 0, kind
        assert flown.node["reached"], kind
        assert robot["arrived"], kind
        assert robot["nearest_m"] >= MARGIN_M, kind
        assert robot["nearest_intruder_m"] >= MARGIN_M, kind
        seconds.append(robot["seconds"])
    assert max(seconds) <= MOST_RATIO * min(seconds), dict(zip(KINDS, seconds, strict=True))


@pytest.mark.skipif(not PYTHONS, reason=NO_ROS)
@pytest.mark.parametrize("python", PYTHONS)
def test_twist_leads_a_robot_by_rclpy(tmp_path: Path, python: str) -> None:
    """PyPI has no mavros_msgs and no px4_msgs for ROS, which the other kinds need."""
    parameters = PARAMETERS.format(kind="Twist")
    flown = flown_apart(
        tmp_path, PILLAR, parameters, "ros2", 900, "--end-on-arrival", kind="Twist", ros=python
    )
    assert flown.status == 0
    assert flown.robot["arrived"]
    assert flown.robot["nearest_m"] >= MARGIN_M
