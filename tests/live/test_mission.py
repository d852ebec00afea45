"""Mission control: order of waypoints, reach radius, no-progress rule."""

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.base.state import State
from clearway.live.mission import Mission, Progress, advanced, detoured, stuck

START = State(np.zeros(3))
MISSION = Mission("test", START, np.array([[10.0, 0, 0], [10.0, 10.0, 0]]), 1.0)


def test_waypoints_are_reached_in_order():
    progress = advanced(MISSION, Progress(), np.array([10.0, 10.0, 0.0]), 1.0)
    assert progress.goal == 0, "the second waypoint does not count before the first"
    progress = advanced(MISSION, progress, np.array([9.2, 0.0, 0.0]), 2.0)
    assert (progress.goal, progress.reached_s) == (1, (2.0,))
    progress = advanced(MISSION, progress, np.array([10.0, 9.0, 0.0]), 3.0)
    assert progress.done(MISSION)
    assert progress.waypoints_reached(MISSION) == 2


def test_a_start_on_the_first_waypoint_reaches_it_at_once():
    mission = Mission("test", START, np.array([[0.0, 0, 0], [5.0, 0, 0]]), 1.0)
    assert advanced(mission, Progress(), np.zeros(3), 0.0).goal == 1


def test_landing_points_follow_the_waypoints():
    mission = Mission("test", START, np.array([[5.0, 0, 0]]), 1.0, np.array([[5.0, 0, -3.0]]))
    progress = advanced(mission, Progress(), np.array([5.0, 0, 0]), 5.0)
    assert progress.landing(mission)
    assert not progress.done(mission)
    np.testing.assert_array_equal(progress.target(mission), [5.0, 0, -3.0])
    assert progress.following(mission) is None


def test_no_progress_is_noticed_and_patience_grows():
    progress = advanced(MISSION, Progress(), np.zeros(3), 0.0)
    assert not stuck(progress, 20.0, 20.0)
    assert stuck(progress, 20.1, 20.0)
    progress = detoured(MISSION, progress, START, 21.0, 4.0, lambda *_: (np.array([0, 9.0, 0]),))
    np.testing.assert_array_equal(progress.target(MISSION), [0, 9.0, 0])
    np.testing.assert_array_equal(progress.following(MISSION), [10.0, 0, 0])
    assert not stuck(progress, 60.0, 20.0)
    assert stuck(progress, 61.1, 20.0)
    reached = advanced(MISSION, progress, np.array([0, 8.0, 0]), 30.0)
    np.testing.assert_array_equal(reached.target(MISSION), [10.0, 0, 0])


def test_without_a_known_way_it_flies_away_first():
    progress = detoured(MISSION, Progress(), START, 0.0, 4.0, lambda *_: ())
    assert np.linalg.norm(progress.target(MISSION)) == pytest.approx(12.0)


def test_impossible_missions_are_refused_with_every_reason():
    with pytest.raises(InputError) as refused:
        Mission("bad", START, np.array([[0, 0, 0], [0.5, 0, 0], [np.nan, 0, 0]]), 1.0)
    assert "waypoints_m[1]: 0.5 m from the one before" in str(refused.value)
    assert "finite" in str(refused.value)
