"""A guardian as a mode of a simulated PX4, and parameters that cannot be used."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the packages of [ros2]")

from clearway.base.errors import InputError
from clearway.ros2.bus import USUAL
from clearway.ros2.messages import make_message, pack_message
from px4_for_tests import End, Px4Bench

MARGIN_M = 0.6
TRAJECTORY = "px4_msgs/msg/TrajectorySetpoint"

# --- guarded ------------------------------------------------------------------------------

WISHES = {"topic": "/wishes", "type": "TrajectorySetpoint"}


def guarded(folder: Path, velocity_ned: tuple[float, float, float]) -> tuple[Px4Bench, Any]:
    """Somebody who wishes a velocity at every step."""
    bench = Px4Bench(folder, "1.18", guard=WISHES)
    commands = End(bench.topics)
    commands.advertise("/wishes", TRAJECTORY, USUAL)
    nowhere = np.full(3, np.nan, np.float32)
    wish = make_message(
        TRAJECTORY, position=nowhere, velocity=np.array(velocity_ned, np.float32), yaw=np.nan,
        acceleration=nowhere, jerk=nowhere, yawspeed=0.0,
    )  # fmt: skip

    def step(count: int) -> None:
        for _ in range(count):
            commands.publish("/wishes", pack_message(wish))
            bench.step()

    return bench, step


def test_a_guardian_stops_a_command_before_the_wall(tmp_path: Path) -> None:
    bench, step = guarded(tmp_path, (0.0, 1.0, 0.0))  # East, straight at it.
    step(250)
    assert bench.flies()
    assert bench.session.tally["passed"] > 20
    assert bench.px4.truth.position_m[0] > 3.0
    assert bench.px4.nearest_obstacle_m >= MARGIN_M


def test_a_guardian_lets_a_safe_command_pass(tmp_path: Path) -> None:
    bench, step = guarded(tmp_path, (0.0, -1.0, 0.0))  # West, away from it.
    step(50)
    assert bench.flies()
    replaced = bench.session.tally["replaced"]  # While it took off, nobody had looked about.
    step(70)
    assert bench.px4.truth.position_m[0] < -4.0
    assert bench.session.tally["replaced"] == replaced


def test_a_guardian_is_chosen_once_somebody_commands(tmp_path: Path) -> None:
    bench = Px4Bench(tmp_path, "1.18", guard=WISHES)
    bench.step(60)
    assert bench.commander.is_armed
    assert not bench.commander.can_fly(23)
    assert bench.last is not None
    assert "no command has come on /wishes" in bench.last.why_state


def test_a_guardian_whose_commander_dies_stays_and_holds(tmp_path: Path) -> None:
    bench, step = guarded(tmp_path, (0.0, -1.0, 0.0))
    step(80)
    assert bench.flies()
    bench.step(50, pilot=False)
    assert bench.flies()
    assert np.linalg.norm(bench.px4.truth.velocity_mps) < 0.1


# --- wrong input --------------------------------------------------------------------------


def test_commands_on_px4s_own_topic_are_refused(tmp_path: Path) -> None:
    own = WISHES | {"topic": "/fmu/in/trajectory_setpoint"}
    with pytest.raises(InputError, match=r"PX4's own: command another topic"):
        Px4Bench(tmp_path, "1.18", guard=own)


def test_distances_and_clouds_at_once_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"state one of both"):
        Px4Bench(tmp_path, "1.18", clouds={"ring": {"topic": "points"}})
