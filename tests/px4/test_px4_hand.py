"""A mode of PX4 whose process is killed or stopped before a wall, by processes over DDS."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.px4.mode import HOLD
from clearway.px4.releases import RELEASES
from clearway.px4.simulated import ModePilot
from clearway.px4.simulated_px4 import SimulatedPx4
from clearway.ros2.dds import DdsBus
from hand_flights import WALL
from ros2_for_tests import LOOPBACK
from ros2_processes import all_ended, begun

DOMAIN = 97
"""Of these tests alone."""
MARGIN_M = 1.0
STEP_S = 0.02
STARTS_S = 90.0
PARAMETERS = """
/**:
  ros__parameters:
    mission: {mission}
    act: true
    px4: {{wait_s: 60.0, distances: /fmu/in/obstacle_distance}}
"""


class Flight:
    """A simulated PX4 in this process, at our clock's pace, and `clearway px4` in another."""

    def __init__(self, folder: Path, release: str, *options: object) -> None:
        (folder / "m.toml").write_text(WALL)
        (folder / "p.yaml").write_text(PARAMETERS.format(mission=folder / "m.toml"))
        file = read_mission_file(str(folder / "m.toml"))
        self.bus = DdsBus(DOMAIN)
        self.px4 = SimulatedPx4(self.bus, file, prepare(file), RELEASES[release])
        self.pilot = ModePilot(self.px4, "clearway")
        self.came_s: list[float] = []
        self.node = begun(
            "-m", "clearway", "px4", folder / "p.yaml", "--domain", DOMAIN, "--json", *options
        )

    def until(self, true: Callable[[], bool], seconds: float = STARTS_S) -> bool:
        """Fly on until something becomes true; the pilot chooses the mode once."""
        ends_s, due_s, px4 = time.monotonic() + seconds, time.monotonic(), self.px4
        while time.monotonic() < ends_s and not true():
            if not px4.commander.is_in_failsafe and not self.came_s:
                self.pilot.act()
            before = px4.heard["TrajectorySetpoint"]
            px4.step(STEP_S)
            self.came_s += [px4.time_s] * (px4.heard["TrajectorySetpoint"] - before)
            due_s += STEP_S
            time.sleep(max(0.0, due_s - time.monotonic()))
        return bool(true())
