"""Who decides is killed or stopped in flight, towards a wall: the escape is flown to its end."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("pymavlink", reason="needs the packages of [mavlink]")

from hand_flights import end, fly, kill, stop
from mavlink_for_tests import KEY

pytestmark = pytest.mark.realtime

MARGIN_M = 1.0
AT_WALL_S = 6.5
"""Flown straight at it by a pilot, and 4.5 m before it."""
LONGEST_GAP_S = 1.0
"""The autopilot would do something of its own after three."""
FLIES, FLOWN = "its escape is flown", "escape flown"


def test_a_guardian_killed_before_a_wall_stops_short_of_it(tmp_path: Path) -> None:
    flight = fly(tmp_path, kill, AT_WALL_S, command="guard")
    assert flight.autopilot.nearest_obstacle_m >= MARGIN_M
    assert flight.autopilot.has_arrived  # It holds a place, at rest.
    assert flight.gap_s < LONGEST_GAP_S
    texts = "".join(flight.autopilot.texts)
    assert FLIES in texts
    assert FLOWN in texts
    assert not flight.left


def test_without_the_second_process_it_does_not(tmp_path: Path) -> None:
    flight = fly(tmp_path, kill, AT_WALL_S, command="guard", more=["--no-hand"])
    assert "nobody flies its escape" in flight.said
    assert flight.after == 0
    assert flight.autopilot.nearest_obstacle_m < MARGIN_M


def test_a_mission_stopped_and_told_to_go_on_finds_itself_relieved(tmp_path: Path) -> None:
    more = ["--out", str(tmp_path / "out")]
    flight = fly(tmp_path, stop, 4.0, continues_s=5.0, more=more)
    assert flight.status == 1
    assert flight.result is not None
    assert flight.result["state"] == "relieved"
    assert flight.autopilot.has_arrived
    assert flight.autopilot.nearest_obstacle_m >= MARGIN_M
    assert flight.gap_s < LONGEST_GAP_S
    log = (tmp_path / "out" / "decisions.jsonl").read_text()
    assert '"hand": "flies the escape", "why": "the deciding process is silent"' in log
    assert "the second process has taken over" in log


@pytest.mark.nightly
def test_a_guardian_that_was_relieved_ends_with_status_1(tmp_path: Path) -> None:
    flight = fly(tmp_path, stop, 4.0, continues_s=5.0, command="guard", after_s=8.0)
    assert flight.status == 1
    assert flight.result is not None
    assert flight.result["state"] == "relieved"
    assert FLOWN in "".join(flight.autopilot.texts)
    assert flight.autopilot.nearest_obstacle_m >= MARGIN_M


@pytest.mark.nightly
def test_frames_of_the_second_process_are_signed_and_taken(tmp_path: Path) -> None:
    flight = fly(tmp_path, kill, 4.0, key=KEY)
    assert flight.autopilot.refused == {}
    assert FLOWN in "".join(flight.autopilot.texts)
    assert flight.autopilot.has_arrived


@pytest.mark.nightly
def test_frames_are_taken_of_both_where_one_stood_in_for_the_other(tmp_path: Path) -> None:
    flight = fly(tmp_path, stop, 3.0, continues_s=0.5, key=KEY)
    assert flight.autopilot.refused == {}
    assert FLIES not in "".join(flight.autopilot.texts)
    assert flight.result is not None
    assert flight.result["state"] == "flying"


def test_ended_in_good_order_nothing_is_flown_and_no_process_left(tmp_path: Path) -> None:
    flight = fly(tmp_path, end, 2.0, after_s=4.0)
    assert FLIES not in "".join(flight.autopilot.texts)
    assert "ends, set-points stop" in "".join(flight.autopilot.texts)
    # A last one to hold, and then none: an escape would be flown for seconds.
    assert max(flight.came_s) < flight.cut_s + LONGEST_GAP_S
    assert flight.autopilot.target is not None
    assert flight.autopilot.target.velocity_mps is None
    assert flight.autopilot.has_arrived
    assert not flight.left
