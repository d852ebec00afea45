"""A node that leads a robot towards a wall is killed or stopped: its escape is flown to its end."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="needs the packages of [ros2]")

from hand_flights import Cut, kill, stop
from hand_topics import fly_topics
from ros2_for_tests import LOOPBACK

pytestmark = pytest.mark.realtime

MARGIN_M = 0.6
NEAR_M = 9.0
"""Flown at a wall 13.5 m ahead."""


@pytest.mark.parametrize(
    ("cut", "kind"),
    [
        (kill, "PositionTarget"),
        pytest.param(stop, "TrajectorySetpoint", marks=pytest.mark.nightly),
    ],
)
def test_the_escape_is_flown_and_that_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cut: Cut, kind: str
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    robot, cut_s, _ = fly_topics(tmp_path, cut, NEAR_M, kind)
    assert robot.nearest_m >= MARGIN_M
    assert float((robot.velocity**2).sum()) < 0.2**2
    assert "decider silent, its escape is flown" in robot.said
    assert robot.said[-1] == "escape flown, set-points stop"
    assert sum(at > cut_s for at in robot.came_s) > 3


@pytest.mark.nightly
def test_a_node_that_was_relieved_ends_with_status_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    robot, _, status = fly_topics(
        tmp_path, stop, NEAR_M, "PositionTarget", after_s=12.0, continues_s=7.0
    )
    assert status == 1
    assert "escape flown, set-points stop" in robot.said
    assert robot.nearest_m >= MARGIN_M
