"""clearway as a mode of a simulated PX4: checked, flown, given up, forgotten."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the packages of [ros2]")

from clearway.px4 import simulated_px4
from clearway.px4.mode import HOLD_MODE
from clearway.px4.releases import RELEASES
from clearway.px4.simulated_commander import Px4Habits
from clearway.ros2.bus import USUAL
from clearway.ros2.messages import make_message, pack_message
from px4_for_tests import End, Px4Bench, each, flying

MARGIN_M = 0.6
TRAJECTORY = "px4_msgs/msg/TrajectorySetpoint"


CLOUDS = {
    "cloud_topic": "/points", "clouds": {"ring": {"topic": "/points"}}, "px4": {"distances": ""},
}  # fmt: skip


def test_clouds_are_flown_by(tmp_path: Path) -> None:
    bench = flying(tmp_path, **CLOUDS)
    assert bench.link.topics["/points"].messages > 20
    assert not bench.link.topics["/points"].refused


def test_times_that_lie_apart_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """PX4 tells the time since its boot, and the sensor that of the companion computer."""
    bench = Px4Bench(tmp_path, "1.18", **CLOUDS)
    monkeypatch.setattr("clearway.px4.simulated_px4.BEGAN_S", 100.0)
    made_by = simulated_px4.cloud_message

    def synchronous(points: Any, time_s: float, frame: str) -> Any:
        return made_by(points, time_s + 1.7e9, frame)

    monkeypatch.setattr(simulated_px4, "cloud_message", synchronous)
    bench.step(40)
    assert not bench.commander.can_fly(23)
    assert bench.last is not None
    assert "UXRCE_DDS_SYNCT" in bench.last.why_state


# --- given up -----------------------------------------------------------------------------

DOUBTS = {
    "odometry stops": (Px4Habits(odometry_ends_s=9.0), "stale position"),
    "the estimator jumps": (Px4Habits(resets_s=9.0), "estimator has jumped"),
}


@pytest.mark.parametrize("release", RELEASES)
@pytest.mark.parametrize("what", DOUBTS)
def test_a_doubt_ends_in_hold(what: str, release: str, tmp_path: Path) -> None:
    habits, why = DOUBTS[what]
    bench = flying(tmp_path, release, habits=habits)
    assert bench.until(bench.holds, 10.0, pilot=False)
    assert not bench.commander.is_in_failsafe, "it asked for Hold before PX4 had to"
    assert [one for one in bench.said if "gives the vehicle up to PX4's Hold" in one and why in one]
    sent = bench.px4.heard["TrajectorySetpoint"]
    bench.step(20, pilot=False)
    assert bench.px4.heard["TrajectorySetpoint"] == sent, "no set-point in another mode"
    assert bench.px4.nearest_obstacle_m >= MARGIN_M


@pytest.mark.parametrize("release", RELEASES)
def test_a_px4_that_does_not_hold_is_told_that_the_mode_cannot_be_flown(
    release: str, tmp_path: Path
) -> None:
    bench = flying(tmp_path, release, habits=Px4Habits(resets_s=9.0, refuses_hold=True))
    assert bench.until(bench.holds, 10.0, pilot=False)
    assert bench.commander.is_in_failsafe
    assert 9.5 < bench.px4.time_s < 11.0


@each("1.16")
def test_an_invalid_estimate_ends_in_hold_and_may_be_flown_again(
    tmp_path: Path, release: str
) -> None:
    bench = flying(tmp_path, release)
    place = bench.px4.truth.position_m
    bench.commander.position_is_valid = True
    bench.px4.habits = Px4Habits()
    # PX4's own failsafe is kept out of the way: the message alone says that it is not valid.
    tell = bench.px4._send

    def invalid(message: str, told: Any) -> None:
        if message == "VehicleLocalPosition":
            told.xy_valid = False
        tell(message, told)

    bench.px4._send = invalid  # type: ignore[method-assign]
    assert bench.until(bench.holds, 1.0, pilot=False)
    assert any("PX4's position is not valid" in one for one in bench.said)
    bench.step(10, pilot=False)
    assert not bench.commander.choose(23), "while it doubts, it cannot be chosen"
    bench.px4._send = tell  # type: ignore[method-assign]
    assert bench.until(lambda: bench.commander.can_fly(23), 10.0, pilot=False)
    assert bench.commander.choose(23)
    bench.step(20, pilot=False)
    assert bench.flies()
    assert bench.link.activations == 2
    assert np.linalg.norm(bench.px4.truth.position_m - place) > 0.5


@each("1.18")
def test_a_mode_that_was_left_by_the_estimator_may_be_chosen_again(
    tmp_path: Path, release: str
) -> None:
    bench = flying(tmp_path, release, habits=Px4Habits(resets_s=9.0))
    assert bench.until(bench.holds, 10.0, pilot=False)
    bench.step(10, pilot=False)
    assert bench.commander.choose(23)
    assert bench.until(lambda: bench.commander.completed, 60.0, pilot=False)
    assert bench.px4.nearest_obstacle_m >= MARGIN_M


@each("1.18")
def test_a_dead_sensor_ends_in_hold(tmp_path: Path, release: str) -> None:
    bench = flying(tmp_path, release)
    bench.px4._tell_sensor = lambda: None  # type: ignore[method-assign]
    assert bench.until(bench.holds, 20.0, pilot=False)
    assert any("sensor lost" in one for one in bench.said)
    assert bench.px4.nearest_obstacle_m >= MARGIN_M


@each("1.18")
def test_the_pilot_takes_over_at_any_time(tmp_path: Path, release: str) -> None:
    bench = flying(tmp_path, release)
    assert bench.commander.choose(HOLD_MODE)
    bench.step(2, pilot=False)
    sent = bench.px4.heard["TrajectorySetpoint"]
    bench.step(20, pilot=False)
    assert bench.px4.heard["TrajectorySetpoint"] == sent
    assert any("PX4 flies another mode" in one for one in bench.said)
    assert not any("gives the vehicle up" in one for one in bench.said)


@each("1.18")
def test_set_points_of_another_program_are_a_doubt(tmp_path: Path, release: str) -> None:
    bench = flying(tmp_path, release)
    other = End(bench.topics)
    topic = bench.link.release.topic("TrajectorySetpoint")
    other.advertise(topic, TRAJECTORY, USUAL)
    other.publish(topic, pack_message(make_message(TRAJECTORY, velocity=np.ones(3, np.float32))))
    assert bench.until(bench.holds, 2.0, pilot=False)
    assert any("another program sends set-points" in one for one in bench.said)


# --- gone ---------------------------------------------------------------------------------


@each("1.18")
def test_a_px4_that_dies_is_reported_and_ends_the_run(tmp_path: Path, release: str) -> None:
    bench = flying(tmp_path, release, habits=Px4Habits(dies_s=9.0))
    states = []
    for _ in range(80):
        bench.step(pilot=False)
        assert bench.last is not None
        states.append(str(bench.last.state))
    assert "stale position" in states
    assert states[-1] == "autopilot restarted"
    assert bench.link.is_forgotten
    assert any("gives the vehicle up" in one for one in bench.said)


@pytest.mark.parametrize("release", RELEASES)
def test_a_px4_that_forgot_the_mode_ends_the_run(release: str, tmp_path: Path) -> None:
    bench = flying(tmp_path, release, habits=Px4Habits(restarts_s=9.0))
    assert bench.until(lambda: bench.link.is_forgotten, 15.0, pilot=False)
    assert bench.holds()
    assert bench.last is not None
    assert "no longer asks" in bench.last.why_state


@pytest.mark.parametrize(("release", "most_s"), [("1.16", 1.6), ("1.17", 1.6), ("1.18", 0.7)])
def test_px4_leaves_a_mode_whose_process_died(release: str, most_s: float, tmp_path: Path) -> None:
    """Of the partner: that it fails over as PX4 does, so that the others show anything."""
    bench = flying(tmp_path, release)
    assert bench.until(bench.holds, most_s, pilot=False, node=False)
    assert bench.commander.is_in_failsafe


@each("1.18")
def test_the_end_leaves_px4_holding(tmp_path: Path, release: str) -> None:
    bench = flying(tmp_path, release)
    bench.link.end()
    bench.px4.step()
    assert bench.holds()
    assert not bench.commander.modes
    assert not bench.commander.is_in_failsafe


@each("1.18")
def test_nonsense_from_px4_is_counted_and_ends_nothing(tmp_path: Path, release: str) -> None:
    bench = flying(tmp_path, release)
    other, rng = End(bench.topics), np.random.default_rng(5)
    heard = [one for one in bench.link.topics if one.startswith("/fmu/")]
    for topic in heard:
        other.told.add(topic)
    for _ in range(20):
        for topic in heard:
            other.publish(topic, b"\0\1\0\0" + rng.bytes(int(rng.integers(0, 400))))
        bench.step(pilot=False)
    malformed = [one for one in bench.counts_of("malformed") if one.startswith("/fmu/")]
    assert len(malformed) >= 5
    assert bench.px4.nearest_obstacle_m >= MARGIN_M
