"""Decisions in the middle of movements: they hold a way out as all others do."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.mission import Mode
from clearway.obstacles.obstacle import Obstacle
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import simulate_scan
from worlds_for_tests import AUTOMATON, LIDAR, mission, planner

FAR = mission((60.0, 0.0, 3.0))
PLANNER = planner()
BODY_M = PLANNER.settings.body_radius_m
NOTHING = ObstacleMap([])


def world_of(seed: int) -> ObstacleMap:
    rng = np.random.default_rng([seed, 7])
    balls = []
    while len(balls) < 14:
        place = rng.uniform([6.0, -7.0, -4.0], [45.0, 7.0, 4.0])
        radius = float(rng.uniform(0.5, 2.0))
        if np.linalg.norm(place) - radius > 4.0:
            balls.append(Obstacle.ball(place, radius))
    return ObstacleMap(balls)


class Interrupted:
    """A flight that is asked for decisions at any time; places as the plan has them."""

    def __init__(self, seed: int, decisions: int = 90) -> None:
        rng = np.random.default_rng([seed, 8])
        self.world, self.system = world_of(seed), AvoidanceSystem(PLANNER, FAR, lidars=(LIDAR,))
        state, now_s = State(np.zeros(3)), 0.0
        self.flights, self.track = [], [state.position_m]
        for _ in range(decisions):
            self.system.update(state)
            self.system.update(simulate_scan(LIDAR, self.world, state, rng))
            self.flights.append(self.system.decide(now_s))
            step_s = float(rng.choice([1.0, rng.uniform(0.05, 1.0)]))
            for share in (0.25, 0.5, 0.75, 1.0):
                flown = self.system.state_at(now_s + share * step_s)
                assert flown is not None
                self.track.append(flown.position_m)
            state, now_s = (
                State(flown.position_m, flown.attitude_rad, time_s=now_s + step_s),
                now_s + step_s,
            )


@pytest.mark.parametrize("seed", range(2))
def test_whenever_it_is_asked_a_way_out_is_in_hand_and_nothing_is_touched(seed: int) -> None:
    flight = Interrupted(seed)
    held = [f.decision.way_out is not None and f.decision.way_out.certain for f in flight.flights]
    assert all(held[held.index(True) :])
    assert flight.world.distance_m(np.array(flight.track)).min() >= BODY_M
    assert not any(f.mode is Mode.EMERGENCY for f in flight.flights[held.index(True) :])


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(100, 140))
def test_nor_in_other_worlds(seed: int) -> None:
    test_whenever_it_is_asked_a_way_out_is_in_hand_and_nothing_is_touched(seed)


def climbing() -> tuple[AvoidanceSystem, float]:
    """A system in the middle of a movement that raises the nose."""
    system = AvoidanceSystem(PLANNER, mission((30.0, 0.0, 18.0)), lidars=(LIDAR,))
    state = State(np.zeros(3))
    for now_s in range(20):
        system.update(state)
        system.update(simulate_scan(LIDAR, ObstacleMap(), state))
        flight = system.decide(float(now_s))
        way = flight.decision.way_out
        if way is not None and way.certain and AUTOMATON[flight.movements[0]].pitch_rate_rps:
            return system, now_s + 0.4
        state = system.state_at(now_s + 1.0)
    raise AssertionError("it never climbed")


def test_amid_a_change_of_pitch_the_movement_is_finished_before_the_way_out() -> None:
    """No loop closes from between two attitudes, so a fresh way out begins after the movement."""
    system, now_s = climbing()
    begun = system.movement_at(now_s)
    way = system._plan.way_out
    system.update(system.state_at(now_s))
    flight = system.decide(now_s)
    decision = flight.decision
    assert flight.mode is Mode.ESCAPE
    assert decision.under_way_s == pytest.approx(0.6)
    assert system.movement_at(now_s) == begun
    assert system.movement_at(now_s + 0.61).name == way.movements[0]
    ends = system.state_at(now_s + 0.6)
    assert abs(np.degrees(ends.attitude_rad[1]) / 15.0 % 1.0) == pytest.approx(0.0, abs=1e-6)
    assert system.due(now_s + 0.3) is None
    assert system.due(now_s + 0.6)
    assert decision.way_out is not None
    assert decision.way_out.certain


def test_who_begins_tilted_and_always_asks_a_moment_late_comes_to_the_goal() -> None:
    """As over a link, where no tick is where a movement ends, and no flight begins level."""
    system = AvoidanceSystem(planner(escape="known"), mission((40.0, 0.0, 6.0)), lidars=(LIDAR,))
    system.floor_m = -6.0
    rng = np.random.default_rng(5)
    state, now_s = State(np.zeros(3), np.radians([0.0, -14.8, 0.0])), 0.0
    flights = []
    while not system.progress.is_done(system.mission) and len(flights) < 90:
        system.update(state)
        system.update(simulate_scan(LIDAR, NOTHING, state, rng))
        flights.append(system.decide(now_s))
        now_s += 1.0005
        flown = system.state_at(now_s)
        assert flown is not None
        state = State(flown.position_m, flown.attitude_rad, time_s=now_s)
    assert system.progress.is_done(system.mission)
    assert sum(f.mode is Mode.ESCAPE for f in flights) <= 0.2 * len(flights)
