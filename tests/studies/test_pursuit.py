"""Intruders that want to hit: what the map of won encounters must look like."""

import json

import numpy as np
import pytest

from clearway.base.errors import InputError
from clearway.studies.encounters.avoidable import Opponent, search_avoidance
from clearway.studies.encounters.pursuit import CHOSEN_MOVEMENTS, MOST_MOVEMENTS, win_map
from clearway.vehicle.automaton import MovementAutomaton
from in_process import clearway

KEEP = 1.2
BEARINGS = np.radians([0.0, 20.0, 40.0, 60.0])
SPEEDS = (0.5, 0.7, 0.9)
BOUNDS = (0.0, 0.05, 0.1, 0.26, 100.0)


def mapped(detected_at=6.0, bounds=BOUNDS):
    return win_map(detected_at, bounds, BEARINGS.tolist(), SPEEDS, KEEP)


def test_a_collision_course_exists_where_the_intruder_is_fast_enough():
    """sin(bearing) <= speed: a slower one cannot get there in time."""
    np.testing.assert_array_equal(
        mapped(bounds=()).exists, np.sin(BEARINGS)[:, None] <= np.array(SPEEDS)
    )


def test_more_acceleration_wins_nothing_back():
    found = mapped()
    for lesser, greater in zip(found.won[:-1], found.won[1:], strict=True):
        assert not np.any(greater & ~lesser)
    assert found.share[0] == 1.0
    assert 0.0 < found.share[-1] < 1.0
    assert np.all(np.diff(found.share) <= 0.0)


def test_from_10_m_every_slower_pursuer_is_outrun():
    assert mapped(10.0).share.min() == 1.0


def test_what_is_won_stays_out_of_reach_of_pursuers_that_do_their_worst():
    """Chasers of the stated speed and bound never come near the plan that the search found."""
    plane = MovementAutomaton.plane()
    place, velocity, bound = np.array([6.0, 0.0, 0.0]), np.array([-0.7, 0.0, 0.0]), 0.1
    verdict = search_avoidance(
        plane, Opponent(place, velocity, bound), KEEP, MOST_MOVEMENTS, CHOSEN_MOVEMENTS
    )
    assert verdict.for_good
    track = plane.rollout(np.zeros(6), (*verdict.movements, *["Straight"] * 40))
    for lead_s in (0.0, 1.0, 2.0, 4.0, 8.0):
        assert nearest_chaser(track, place, velocity, bound, lead_s) >= KEEP


def nearest_chaser(track, place, velocity, bound, lead_s):
    """Smallest distance of a chaser that heads for where the ownship will be after a while."""
    speed, position, gap = np.linalg.norm(velocity), place.copy(), np.inf
    for at in range(len(track.time_s) - 1):
        step = track.time_s[at + 1] - track.time_s[at]
        gap = min(gap, float(np.linalg.norm(track.states[at, :3] - position)))
        ahead = np.searchsorted(track.time_s, track.time_s[at] + lead_s)
        aim = track.states[min(ahead, len(track.time_s) - 1), :3] - position
        wanted = speed * aim / max(np.linalg.norm(aim), 1e-9) - velocity
        push = wanted * min(1.0, bound * step / max(np.linalg.norm(wanted), 1e-9))
        velocity = velocity + push
        velocity = velocity * min(1.0, speed / max(np.linalg.norm(velocity), 1e-9))
        position = position + step * velocity
    return gap


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((6.0, (-1.0,), (0.0,), (0.5,), KEEP), "accelerations"),
        ((6.0, (0.0,), (0.0,), (1.0,), KEEP), "speeds"),
        ((np.nan, (0.0,), (0.0,), (0.5,), KEEP), "detected_at_m"),
        ((6.0, (0.0,), (0.0,), (0.5,), 0.0), "keep_m"),
    ],
)
def test_impossible_maps_are_refused(arguments, said):
    with pytest.raises(InputError, match=said):
        win_map(*arguments)


def test_the_command_draws_and_prints(tmp_path):
    options = ["--bearing-step-deg", "20", "--accelerations", "0,0.1", "--out", "out", "--json"]
    done = clearway("pursuit", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert np.array(result["won"]).shape == (2, 5, 10)
    assert result["share"][0] == 1.0
    assert (tmp_path / "out" / "win-map.png").stat().st_size > 10_000
