"""The exhaustive search: cases known by geometry, witnesses flown, brute force beside it."""

import numpy as np
import pytest

from clearway.base.errors import ClearwayError
from clearway.studies.encounters.avoidable import Opponent, search_avoidance
from clearway.studies.encounters.encounter import EncounterSettings, random_encounter
from clearway.studies.encounters.flights import is_avoidable
from clearway.vehicle.automaton import MovementAutomaton

PLANE = MovementAutomaton.plane()
KEEP = 1.2


def avoidable(position, velocity, acceleration=0.0):
    opponent = Opponent(np.array(position, float), np.array(velocity, float), acceleration)
    return search_avoidance(PLANE, opponent, KEEP)


@pytest.mark.nightly
def test_a_thing_that_stands_is_avoidable_outside_the_turning_circle():
    """Round a ball: d^2 + R^2 >= (R + keep)^2, R at most v / 15 deg/s, at least v / 21.2 deg/s."""
    level, steepest = (1.0 / np.radians(rate) for rate in (15.0, 15.0 * np.sqrt(2.0)))
    far, near = (np.sqrt((radius + KEEP) ** 2 - radius**2) for radius in (level, steepest))
    assert avoidable([far + 0.01, 0, 0], [0, 0, 0]).avoidable
    assert not avoidable([near - 0.01, 0, 0], [0, 0, 0]).avoidable


def test_an_encounter_without_time_cannot_be_avoided():
    assert not avoidable([2.4, 0, 0], [-1, 0, 0]).avoidable
    assert not avoidable([1.0, 0, 0], [1, 0, 0]).avoidable


def test_one_that_flies_alongside_needs_no_more_than_straight_flight():
    assert avoidable([0, 2, 0], [1, 0, 0]).avoidable


@pytest.mark.parametrize("seed", range(20))
def test_what_the_search_finds_keeps_the_distance_when_flown(seed):
    met = random_encounter(seed, EncounterSettings(4.0))
    verdict = search_avoidance(PLANE, Opponent(met.position_m, met.velocity_mps, 0.0), KEEP)
    assert verdict.avoidable == is_avoidable(met)
    if verdict.avoidable:
        track = PLANE.rollout(np.zeros(6), (*verdict.movements, *["Straight"] * 30))
        places = met.position_m + track.time_s[:, None] * met.velocity_mps
        gaps = np.linalg.norm(track.states[:, :3] - places, axis=1)
        assert gaps.min() >= KEEP - 1e-3
    else:
        # By brute force over five movements, every end is too near on its way.
        assert not any_way_by_brute_force(met)


def any_way_by_brute_force(met, deep=4):
    states, names = [np.zeros(6)], PLANE.movements
    for step in range(deep):
        grown = []
        for state in states:
            for movement in names:
                if not PLANE.is_allowed(state, movement):
                    continue
                times = np.linspace(0.1, 1.0, 10)
                path = np.array([PLANE.predict(state, movement, time)[:3] for time in times])
                places = met.position_m + (step + times)[:, None] * met.velocity_mps
                if np.linalg.norm(path - places, axis=1).min() >= KEEP:
                    grown.append(PLANE.predict(state, movement))
        states = grown
        if not states:
            return False
    return True


def test_a_search_that_ends_undecided_says_so():
    near = Opponent(np.array([6.0, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0]), 0.0)
    assert search_avoidance(PLANE, near, KEEP).for_good
    undecided = search_avoidance(PLANE, near, KEEP, most_movements=1)
    assert undecided.avoidable
    assert not undecided.for_good


def test_an_automaton_that_never_flies_straight_is_refused():
    turning = MovementAutomaton(tuple(m for m in PLANE.movements if m.turn_rate_rps))
    with pytest.raises(ClearwayError, match="straight"):
        search_avoidance(turning, Opponent(np.zeros(3), np.zeros(3), 0.0), KEEP)
