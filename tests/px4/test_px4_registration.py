"""clearway as a mode of a simulated PX4: how it is registered, or refused."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("rosbags", reason="needs the packages of [ros2]")

from clearway.base.errors import InputError
from clearway.px4.mode import FIRST_MODE, OFFBOARD
from clearway.px4.releases import RELEASES
from clearway.px4.simulated_commander import TAKE_OFF, Px4Habits, Registered
from px4_for_tests import Px4Bench, each

MARGIN_M = 0.6


@pytest.mark.parametrize("release", RELEASES)
def test_a_mission_is_flown_past_a_wall(release: str, tmp_path: Path) -> None:
    bench = Px4Bench(tmp_path, release)
    assert bench.link.release.name == release
    assert bench.until(bench.flies)
    assert bench.until(lambda: bench.commander.completed, 60.0)
    assert bench.px4.from_goal_m < 1.5
    assert bench.px4.nearest_obstacle_m >= MARGIN_M
    assert bench.px4.fastest_mps > 0.5
    assert not bench.commander.is_in_failsafe
    assert bench.px4.strays == 0, "no set-point where PX4 flies another mode"
    assert not any("gives the vehicle up" in one for one in bench.said)


@pytest.mark.parametrize("release", RELEASES)
def test_a_px4_of_another_meaning_is_refused(release: str, tmp_path: Path) -> None:
    bench = Px4Bench(tmp_path, release, Px4Habits(api=3))
    with pytest.raises(InputError, match=r"version 3 of external modes.*px4.release"):
        bench.step(30)
    bench.px4.step()
    assert not bench.commander.modes, "it left PX4 again"


@each("1.17")
@pytest.mark.parametrize("message", ["VehicleStatus", "TrajectorySetpoint", "ArmingCheckReply"])
def test_a_message_with_other_fields_is_refused(message: str, tmp_path: Path, release: str) -> None:
    bench = Px4Bench(tmp_path, release, Px4Habits(other_fields=(message,)))
    with pytest.raises(InputError, match=rf"{message} has other fields.*update clearway"):
        bench.step(60)
    assert not bench.commander.modes, "it never registered"


def test_a_vehicle_that_takes_no_trajectories_is_refused(tmp_path: Path) -> None:
    bench = Px4Bench(tmp_path, "1.18", Px4Habits(takes_trajectories=False))
    with pytest.raises(InputError, match=r"takes no trajectories.*multicopter"):
        bench.step(60)


@each("1.18")
def test_an_armed_px4_takes_the_mode_once_it_is_disarmed(tmp_path: Path, release: str) -> None:
    bench = Px4Bench(tmp_path, release, Px4Habits(starts_armed=True))
    bench.step(40)
    assert not bench.commander.modes
    assert bench.last is not None
    assert "disarm" in bench.last.why_state
    bench.commander.is_armed = False
    assert bench.until(lambda: bench.commander.can_fly(23), 10.0, pilot=False)


@each("1.16")
def test_a_px4_that_has_eight_modes_takes_ours_once_another_ends(
    tmp_path: Path, release: str
) -> None:
    bench = Px4Bench(tmp_path, release)
    others = {number: Registered(f"mode {number}", FIRST_MODE + number) for number in range(8)}
    for one in others.values():
        one.answer = SimpleNamespace(can_arm_and_run=True)
    bench.commander.modes.update(others)
    for _ in range(40):
        for one in others.values():
            one.unanswered = 0  # Who answers stays.
        bench.step(pilot=False)
    assert not bench.commander.mode_named("clearway")
    assert bench.last is not None
    assert "eight at most" in bench.last.why_state
    del bench.commander.modes[5]
    assert bench.until(lambda: bench.commander.can_fly(28), 10.0, pilot=False)
    assert bench.commander.mode_named("clearway") == 28


@each("1.17")
def test_the_mode_takes_offboards_place(tmp_path: Path, release: str) -> None:
    bench = Px4Bench(tmp_path, release, px4={"replaces_offboard": True})
    assert bench.until(lambda: bench.commander.can_fly(23), pilot=False)
    assert bench.commander.choose(OFFBOARD)
    assert bench.commander.nav_state == 23


@each("1.18")
def test_nobody_is_armed_in_a_mode_that_does_not_take_off(tmp_path: Path, release: str) -> None:
    bench = Px4Bench(tmp_path, release)
    assert bench.until(lambda: bench.commander.can_fly(23), pilot=False)
    assert bench.commander.choose(23)
    assert not bench.commander.arm()
    assert bench.commander.choose(TAKE_OFF)
    assert bench.commander.arm()


@each("1.18")
def test_a_listener_does_not_register(tmp_path: Path, release: str) -> None:
    bench = Px4Bench(tmp_path, release, act=False)
    bench.step(40)
    assert not bench.px4.heard
    assert not bench.link.missing()
