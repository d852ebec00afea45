"""`clearway px4` and a simulated PX4 in processes of their own, over DDS on the loopback."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from clearway.px4.mode import HOLD_MODE
from clearway.px4.releases import RELEASES
from clearway.px4.setup import find_release
from clearway.px4.simulated import ModePilot
from clearway.px4.simulated_px4 import SimulatedPx4
from repository import REPOSITORY
from ros2_for_tests import DOMAIN, LOOPBACK
from ros2_processes import ENVIRONMENT, all_ended, begun

pytestmark = pytest.mark.realtime

EXAMPLES = REPOSITORY / "examples" / "ros2"
WALL, PILLAR = EXAMPLES / "px4_wall.toml", EXAMPLES / "pillar.toml"
RING = "px4: {wait_s: 60.0, distances: /fmu/in/obstacle_distance}"
CLOUD = "px4: {wait_s: 60.0}\n    clouds: {front: {topic: points}}"


def node(folder: Path, mission: Path, more: str, *options: object) -> subprocess.Popen[str]:
    text = f"/**:\n  ros__parameters:\n    mission: {mission}\n    act: true\n    {more}\n"
    (folder / "px4.yaml").write_text(text)
    return begun("-m", "clearway", "px4", folder / "px4.yaml", "--domain", DOMAIN, *options)


def flown(folder: Path, release: str, mission: Path, more: str, *px4: object) -> dict[str, Any]:
    """Both processes in lock-step, to the end."""
    more = f"use_sim_time: true\n    {more}"
    ours = node(folder, mission, more, "--end-on-arrival", "--duration", 120, "--json")
    other = begun(
        "-m", "clearway.px4.simulated", mission, "--release", release, "--domain", DOMAIN,
        "--lock-step", "--duration", 200, *px4,
    )  # fmt: skip
    with all_ended(ours, other):
        truth = json.loads(other.communicate(timeout=200)[0])
        told = json.loads(ours.communicate(timeout=60)[0])
        assert (ours.returncode, other.returncode) == (0, 0), json.dumps([told, truth])
    assert told["px4"] == {"release": release, "activations": 1}
    assert told["reached"]
    assert truth["nav_state"] == HOLD_MODE, "at the end the mode leaves PX4, which holds"
    assert not truth["failsafe"]
    return truth


def test_a_multirotor_flies_past_a_wall_by_level_distances(tmp_path: Path) -> None:
    truth = flown(tmp_path, "1.18", WALL, RING)
    assert truth["nearest_obstacle_m"] >= 0.8
    assert truth["from_goal_m"] < 1.5


@pytest.mark.nightly
@pytest.mark.parametrize("release", RELEASES)
def test_a_pillar_is_passed_by_clouds(release: str, tmp_path: Path) -> None:
    truth = flown(tmp_path, release, PILLAR, CLOUD, "--cloud", "/points")
    assert truth["nearest_obstacle_m"] >= 0.6


@pytest.fixture
def px4(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A simulated PX4 in this process, at our clock's pace."""
    from clearway.missions.mission_file import read_mission_file
    from clearway.missions.setup import prepare
    from clearway.ros2.dds import DdsBus

    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    file = read_mission_file(str(WALL))
    bus = DdsBus(DOMAIN)
    yield SimulatedPx4(bus, file, prepare(file), RELEASES["1.17"])
    bus.close()


def stepped_until(px4: SimulatedPx4, true: Any, seconds: float = 90.0) -> bool:
    """In real time, by a pilot that flies the mode."""
    pilot, ends = ModePilot(px4, "clearway"), time.monotonic() + seconds
    while time.monotonic() < ends and not true():
        began = time.monotonic()
        if not px4.flies_external:
            pilot.act()
        px4.step(0.1)
        time.sleep(max(0.0, began + 0.1 - time.monotonic()))
    return bool(true())


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM], ids=["killed", "ended"])
def test_px4_holds_when_the_process_goes(px4: SimulatedPx4, how: int, tmp_path: Path) -> None:
    ours = node(tmp_path, WALL, RING, "--no-hand")
    with all_ended(ours):
        assert stepped_until(px4, lambda: px4.heard["TrajectorySetpoint"] > 10)
        assert px4.flies_external
        ours.send_signal(how)
        assert stepped_until(px4, lambda: px4.commander.nav_state == HOLD_MODE, 20.0)
    assert px4.commander.is_in_failsafe == (how == signal.SIGKILL)
    assert px4.nearest_obstacle_m >= 0.8


def test_a_release_is_found_over_dds(px4: SimulatedPx4) -> None:
    from clearway.ros2.dds import DdsBus

    other = DdsBus(DOMAIN)
    try:
        assert find_release(other, "", 30.0).name == px4.release.name
    finally:
        other.close()


def test_no_px4_ends_with_what_to_look_for(tmp_path: Path) -> None:
    path = tmp_path / "px4.yaml"
    text = f"/**:\n  ros__parameters:\n    mission: {WALL}\n    px4: {{wait_s: 0.5}}\n"
    path.write_text(text)
    done = subprocess.run(
        [sys.executable, "-m", "clearway", "px4", str(path), "--domain", str(DOMAIN)],
        capture_output=True, text=True, env=ENVIRONMENT, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert "MicroXRCEAgent" in done.stderr
    assert "Traceback" not in done.stderr
