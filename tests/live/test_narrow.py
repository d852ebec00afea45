"""Places where a plane cannot turn: refused, or flown through as the mission allows, and told."""

from __future__ import annotations

from functools import cache

import pytest

from clearway.base.errors import InputError
from clearway.live.mission import Mode
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim import Run
from worlds_for_tests import flown, mission, planner

STREET = ObstacleMap(
    [Obstacle.cuboid([32.0, side * 102.5, 0.0], (24.0, 200.0, 200.0)) for side in (-1.0, 1.0)]
)
"""5 m wide and 24 m long, the only way through: a turn takes 7.6 m, and what is seen is 10 m."""
BEYOND = mission((60.0, 0.0, 0.0))


@cache
def through_the_street(narrow: str) -> Run:
    return flown(STREET, BEYOND, settings={"narrow": narrow}, time_limit_s=150.0)


def test_what_leaves_no_room_to_turn_is_not_entered_unless_the_mission_says_so() -> None:
    run = through_the_street("refuse")
    assert not run.reached
    assert run.metrics.margin_violations == 0
    assert run.summary()["no_guarantee_s"] == []
    assert run.states[:, 0].max() < 40.0


def test_a_mission_that_must_go_through_does_and_says_where_no_guarantee_held() -> None:
    run = through_the_street("allow")
    assert run.reached
    assert run.metrics.margin_violations == 0
    spans = run.summary()["no_guarantee_s"]
    inside = run.time_s[(run.states[:, 0] > 25.0) & (run.states[:, 0] < 32.0)]
    assert any(begin <= inside[0] and inside[-1] <= end for begin, end in spans)
    begins = run.summary()["way_out_from_s"]
    flights = [entry.flight for entry in run.decisions if entry.flight.time_s > begins]
    narrow = [flight for flight in flights if flight.mode is Mode.NARROW]
    assert narrow
    for flight in narrow:
        assert flight.decision.way_out is None
        assert "no guarantee" in flight.explanation
        assert any(begin <= flight.time_s <= end for begin, end in spans)
    assert "no guarantee" in narrow[0].mode_state.transition
    assert run.to_row()["no_guarantee_s"] == pytest.approx(sum(b - a for a, b in spans))


def test_other_words_for_it_are_refused() -> None:
    with pytest.raises(InputError, match="narrow: 'yes' is none of refuse, allow"):
        planner(narrow="yes")
