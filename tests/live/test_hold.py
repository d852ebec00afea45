"""What is said of a goal to which no way leads."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from clearway.base.state import State
from clearway.live import AvoidanceSystem
from clearway.live.explain import NOT_REACHABLE
from clearway.live.mission import Mode
from clearway.live.modes import ModeState
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors import simulate_scan
from clearway.sim.run import METRICS
from worlds_for_tests import LIDAR, mission, planner


def test_a_summary_says_that_a_flight_held_short_of_its_goal() -> None:
    def held(*modes: Mode, reached: bool = False) -> object:
        states = [ModeState(mode, "") for mode in modes]
        flights = [SimpleNamespace(mode=state.mode, mode_state=state) for state in states]
        entries = [SimpleNamespace(flight=flight) for flight in flights]
        return METRICS["reason"].of(SimpleNamespace(decisions=entries, reached=reached))

    assert held(Mode.NAVIGATION, Mode.HOLD) == NOT_REACHABLE
    assert held(Mode.HOLD, Mode.ESCAPE) == NOT_REACHABLE
    assert held(Mode.HOLD, Mode.NAVIGATION) is None
    assert held(Mode.HOLD, reached=True) is None
    assert held() is None


def test_whose_sensor_dies_stays_where_it_has_looked_and_says_so() -> None:
    """It flies on in what was seen, and is told apart from one whose goal no way leads to."""
    live = AvoidanceSystem(planner(), mission((60.0, 0.0, 0.0)), (LIDAR,))
    state, told = State(np.zeros(3)), []
    for tick in range(16):
        live.update(replace(state, time_s=float(tick)))
        if tick < 4:
            live.update(simulate_scan(LIDAR, ObstacleMap(), replace(state, time_s=float(tick))))
        told.append(live.decide(float(tick)))
        ahead = live.state_at(tick + 1.0)
        assert ahead is not None
        state = replace(state, position_m=ahead.position_m, attitude_rad=ahead.attitude_rad)
    assert told[3].mode is not Mode.HOLD
    last = next(one for one in reversed(told) if one.mode is not Mode.ESCAPE)
    assert last.mode is Mode.HOLD
    assert last.mode_state.held is not None
    assert last.mode_state.held.startswith("no sensor has told anything for ")
    assert last.explanation.startswith(f"holds safely: {last.mode_state.held}")
    assert all(one.decision.way_out is not None for one in told[1:])
