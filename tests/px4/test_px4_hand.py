"""A mode of PX4 whose process is killed or stopped before a wall, by processes over DDS."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.missions.mission_file import read_mission_file
from clearway.missions.setup import prepare
from clearway.px4.mode import HOLD_MODE
from clearway.px4.releases import RELEASES
from clearway.px4.simulated import ModePilot
from clearway.px4.simulated_px4 import SimulatedPx4
from clearway.ros2.dds import DdsBus
from hand_flights import WALL
from px4_for_tests import each
from ros2_for_tests import DOMAIN, LOOPBACK
from ros2_processes import all_ended, begun

pytestmark = pytest.mark.realtime

DEAD_END = (
    WALL.replace("range_m = 20", "range_m = 5")
    + """
[[obstacle]]
name = "left"
shape = "cuboid"
position_m = [0, 3.5, 5]
size_m = [60, 1, 20]

[[obstacle]]
name = "right"
shape = "cuboid"
position_m = [0, -3.5, 5]
size_m = [60, 1, 20]
"""
)
MARGIN_M = 1.0
STEP_S = 0.02
POSITION_MODE = 2
"""NAVIGATION_STATE_POSCTL, which a pilot flies."""
NEAR_M, HALFWAY_M = 19.3, 10.0
"""Flown at a wall 24.5 m ahead, that is seen from 5 m on."""
SETTLES_S = 5.0
TOLD_S = 0.2
"""By then the second process has heard of another mode, and what it had sent has arrived."""
UNHEEDED_S = 1.3
"""A mode that answers no arming checks has been left by then."""
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

    def __init__(self, folder: Path, release: str) -> None:
        (folder / "m.toml").write_text(DEAD_END)
        (folder / "p.yaml").write_text(PARAMETERS.format(mission=folder / "m.toml"))
        file = read_mission_file(str(folder / "m.toml"))
        self.bus = DdsBus(DOMAIN)
        self.px4 = SimulatedPx4(self.bus, file, prepare(file), RELEASES[release])
        self.pilot = ModePilot(self.px4, "clearway")
        self.node = begun(
            "-m", "clearway", "px4", folder / "p.yaml", "--domain", DOMAIN, "--json"
        )  # fmt: skip
        self.in_mode_s = 0.0
        """When PX4 last flew the mode."""

    def until(self, true: Callable[[], bool], seconds: float) -> bool:
        """Fly on until something becomes true; the pilot chooses the mode once."""
        ends_s, due_s, px4 = time.monotonic() + seconds, time.monotonic(), self.px4
        while time.monotonic() < ends_s and not true():
            if not self.in_mode_s:
                self.pilot.act()
            px4.step(STEP_S)
            self.in_mode_s = px4.time_s if px4.flies_external else self.in_mode_s
            due_s += STEP_S
            time.sleep(max(0.0, due_s - time.monotonic()))
        return bool(true())

    def fly_to(self, ahead_m: float) -> None:
        assert self.until(lambda: self.px4.truth.position_m[0] >= ahead_m, STARTS_S)
        assert self.px4.flies_external

    def settle(self) -> None:
        self.until(lambda: False, SETTLES_S)

    def next_set_point(self) -> bool:
        before = self.px4.heard["TrajectorySetpoint"]
        return self.until(lambda: self.px4.heard["TrajectorySetpoint"] > before, SETTLES_S)

    def second_process(self) -> Path:
        """Where the kernel tells of it while it is there."""
        pid = self.node.pid
        (child,) = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        return Path("/proc", child)

    def is_held(self) -> bool:
        """Whether it stands in Hold that somebody commanded, and no mode is left behind."""
        commander, speed = self.px4.commander, float((self.px4.truth.velocity_mps**2).sum())
        return (
            commander.nav_state == HOLD_MODE
            and not commander.is_in_failsafe
            and not commander.modes
            and speed < 0.1**2
        )


@contextmanager
def flight_of(folder: Path, release: str) -> Iterator[Flight]:
    flight = Flight(folder, release)
    with all_ended(flight.node):
        try:
            yield flight
        finally:
            flight.bus.close()


@pytest.fixture(autouse=True)
def on_loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)


@each("1.18")
def test_killed_before_a_wall_its_escape_is_flown_to_the_end(tmp_path: Path, release: str) -> None:
    with flight_of(tmp_path, release) as flight:
        flight.fly_to(NEAR_M)
        cut_s, second = flight.px4.time_s, flight.second_process()
        flight.node.kill()
        flight.settle()
        # Else PX4 had left the mode: after 0.5 s without set-points, or four checks unanswered.
        assert flight.in_mode_s > cut_s + UNHEEDED_S
        assert flight.is_held()
        assert flight.px4.nearest_obstacle_m >= MARGIN_M
        assert flight.px4.strays == 0
        assert not second.exists()


def test_it_sends_nothing_once_the_pilot_chooses_another_mode(tmp_path: Path) -> None:
    with flight_of(tmp_path, "1.17") as flight:
        flight.fly_to(HALFWAY_M)
        flight.node.kill()
        assert flight.next_set_point()
        assert flight.next_set_point()
        assert flight.px4.commander.choose(POSITION_MODE)
        flight.until(lambda: False, TOLD_S)
        sent = flight.px4.heard["TrajectorySetpoint"]
        flight.settle()
        assert flight.px4.heard["TrajectorySetpoint"] == sent
        assert flight.px4.heard["VehicleCommand"] == 0, "Hold is not what the pilot chose"
        assert flight.px4.commander.nav_state == POSITION_MODE
        assert not flight.px4.commander.modes


def test_it_stands_in_for_a_moment_and_a_normal_end_leaves_nothing(tmp_path: Path) -> None:
    with flight_of(tmp_path, "1.18") as flight:
        flight.fly_to(0.5)
        second = flight.second_process()
        flight.node.send_signal(signal.SIGSTOP)
        assert all(flight.next_set_point() for _ in range(3))
        flight.node.send_signal(signal.SIGCONT)
        flight.fly_to(HALFWAY_M)  # Its set-points are not another program's.
        flight.node.terminate()
        flight.settle()
        told = json.loads(flight.node.communicate(timeout=60)[0])
        assert told["px4"]["activations"] == 1
        assert flight.node.returncode == 0
        assert flight.is_held()
        assert not second.exists()


@pytest.mark.nightly
def test_stopped_it_is_relieved_and_does_not_end_the_escape(tmp_path: Path) -> None:
    with flight_of(tmp_path, "1.17") as flight:
        flight.fly_to(NEAR_M)
        cut_s = flight.px4.time_s
        flight.node.send_signal(signal.SIGSTOP)
        flight.until(lambda: flight.px4.time_s > cut_s + UNHEEDED_S, SETTLES_S)
        assert flight.px4.flies_external
        flight.node.send_signal(signal.SIGCONT)
        flight.until(lambda: flight.node.poll() is not None, SETTLES_S)
        flight.settle()
        assert flight.node.returncode == 1
        assert flight.px4.heard["VehicleCommand"] == 1, "of the second process alone"
        assert flight.is_held()
        assert flight.px4.nearest_obstacle_m >= MARGIN_M
        assert flight.px4.strays == 0
