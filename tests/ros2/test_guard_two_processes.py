"""The guardian between two processes: a robot that somebody flies at a pillar."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from repository import REPOSITORY
from ros2_processes import flown_apart

pytestmark = pytest.mark.realtime

PILLAR = (REPOSITORY / "examples" / "ros2" / "pillar.toml").read_text()
PARAMETERS = """
/**:
  ros__parameters:
    mission: m.toml
    act: true
    rate: 10.0
    use_sim_time: true
    ground_m: -20.0
    clouds: {front: {topic: points}}
"""
MARGIN_M, TICK_S = 0.6, 0.1


def test_who_commands_straight_at_a_pillar_is_stopped_or_led_past(tmp_path: Path) -> None:
    near = PILLAR.replace("[12.0, 0.3, 0.0]", "[4.0, 0.3, 0.0]")
    flown = flown_apart(tmp_path, near, PARAMETERS, "guard", 45)
    assert flown.status == 0
    assert flown.node["passed"] > 5
    assert flown.node["replaced"] > 0
    assert flown.robot["led"] > 30
    assert flown.robot["nearest_m"] >= MARGIN_M - 0.05


@pytest.mark.nightly
@pytest.mark.parametrize("aside_m", [0.0, 0.3, 1.2])
def test_all_the_way(tmp_path: Path, aside_m: float) -> None:
    pillar = PILLAR.replace("[12.0, 0.3, 0.0]", f"[12.0, {aside_m}, 0.0]")
    flown = flown_apart(tmp_path, pillar, PARAMETERS, "guard", 350)
    assert flown.robot["nearest_m"] >= MARGIN_M - 0.05
    assert flown.node["passed"] > 80
