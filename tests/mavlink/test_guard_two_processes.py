"""The guardian over MAVLink as a user runs it: between an autopilot and who commands it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest

pytest.importorskip("pymavlink", reason="needs the packages of [mavlink]")

from free_ports import free_port

PILLAR = """
[mission]
name = "guarded"
waypoints_m = [[{goal}, 0, 5]]

[vehicle]
kind = "{kind}"
position_m = [0, 0, 5]
speed_mps = 1.0
body_radius_m = 0.1
pitch_limit_deg = 0

[safety]
margin_m = 0.6

[[obstacle]]
name = "pillar"
shape = "line"
position_m = [{at}, 0, 5]
orientation_deg = [0, 90, 0]
size_m = [20]
radius_m = 0.6
"""
MARGIN_M = 0.6


class FlownGuarded(NamedTuple):
    guard: dict[str, Any]
    vehicle: dict[str, Any]
    said: str


def flown(folder: Path, mission: str, seconds: float, *more: str) -> FlownGuarded:
    """The vehicle and who commands it in one process, the guardian in another; in lock-step."""
    (folder / "m.toml").write_text(mission)
    autopilot, commands = free_port(), free_port()
    guard = subprocess.Popen(
        [
            *(sys.executable, "-m", "clearway", "guard", folder / "m.toml"),
            *("--connect", f"udpin:127.0.0.1:{autopilot}"),
            *("--commands", f"udpin:127.0.0.1:{commands}"),
            *("--act", "--lock-step", "--rate", "10", "--heartbeat-s", "30", "--json"),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert guard.stderr is not None
        while "waiting" not in (line := guard.stderr.readline()):
            assert line, "ended before it listened"
        vehicle = subprocess.run(
            [
                *(sys.executable, "-m", "clearway.mavlink.simulated", folder / "m.toml"),
                *("--connect", f"udpout:127.0.0.1:{autopilot}"),
                *("--pilot", f"udpout:127.0.0.1:{commands}"),
                *("--lock-step", "--duration", str(seconds), *more),
            ],
            capture_output=True,
            text=True,
            check=False,
            timeout=500,
        )
        guard.terminate()
        output, said = guard.communicate(timeout=60)
    finally:
        guard.kill()
        guard.communicate()
    assert vehicle.stdout, vehicle.stderr
    assert guard.returncode == 0, said
    return FlownGuarded(json.loads(output), json.loads(vehicle.stdout), said)


def test_sticks_held_at_a_pillar_are_let_through_until_it_is_near(tmp_path: Path) -> None:
    flight = flown(tmp_path, PILLAR.format(kind="inertialess", goal=9, at=4), 6.0, "--sticks")
    assert flight.vehicle["nearest_obstacle_m"] >= MARGIN_M - 0.05
    assert flight.guard["heard"]["MANUAL_CONTROL"] > 40
    assert flight.guard["passed"] > 10
    assert flight.guard["replaced"] > 5
    assert flight.vehicle["refused"] == {}
    assert "m asked" in "".join(flight.vehicle["texts"]), "why is told to the ground"


@pytest.mark.nightly
@pytest.mark.parametrize("more", [(), ("--sticks",)])
def test_who_wants_through_a_pillar_is_led_past_or_held(tmp_path: Path, more: tuple[str]) -> None:
    flight = flown(tmp_path, PILLAR.format(kind="inertialess", goal=16, at=8), 90.0, *more)
    assert flight.vehicle["nearest_obstacle_m"] >= MARGIN_M - 0.05
    assert flight.guard["passed"] > 40
    assert flight.guard["replaced"] > 5


@pytest.mark.nightly
def test_and_of_a_vehicle_that_cannot_stop(tmp_path: Path) -> None:
    flight = flown(tmp_path, PILLAR.format(kind="plane", goal=40, at=14), 90.0)
    assert flight.vehicle["nearest_obstacle_m"] >= MARGIN_M - 0.05
    assert flight.guard["passed"] > 40
    assert flight.guard["replaced"] > 5
