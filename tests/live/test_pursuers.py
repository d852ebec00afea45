"""Slower intruders that turn after the vehicle: it notices, turns away and stays away."""

import numpy as np
import pytest

from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mission
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sim import SimulationSettings, simulate
from clearway.studies.encounters.flights import RADIUS_M, distance_to_keep_m, planner_at
from pursuers import Hunt, Pursuer, can_be_avoided

LASTS_S = 40.0


def flown_from(hunt, seed, lasts_s=LASTS_S):
    mission = Mission(
        "hunted", State(np.zeros(3)), waypoints_m=np.array([[80.0, 0.0, 0.0]]), reach_radius_m=1.5
    )
    return simulate(
        AvoidanceSystem(planner_at(1.0), mission),
        ObstacleMap(),
        lidars=(),
        settings=SimulationSettings(seed=seed, time_limit_s=lasts_s),
        traffic=Pursuer(hunt, RADIUS_M),
    )


def keeps(seed, lasts_s=LASTS_S):
    hunt = Hunt.of(seed)
    nearest = flown_from(hunt, seed, lasts_s).metrics.intruders.min_distance_m
    keep = distance_to_keep_m(1.0)
    return nearest >= keep - 1e-9 or not can_be_avoided(hunt, planner_at(1.0).automaton, keep, 40.0)


@pytest.mark.parametrize("seed", [0, 4, 7])
def test_pursuers_that_took_the_margin_of_straight_predictions_are_kept_away(seed):
    assert keeps(seed, 20.0)


def test_the_search_finds_a_way_where_there_is_one_and_none_where_there_is_none():
    automaton = planner_at(1.0).automaton
    assert can_be_avoided(Hunt.of(0), automaton, 1.2, 20.0)
    at_once = Hunt(np.array([1.6, 0.0, 0.0]), np.array([-0.9, 0.0, 0.0]), 10.0)
    assert not can_be_avoided(at_once, automaton, 1.2, 2.0)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(100))
def test_every_slower_pursuer_that_can_be_avoided_is_kept_away(seed):
    assert keeps(seed)
