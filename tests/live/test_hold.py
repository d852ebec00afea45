"""What is said of a goal to which no way leads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.avoidance.plan.planner import Planner
from clearway.avoidance.plan.settings import AvoidanceSettings
from clearway.base.state import State
from clearway.live import AvoidanceSystem, FlightDecision
from clearway.live.mission import Mode, Progress
from clearway.live.outputs.explain import NOT_REACHABLE
from clearway.live.outputs.modes import ModeState
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.reach import ReachLibrary
from clearway.sensors import simulate_scan
from clearway.sim.endings import reason_of
from clearway.vehicle.automaton import MovementAutomaton
from worlds_for_tests import GRID, LIBRARY, LIDAR, mission, planner


def test_a_summary_says_why_a_flight_did_not_arrive() -> None:
    """It held short of its goal, or its time was up; there is always a reason."""

    def ended(*modes: Mode) -> str:
        flights = [
            FlightDecision(0.0, ModeState(mode, ""), 0, None, None, False, 0.0, {})  # type: ignore[arg-type]
            for mode in modes
        ]
        return reason_of(flights, mission((30.0, 0.0, 0.0)), Progress(), np.zeros(3))

    assert ended(Mode.NAVIGATION, Mode.HOLD) == NOT_REACHABLE
    assert ended(Mode.HOLD, Mode.ESCAPE) == NOT_REACHABLE
    assert ended(Mode.HOLD, Mode.NAVIGATION) == "its time was up 30 m from goal 1 of 1"
    assert ended() == "its time was up 30 m from goal 1 of 1"


def test_whose_sensor_dies_stays_where_it_has_looked_and_says_so() -> None:
    """It is told apart from one whose goal no way leads to."""
    live = AvoidanceSystem(planner(), mission((60.0, 0.0, 0.0)), lidars=(LIDAR,))
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


ROUND = 24
"""Movements of a full circle."""
MULTIROTOR = ReachLibrary.build(MovementAutomaton.inertialess(), GRID)


def _flown_blind(library: ReachLibrary, escape: str, scans: int) -> tuple[list[object], np.ndarray]:
    """Decisions and places of who flies on for a minute after so many scans, to a goal far off."""
    flies = Planner.of(library, AvoidanceSettings(escape=escape))
    live = AvoidanceSystem(flies, mission((100.0, 0.0, 0.0)), lidars=(LIDAR,))
    state, told, places, now = State(np.zeros(3)), [], [], 0.0
    while now < 60.0:
        state = replace(state, time_s=now)
        live.update(state)
        if len(told) < scans:
            live.update(simulate_scan(LIDAR, ObstacleMap(), state))
        told.append(live.decide(now))
        now += 1.0
        ahead = live.state_at(now)
        assert ahead is not None
        state = replace(state, position_m=ahead.position_m, attitude_rad=ahead.attitude_rad)
        places.append(state.position_m)
    return told, np.array(places)


@pytest.mark.parametrize("scans", [0, 1, 4])
@pytest.mark.parametrize("escape", ["strict", "known"])
@pytest.mark.parametrize("library", [LIBRARY, MULTIROTOR], ids=["plane", "inertialess"])
def test_who_sees_nothing_stays_near_whatever_counts_as_free(
    library: ReachLibrary, escape: str, scans: int
) -> None:
    """Also where no sensor ever told anything, as when it publishes by another name."""
    told, places = _flown_blind(library, escape, scans)
    assert places[:, 0].max() < 15.0  # Ten metres were seen, and a circle takes less than eight.
    assert places[-ROUND:] == pytest.approx(places[-2 * ROUND : -ROUND])  # Its escape, on and on.
    last = told[-1]
    assert last.mode is Mode.HOLD
    assert last.mode_state.held.startswith("no sensor has told anything for ")
    looked = "where it has looked" if last.decision.way_out.certain else "where it is"
    assert last.mode_state.held.endswith(looked)


@pytest.mark.parametrize("library", [LIBRARY, MULTIROTOR], ids=["plane", "inertialess"])
def test_who_asks_for_no_way_out_flies_on_blind_and_is_told_so(library: ReachLibrary) -> None:
    told, places = _flown_blind(library, "off", 4)
    assert places[-1, 0] > 50.0
    assert all(one.mode is not Mode.HOLD for one in told)
    assert "no sensor has told anything for " in told[-1].explanation
    assert told[4].blind_s is None
    assert told[-1].blind_s == pytest.approx(56.0)


def test_who_sees_again_flies_on() -> None:
    live = AvoidanceSystem(
        Planner.of(MULTIROTOR, AvoidanceSettings(escape="known")),
        mission((40.0, 0.0, 0.0)),
        lidars=(LIDAR,),
    )
    state, modes = State(np.zeros(3)), []
    for tick in range(40):
        state = replace(state, time_s=float(tick))
        live.update(state)
        if not 4 <= tick < 20:
            live.update(simulate_scan(LIDAR, ObstacleMap(), state))
        modes.append(live.decide(float(tick)).mode)
        ahead = live.state_at(tick + 1.0)
        assert ahead is not None
        state = replace(state, position_m=ahead.position_m, attitude_rad=ahead.attitude_rad)
    assert Mode.HOLD in modes[8:20]
    assert Mode.HOLD not in modes[21:]
    assert state.position_m[0] > 20.0
