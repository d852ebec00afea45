"""Mission control: order of waypoints, reach radius, no-progress rule."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clearway.base.errors import InputError
from clearway.base.state import State
from clearway.live.mission import (
    Mission,
    Progress,
    advance_progress,
    begin_detour,
    is_without_progress,
    news_in_m,
)

START = State(np.zeros(3))
MISSION = Mission(
    "test", START, waypoints_m=np.array([[10.0, 0, 0], [10.0, 10.0, 0]]), reach_radius_m=1.0
)


def test_waypoints_are_reached_in_order():
    progress = advance_progress(MISSION, Progress(), np.array([10.0, 10.0, 0.0]), 1.0)
    assert progress.goal == 0, "the second waypoint does not count before the first"
    progress = advance_progress(MISSION, progress, np.array([9.2, 0.0, 0.0]), 2.0)
    assert (progress.goal, progress.reached_s) == (1, (2.0,))
    progress = advance_progress(MISSION, progress, np.array([10.0, 9.0, 0.0]), 3.0)
    assert progress.is_done(MISSION)
    assert progress.waypoints_reached(MISSION) == 2


@given(
    st.lists(st.tuples(*[st.floats(-1.5, 1.5)] * 3), min_size=1, max_size=60),
    st.sampled_from([None, 0.5, 4.0]),
    st.booleans(),
)
def test_no_news_before_it_is_said_to_come(steps, pass_within_m, level):
    """Whoever asks only where there may be news hears all there is."""
    mission = Mission(
        "by",
        START,
        waypoints_m=np.array([[4.0, 0, 0], [4.0, 4.0, 1.0], [0, 0, 0]]),
        pass_within_m=pass_within_m,
    )
    always = seldom = Progress()
    place, ahead_m = np.zeros(3), 0.0
    for now, step in enumerate(np.array(steps)):
        place = place + step
        ahead_m -= float(np.linalg.norm(step))
        always = advance_progress(mission, always, place, float(now), stays_level=level)
        if ahead_m <= 1e-9:
            seldom = advance_progress(mission, seldom, place, float(now), stays_level=level)
            ahead_m = news_in_m(mission, seldom, place, stays_level=level)
        assert vars(seldom) == vars(always)


def test_coming_nearer_changes_nothing_else():
    before = Progress(goal=1, reached_s=(2.0,), detours=3, stuck_m=9.0, in_vain_s=4.0, tried=2)
    nearer = advance_progress(MISSION, before, np.array([10.0, 4.0, 0.0]), 7.0)
    expected = replace(before, nearest_m=6.0, nearest_s=7.0, in_vain_s=0.0)
    assert type(nearer) is Progress
    assert vars(nearer) == vars(expected)


def test_a_start_on_the_first_waypoint_reaches_it_at_once():
    mission = Mission(
        "test", START, waypoints_m=np.array([[0.0, 0, 0], [5.0, 0, 0]]), reach_radius_m=1.0
    )
    assert advance_progress(mission, Progress(), np.zeros(3), 0.0).goal == 1


def test_landing_points_follow_the_waypoints():
    mission = Mission(
        "test",
        START,
        waypoints_m=np.array([[5.0, 0, 0]]),
        reach_radius_m=1.0,
        landing_m=np.array([[5.0, 0, -3.0]]),
    )
    progress = advance_progress(mission, Progress(), np.array([5.0, 0, 0]), 5.0)
    assert progress.landing(mission)
    assert not progress.is_done(mission)
    np.testing.assert_array_equal(progress.target(mission), [5.0, 0, -3.0])
    assert progress.following(mission) is None


@given(st.floats(-0.9, 0.9), st.floats(0.02, 0.3), st.floats(0.0, 1.0))
def test_a_landing_ends_where_it_comes_no_nearer(aside_m, step_m, phase):
    """Flown straight past the point, it ends one step beyond the nearest place."""
    point = np.array([10.0, 0.0, 2.0])
    mission = replace(MISSION, landing_m=point[None])
    progress = replace(Progress(), goal=len(mission.waypoints_m))
    for now in range(2000):
        place = point + np.array([(now + phase) * step_m - 4.0, aside_m, 0.0])
        progress = advance_progress(mission, progress, place, float(now))
        if progress.is_done(mission):
            break
    assert progress.is_done(mission)
    assert 0.0 <= place[0] - point[0] <= 2.0 * step_m


@given(st.floats(-1.0, 1.0), st.floats(0.02, 4.0), st.floats(0.0, 1.0))
def test_a_landing_whose_radius_is_left_at_once_ends(aside: float, step_m: float, phase: float):
    """Own states may lie far apart: one within the radius, and the next beyond it."""
    point = np.array([10.0, 0.0, 2.0])
    mission = replace(MISSION, landing_m=point[None])
    progress, entered = replace(Progress(), goal=len(mission.waypoints_m)), False
    for now in range(1000):
        ahead_m = (now + phase) * step_m - 10.0
        place = point + np.array([ahead_m, aside * mission.reach_radius_m, 0.0])
        progress = advance_progress(mission, progress, place, float(now))
        entered |= bool(np.linalg.norm(place - point) <= mission.reach_radius_m)
    assert progress.is_done(mission) == entered


def test_no_progress_is_noticed_and_patience_grows():
    progress = advance_progress(MISSION, Progress(), np.zeros(3), 0.0)
    assert not is_without_progress(progress, 20.0, 20.0)
    assert is_without_progress(progress, 20.1, 20.0)
    progress = begin_detour(
        MISSION, progress, START, 21.0, 4.0, lambda *_: (np.array([0, 9.0, 0]),)
    )
    np.testing.assert_array_equal(progress.target(MISSION), [0, 9.0, 0])
    np.testing.assert_array_equal(progress.following(MISSION), [10.0, 0, 0])
    assert not is_without_progress(progress, 60.0, 20.0)
    assert is_without_progress(progress, 61.1, 20.0)
    reached = advance_progress(MISSION, progress, np.array([0, 8.0, 0]), 30.0)
    np.testing.assert_array_equal(reached.target(MISSION), [10.0, 0, 0])


def test_without_a_known_way_it_flies_away_first():
    progress = begin_detour(MISSION, Progress(), START, 0.0, 4.0, lambda *_: ())
    assert np.linalg.norm(progress.target(MISSION)) == pytest.approx(12.0)


def test_impossible_missions_are_refused_with_every_reason():
    with pytest.raises(InputError) as refused:
        Mission(
            "bad",
            START,
            waypoints_m=np.array([[0, 0, 0], [0.5, 0, 0], [np.nan, 0, 0]]),
            reach_radius_m=1.0,
        )
    assert "waypoints_m[1]: 0.5 m from the one before" in str(refused.value)
    assert "finite" in str(refused.value)


def test_all_that_is_wrong_with_the_shape_of_a_mission_is_told_at_once():
    with pytest.raises(InputError) as refused:
        Mission(
            "bad",
            [0, 0, 0],
            waypoints_m=[[1.0, 2.0]],
            reach_radius_m="near",
            landing_m="there",
            pass_within_m=-1.0,
        )
    assert refused.value.problems == (
        "start: takes a State, got list",
        "waypoints_m: must have shape [n, 3], got [1, 2]",
        "landing_m: places [n, 3] are needed, got 'there'",
        "reach_radius_m: must be a number from 0 to 1e+09, got 'near'",
        "pass_within_m: must be a number from 0 to 1e+09, got -1.0",
    )


def test_a_reach_radius_that_is_no_number_is_refused_beside_several_waypoints():
    with pytest.raises(InputError, match="reach_radius_m: must be a number"):
        Mission("bad", START, waypoints_m=[[0, 0, 0], [5, 0, 0]], reach_radius_m="near")
