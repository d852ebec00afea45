"""Pictures of a copter's flight tell how fast it is, why no faster, and where it would stop."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import clearway as cw
from clearway.sim import Run
from clearway.view.plot.speed_flight import LIMITS, draw_speed_flight, draw_speed_moment, has_speeds
from clearway.view.plot.speed_track import measure_braking, measure_plan
from clearway.view.plot.style import house_style
from whole_pictures import flaws_of


@cache
def flown() -> Run:
    mission = cw.read_mission("copter-columns")
    return cw.fly(mission.with_values("simulation", time_limit_s=4.4))


def legend_of(figure) -> set[str]:
    return {text.get_text() for legend in figure.legends for text in legend.get_texts()}


def test_the_whole_flight_has_speed_limits_and_escapes():
    with house_style():
        figure = draw_speed_flight(flown(), "flight")
        assert flaws_of(figure) == []
    named = {
        "escape: brakes to rest",
        "speed flown",
        "fastest that stops within sight",
        "obstacles",
    }
    assert named <= legend_of(figure)
    limits = {entry.flight.decision.speed.limit for entry in flown().decisions}
    assert len(limits) >= 2
    assert {f"limited by {LIMITS[limit][1]}" for limit in limits} <= legend_of(figure)


def test_a_moment_says_why_and_shows_sight_plan_and_escape():
    with house_style():
        figure = draw_speed_moment(flown(), 9, "moment")
        assert flaws_of(figure, frozenset({"waypoints"})) == []
    told = " ".join(" ".join(axes.get_title().split()) for axes in figure.axes)
    assert flown().decisions[9].flight.decision.speed.in_words in told
    assert "escape after its first: " in told
    assert "then Hold; at rest after" in told
    assert {"observed free space", "planned", "escape: brakes to rest"} <= legend_of(figure)


def test_distances_are_those_of_the_ways():
    for entry in flown().decisions:
        decision = entry.flight.decision
        steps = np.linalg.norm(np.diff(decision.path_m[:, :2], axis=0), axis=1)
        plan = measure_plan(decision)
        assert plan[-1, 0] == pytest.approx(steps.sum(), abs=0.05)
        escape = measure_braking(decision)
        assert escape[-1, 1] == 0.0
        assert escape[1] == pytest.approx(plan[1])
        way = np.linalg.norm(np.diff(decision.way_out_path_m[:, :2], axis=0), axis=1).sum()
        assert escape[-1, 0] - escape[1, 0] == pytest.approx(way, abs=0.05)


def test_a_plane_is_drawn_as_before():
    run = cw.fly(cw.read_mission("static-obstacles").with_values("simulation", time_limit_s=3.0))
    assert not has_speeds(run)
    assert "executed" in legend_of(cw.draw_flight(run))
    assert has_speeds(flown())
    assert "executed" not in legend_of(cw.draw_flight(flown()))
